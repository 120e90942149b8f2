//! `bth-play`: renders compiled BTH files and scenes to pictures and animations.

// The window alone moves cameras, changes modes and renders parts of a picture again.
#![cfg_attr(not(feature = "window"), allow(dead_code, unused_imports, unused_variables))]

mod args;
mod camera;
mod color;
mod compile_source;
mod environment;
mod failure;
mod interrupt;
mod materials;
mod messages;
mod output;
mod render;
mod report;
mod sampling;
mod shading;
mod smooth;
#[cfg(feature = "window")]
mod window;

use clap::{CommandFactory, Parser};
use failure::Failure;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

fn main() -> ExitCode {
    bth_files::signals::survive_file_size_limit();
    let wants_json = std::env::args_os().skip(1).take_while(|a| a != "--").any(|a| a == "--json");
    let args = match args::Args::try_parse() {
        Ok(args) => args,
        Err(error) => return failure::usage(&error, wants_json),
    };
    match failure::without_panic(|| run(&args)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(wants_json),
    }
}

fn run(args: &args::Args) -> Result<(), Failure> {
    if let Some(shell) = args.completions {
        let mut script = Vec::new();
        clap_complete::generate(shell, &mut args::Args::command(), "bth-play", &mut script);
        return messages::print(&String::from_utf8_lossy(&script));
    }
    if args.man {
        let mut page = Vec::new();
        clap_mangen::Man::new(args::Args::command()).render(&mut page)?;
        return messages::print(&String::from_utf8_lossy(&page));
    }
    let isa = match args.isa {
        Some(isa) => isa.choose(),
        None => bth::Isa::from_environment().map(|_| ()),
    };
    isa.map_err(|error| Failure::Usage(error.to_string()))?;
    if args.json && args.takes_stdout() {
        return Err(Failure::Usage(
            "standard output takes the pictures or one JSON object; name a file with -o".to_owned(),
        ));
    }
    interrupt::listen(args.json)?;
    let file = args.file()?;
    // Keeps the entry from being evicted from the cache until the end of the program.
    let compiled;
    let mut inputs: Vec<PathBuf> = [file.to_owned()].into_iter().chain(args.env.clone()).collect();
    // Messages name the file that the user named, also where another one is mapped.
    let (mapped, mut scene) = if compile_source::is_source(file) {
        compiled = compile_source::compiled(
            file,
            args.cache_dir.as_deref(),
            args.window || args.mode.shows_materials(),
        )?;
        inputs.extend(compiled.inputs.iter().cloned());
        (Some(compiled.pin.path.as_path()), open(&compiled.pin.path, true)?)
    } else {
        (Some(file).filter(|_| !args.read), open(file, !args.read)?)
    };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(thread_count(args.threads, &scene))
        .build()
        .map_err(|e| Failure::Threads(format!("cannot start {} threads: {e}", args.threads)))?;
    let threads = pool.current_num_threads();
    if args.window {
        let screenshot = args.screenshot.clone().unwrap_or_else(|| args::SCREENSHOT.into());
        output::refuse_inputs(&[screenshot], &inputs)?;
        return show_window(&mut scene, file, args, &pool);
    }
    let output = args.output()?;
    let (report, quiet) =
        pool.install(|| render::render_sequence(&mut scene, file, output, &inputs, args))?;
    report::show(args, &scene, mapped, &report, threads, quiet)
}

fn show_window(
    scene: &mut bth::Scene,
    file: &Path,
    args: &args::Args,
    pool: &rayon::ThreadPool,
) -> Result<(), Failure> {
    #[cfg(feature = "window")]
    return report::window(args, &window::show(scene, file, args, pool)?);
    #[cfg(not(feature = "window"))]
    Err(Failure::Usage("this bth-play was built without its feature `window`; -o writes pictures".to_owned()))
}

/// Threads for each processor where the file does not fit in memory: most of them wait for pages.
const WAITING: usize = 16;

/// The number of threads that was asked for, or the default; 0 is one per processor.
fn thread_count(asked: usize, scene: &bth::Scene) -> usize {
    match asked {
        0 if scene.file().is_paged() => WAITING * std::thread::available_parallelism().map_or(1, usize::from),
        asked => asked,
    }
}

#[allow(unsafe_code)]
fn open(file: &Path, map: bool) -> Result<bth::Scene, bth::Error> {
    if map {
        // SAFETY: `map` requires that bthc wrote the file, and that nobody changes or shrinks it
        // while it is mapped. Without `--read` the user guarantees this, as its help tells. Entries
        // of the cache are read-only and are created by linking a finished file; no program of the
        // workspace opens one for writing, and the hash of this one was compared with what bthc
        // wrote.
        unsafe { bth::map(file) }
    } else {
        bth::open(file)
    }
}
