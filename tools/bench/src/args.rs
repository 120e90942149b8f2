//! The command line. Each command keeps its options in its own module; options of several commands
//! are here.

use crate::rays::View;
use crate::{compare, load, records, scenes, speed, stress, truth};
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;

/// Measures bth and other CPU ray tracers on identical rays.
#[derive(Debug, Parser)]
#[command(name = "bth-bench", version, max_term_width = 100)]
pub(crate) struct Arguments {
    /// What to measure.
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Rays per second of our structures and the rivals.
    Speed(speed::Speed),
    /// Is a build of libbth faster than another? One interleaved run; exit code 3 if it is slower.
    Compare(compare::Compare),
    /// Measures what a definition names, and appends the rows to the record of this machine.
    Record(records::RecordRows),
    /// Wrong answers against time, for engines from package registries.
    Truth(truth::Truth),
    /// Hard rays and points on hard surfaces, every answer checked exactly.
    Stress(stress::Stress),
    /// Opening a compiled model or scene and tracing the first rays, against building at the start.
    Load(load::Load),
    /// Scenes that move and objects that deform: updates and rays, ours and Embree's.
    Scenes(scenes::Scenes),
    /// One start in a separate process; `load` calls this.
    #[command(hide = true)]
    Probe(load::Probe),
}

/// The models, and the place of the cameras.
#[derive(Debug, Args)]
pub(crate) struct Models {
    /// Model files, folders of recorded rays, or models of `bth-scenes list` by NAME or NAME:FACES.
    #[arg(required = true, value_name = "MODEL")]
    pub(crate) models: Vec<String>,
    /// Put the cameras outside of the models, or inside as is right for rooms; by default each
    /// model decides.
    #[arg(long, value_name = "WHERE")]
    pub(crate) view: Option<View>,
}

/// How a command runs and where its report goes.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct RunOptions {
    /// Vector instructions of our kernels; by default the best that the machine has.
    #[arg(long, value_name = "NAME")]
    pub(crate) isa: Option<String>,
    /// Small pictures and one round: shows that it works, not how fast it is.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Write the figures there, as JSON.
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,
    /// Keep a report in this folder: DATE-NAME.md and DATE-NAME.json.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Name of the report; by default the command's.
    #[arg(long, value_name = "NAME", value_parser = file_name)]
    pub(crate) name: Option<String>,
}

impl RunOptions {
    /// The number of rounds: 1 in a quick run.
    pub(crate) fn rounds(&self, wanted: usize) -> usize {
        if self.quick { 1 } else { wanted }
    }
}

/// Parses a share given in percent, such as `1%`, as a fraction.
pub(crate) fn share(text: &str) -> Result<f64, String> {
    let number = text.strip_suffix('%').and_then(|n| n.trim().parse::<f64>().ok());
    let share = number.filter(|p| (0.0..100.0).contains(p)).map(|p| p / 100.0);
    share.ok_or_else(|| "expected a share such as 1%".to_owned())
}

/// Parses a part of a file's name.
fn file_name(text: &str) -> Result<String, String> {
    let is_name = !text.is_empty() && !text.contains(|c| std::path::is_separator(c) || c.is_control());
    is_name.then(|| text.to_owned()).ok_or_else(|| "expected a name, without folders".to_owned())
}

/// Parses a whole number from 1.
pub(crate) fn at_least_one(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|n| *n > 0).ok_or_else(|| "expected a number from 1".to_owned())
}
