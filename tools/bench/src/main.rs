//! `bth-bench`: measures bth and other CPU ray tracers on identical rays.

use bth_bench::args::{Arguments, Command};
use bth_bench::compare::Verdict;
use bth_bench::{compare, load, measure, output, records};
use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let done = match Arguments::parse().command {
        Command::Compare(arguments) => match compare::run(&arguments) {
            Ok(Verdict::Slower) => return ExitCode::from(3),
            other => other.map(drop),
        },
        Command::Record(arguments) => records::record(&arguments),
        Command::Summary(arguments) => records::run_summary(&arguments),
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
