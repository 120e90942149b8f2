//! Makes the models of the catalogue.

use std::io::Write;
use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use bth_scenes::catalogue::{ENTRIES, MAX_FACES, find};
use bth_scenes::{topology, write};
use clap::Parser;

/// Makes models for tests, demos and benchmarks; the same bytes on every machine.
#[derive(Parser)]
#[command(version)]
enum Command {
    /// Lists the models.
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
}

fn main() -> Result<()> {
    let mut out = std::io::stdout().lock();
    match Command::parse() {
        Command::List => {
            for e in &ENTRIES {
                writeln!(out, "{:22}{:>8} faces  {}", e.name, e.faces, e.about)?;
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
    }
    Ok(())
}
