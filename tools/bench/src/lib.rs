//! Measures bth and other CPU ray tracers on identical rays.
//!
//! `rays` makes the seeded ray sets; `structures` and `rivals` are the [`tracer::Contender`]s,
//! which `contenders` builds. Each command of `args` is a module. Those that measure return a
//! report of rows, which become Markdown, JSON and lines of `benchmarks/record`.
#![warn(missing_docs)]

mod args;
mod clock;
mod compare;
mod contenders;
mod isa;
mod load;
mod machine;
mod markdown;
pub mod model;
mod names;
mod output;
pub mod rays;
mod records;
mod report;
pub mod rivals;
mod rounds;
mod scenes;
mod speed;
mod stress;
pub mod structures;
pub mod tracer;
mod truth;

use anyhow::{Result, bail};
use args::{Arguments, Command, RunOptions};
use clap::Parser;
use report::Report;
use std::process::ExitCode;

/// Runs the program.
pub fn run() -> ExitCode {
    let done = match Arguments::parse().command {
        Command::Compare(arguments) => match compare::run(&arguments) {
            Ok(compare::Verdict::Slower) => return ExitCode::from(3),
            other => other.map(drop),
        },
        Command::Record(arguments) => records::record(&arguments),
        Command::Probe(arguments) => load::probe::run(&arguments),
        command => measure(&command).and_then(|(report, options)| report.finish(options)),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            output::note(&format!("error: {error:#}"));
            ExitCode::FAILURE
        }
    }
}

/// Runs a command that makes a report; returns the report and where it goes.
fn measure(command: &Command) -> Result<(Report, &RunOptions)> {
    Ok(match command {
        Command::Speed(arguments) => (speed::measure(arguments)?, &arguments.run),
        Command::Stress(arguments) => (stress::measure(arguments)?, &arguments.run),
        Command::Load(arguments) => (load::measure(arguments)?, &arguments.run),
        Command::Scenes(arguments) => (scenes::measure(arguments)?, &arguments.run),
        Command::Truth(arguments) => (truth::measure(arguments)?, &arguments.run),
        _ => bail!("expected a command that makes a report: speed, truth, stress, load or scenes"),
    })
}
