//! `bth-play`: renders compiled BTH files and scenes to pictures and animations.

mod args;
mod camera;
mod clay;
mod develop;
mod failure;
mod frame;
mod inside;
mod legend;
mod lights;
mod manifests;
mod occlusion;
mod path;
mod picture;
mod progress;
mod ramp;
mod report;
mod sampling;
mod sequence;
mod sink;
mod stage;
mod surface;
mod window;

use clap::{CommandFactory, Parser};
use failure::Failure;
use std::process::ExitCode;

fn main() -> ExitCode {
    let wants_json = std::env::args_os().skip(1).take_while(|a| a != "--").any(|a| a == "--json");
    let args = match args::Args::try_parse() {
        Ok(args) => args,
        Err(error) => return failure::usage(&error, wants_json),
    };
    match run(&args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(wants_json),
    }
}

fn run(args: &args::Args) -> Result<(), Failure> {
    if let Some(shell) = args.completions {
        let mut script = Vec::new();
        clap_complete::generate(shell, &mut args::Args::command(), "bth-play", &mut script);
        return report::print(&String::from_utf8_lossy(&script));
    }
    let isa = match args.isa {
        Some(isa) => isa.choose(),
        None => bth::Isa::from_environment().map(|_| ()),
    };
    isa.map_err(|error| Failure::Usage(error.to_string()))?;
    let file = args.file()?;
    // What is mapped from the cache is not evicted before the end of the program.
    let compiled;
    let (file, mut scene) = if manifests::is_source(file) {
        compiled = manifests::compiled(file, args.cache_dir.as_deref())?;
        (compiled.path.as_path(), open(&compiled.path, true)?)
    } else {
        (file, open(file, args.map)?)
    };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(args.threads)
        .build()
        .map_err(|e| Failure::Usage(format!("cannot start {} threads: {e}", args.threads)))?;
    let threads = pool.current_num_threads();
    if args.window {
        let shown = window::show(&mut scene, file, args, &pool)?;
        return report::window(args, &shown);
    }
    let output = args.output()?;
    let (report, quiet) = pool.install(|| sequence::render(&mut scene, file, output, args))?;
    report::show(args, &scene, file, &report, threads, quiet)
}

#[allow(unsafe_code)]
fn open(file: &std::path::Path, map: bool) -> Result<bth::Scene, bth::Error> {
    if map {
        // SAFETY: the contract of `map` is that the file is one that bthc wrote, and that nobody
        // changes or shrinks it while it is mapped. The user takes that over with `--map`, whose
        // help says so. Entries of the cache are written once, read-only, by linking a finished file;
        // no program of ours opens one for writing, and this one had the hash of what bthc wrote.
        unsafe { bth::map(file) }
    } else {
        bth::open(file)
    }
}
