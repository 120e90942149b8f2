//! `bth-scenes`: writes the models of the catalogue and the animated scenes.

mod failure;

use bth_scenes::animations::{self, ANIMATIONS};
use bth_scenes::catalogue::{self, ENTRIES, MAX_FACES};
use bth_scenes::{topology, write};
use clap::{CommandFactory, Parser};
use failure::{EXIT_CODES, Failure};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Makes models and scenes for tests, demos and benchmarks; the same bytes on every machine.
#[derive(Parser)]
#[command(version, after_help = EXIT_CODES)]
enum Command {
    /// Lists the models and scenes.
    List,
    /// Makes a model.
    Make {
        /// Name of a model (see `list`).
        name: String,
        /// About how many faces [default: see `list`].
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_FACES)))]
        faces: Option<u32>,
        /// File to write; its extension (.obj, .ply or .stl) names the format.
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
    },
    /// Makes an animated scene: NAME.manifest and its models.
    Scene {
        /// Name of a scene (see `list`).
        name: String,
        /// Folder to write into.
        #[arg(short, long, value_name = "FOLDER")]
        output: PathBuf,
    },
    /// Prints a completion script for a shell.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
    /// Prints the manual page.
    Man,
}

fn main() -> ExitCode {
    let result = match Command::parse() {
        Command::List => list(),
        Command::Make { name, faces, output } => make(&name, faces, &output),
        Command::Scene { name, output } => scene(&name, &output),
        Command::Completions { shell } => completions(shell),
        Command::Man => manual(),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}

/// A name that is not in the catalogue of `kind`s; `names` are those that are. One of the other
/// catalogue needs the command `other`.
fn unknown<'a>(
    kind: &str,
    found: &str,
    names: impl Iterator<Item = &'a str>,
    other: Option<&str>,
) -> Failure {
    let names: Vec<&str> = names.collect();
    Failure::Usage {
        message: format!("expected the name of a {kind}, found {found:?}"),
        hint: match other {
            Some(command) => format!("`bth-scenes {command} {found}` makes it"),
            None => format!("the {kind}s are {}", names.join(", ")),
        },
    }
}

fn list() -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    for e in &ENTRIES {
        writeln!(out, "{:22}{:>8} faces  {}", e.name, e.faces, e.about)?;
    }
    for a in &ANIMATIONS {
        writeln!(out, "{:22}   scene        {}", a.name, a.about)?;
    }
    Ok(())
}

fn make(name: &str, faces: Option<u32>, output: &Path) -> Result<(), Failure> {
    let entry = catalogue::find(name).ok_or_else(|| {
        unknown("model", name, ENTRIES.iter().map(|e| e.name), animations::find(name).map(|_| "scene"))
    })?;
    let model = (entry.make)(faces.unwrap_or(entry.faces));
    write::file(&model, output)?;
    let topology = topology::topology(&model);
    writeln!(
        std::io::stdout().lock(),
        "{}: {} faces, {} positions, {} components, {}",
        output.display(),
        model.triangles.len(),
        model.positions.len(),
        topology.components,
        if topology.is_closed() { "closed" } else { "not closed" }
    )?;
    Ok(())
}

fn scene(name: &str, folder: &Path) -> Result<(), Failure> {
    let animation = animations::find(name).ok_or_else(|| {
        unknown("scene", name, ANIMATIONS.iter().map(|a| a.name), catalogue::find(name).map(|_| "make"))
    })?;
    let mut out = std::io::stdout().lock();
    let scene = (animation.make)();
    for (path, model) in &scene.models {
        let path = folder.join(path);
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent).map_err(|e| Failure::file(parent, e))?;
        }
        write::file(model, &path)?;
        writeln!(out, "{}: {} faces", path.display(), model.triangles.len())?;
    }
    let path = folder.join(format!("{name}.manifest"));
    let manifest = scene.manifest.to_toml();
    bth_files::replace(&path, |file| file.write_all(manifest.as_bytes()))
        .map_err(|e| Failure::file(&path, e))?;
    let frames = scene.manifest.frames;
    writeln!(out, "{}: frames {} to {}", path.display(), frames.first, frames.last)?;
    Ok(())
}

fn completions(shell: clap_complete::Shell) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Command::command(), "bth-scenes", &mut script);
    Ok(std::io::stdout().lock().write_all(&script)?)
}

/// Prints the manual page, subcommands included, as roff.
fn manual() -> Result<(), Failure> {
    let mut page = Vec::new();
    let mut command = Command::command();
    command.build();
    clap_mangen::Man::new(command.clone()).render(&mut page)?;
    for sub in command.get_subcommands().filter(|sub| sub.get_name() != "help") {
        let man = clap_mangen::Man::new(sub.clone());
        man.render_synopsis_section(&mut page)?;
        man.render_description_section(&mut page)?;
        man.render_options_section(&mut page)?;
    }
    // Subcommands have no separate pages: this page describes them further down.
    let mut page = String::from_utf8_lossy(&page).into_owned();
    for name in command.get_subcommands().map(clap::Command::get_name) {
        page = page.replace(&format!("bth\\-scenes\\-{name}(1)"), &format!("\\fBbth\\-scenes {name}\\fR"));
    }
    Ok(std::io::stdout().lock().write_all(page.as_bytes())?)
}
