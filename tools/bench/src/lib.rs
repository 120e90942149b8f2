//! Measures bth and other CPU ray tracers on identical rays.
//!
//! `rays` makes the seeded ray sets; `structures` and `rivals` are the [`tracer::Contender`]s, which `contenders`
//! builds. Each command of [`args::Command`] is a module. Those that measure return a [`report::Report`] of
//! [`records::Row`]s, which become Markdown, JSON and lines of `benchmarks/record`.
#![warn(missing_docs)]

pub mod accuracy;
pub mod args;
pub mod clock;
pub mod compare;
mod contenders;
pub mod isa;
pub mod load;
pub mod machine;
pub mod markdown;
pub mod model;
mod moller_trumbore;
pub mod names;
pub mod output;
pub mod paper;
pub mod progress;
pub mod rays;
pub mod records;
pub mod report;
pub mod rivals;
pub mod rounds;
pub mod scenes;
pub mod speed;
pub mod stress;
pub mod structures;
pub mod tracer;

use args::{Command, RunOptions};
use report::Report;

/// Runs a command that measures; returns its report and where that goes.
///
/// # Errors
/// If an option, model or scene cannot be used, or the command is not one that makes a report.
pub fn measure(command: &Command) -> anyhow::Result<(Report, &RunOptions)> {
    Ok(match command {
        Command::Speed(arguments) => (speed::measure(arguments)?, &arguments.run),
        Command::Accuracy(arguments) => (accuracy::measure(arguments)?, &arguments.run),
        Command::Stress(arguments) => (stress::measure(arguments)?, &arguments.run),
        Command::Load(arguments) => (load::measure(arguments)?, &arguments.run),
        Command::Scenes(arguments) => (scenes::measure(arguments)?, &arguments.run),
        Command::Paper(arguments) => (paper::measure(arguments)?, &arguments.run),
        _ => {
            anyhow::bail!("expected a command that measures: speed, accuracy, stress, load, scenes or paper")
        }
    })
}
