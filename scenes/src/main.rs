//! Makes the models of the catalogue and the scenes that move.

use std::io::Write;
use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use bth_scenes::animations::{self, ANIMATIONS};
use bth_scenes::catalogue::{ENTRIES, MAX_FACES, find};
use bth_scenes::{topology, write};
use clap::Parser;

/// Makes models and scenes for tests, demos and benchmarks; the same bytes on every machine.
#[derive(Parser)]
#[command(version)]
enum Command {
    /// Lists the models and scenes.
    List,
    /// Makes a model.
    Make {
        /// Name of a model (see `list`).
        name: String,
        /// About how many faces [default: see `list`].
        #[arg(long, value_name = "N")]
        faces: Option<u32>,
        /// File to write; its extension (.obj, .ply or .stl) names the format.
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
    },
    /// Makes a scene that moves: NAME.manifest and its models.
    Scene {
        /// Name of a scene (see `list`).
        name: String,
        /// Folder to write into.
        #[arg(short, long, value_name = "FOLDER")]
        output: PathBuf,
    },
}

fn main() -> Result<()> {
    let mut out = std::io::stdout().lock();
    match Command::parse() {
        Command::List => {
            for e in &ENTRIES {
                writeln!(out, "{:22}{:>8} faces  {}", e.name, e.faces, e.about)?;
            }
            for a in &ANIMATIONS {
                writeln!(out, "{:22}   scene        {}", a.name, a.about)?;
            }
        }
        Command::Make { name, faces, output } => {
            let entry = find(&name).with_context(|| format!("no model `{name}`; `list` shows all"))?;
            let faces = faces.unwrap_or(entry.faces);
            ensure!((1..=MAX_FACES).contains(&faces), "--faces must be from 1 to {MAX_FACES}");
            let model = (entry.make)(faces);
            write::file(&model, &output)?;
            let t = topology::topology(&model);
            writeln!(
                out,
                "{}: {} faces, {} positions, {} components, {}",
                output.display(),
                model.triangles.len(),
                model.positions.len(),
                t.components,
                if t.is_closed() { "closed" } else { "not closed" }
            )?;
        }
        Command::Scene { name, output } => {
            let animation =
                animations::find(&name).with_context(|| format!("no scene `{name}`; `list` shows all"))?;
            let scene = (animation.make)();
            for (path, model) in &scene.models {
                let path = output.join(path);
                let folder = path.parent().context("models lie in a folder")?;
                std::fs::create_dir_all(folder)
                    .with_context(|| format!("cannot make {}", folder.display()))?;
                write::file(model, &path)?;
                writeln!(out, "{}: {} faces", path.display(), model.triangles.len())?;
            }
            let path = output.join(format!("{name}.manifest"));
            std::fs::write(&path, scene.manifest.to_toml())
                .with_context(|| format!("cannot write {}", path.display()))?;
            let frames = scene.manifest.frames;
            writeln!(out, "{}: frames {} to {}", path.display(), frames.first, frames.last)?;
        }
    }
    Ok(())
}
