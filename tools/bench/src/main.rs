//! `bth-bench`: measures bth beside other CPU ray tracers on identical rays.

use bth_bench::args::{Arguments, Command};
use bth_bench::compare::Verdict;
use bth_bench::{
    accuracy, animation, compare, costs, inside, instances, load, output, paper, quality, records, refit,
    scales, scenes, shutter, speed, stress,
};
use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let done = match Arguments::parse().command {
        Command::Speed(arguments) => speed::run(&arguments),
        Command::Compare(arguments) => match compare::run(&arguments) {
            Ok(Verdict::Slower) => return ExitCode::from(3),
            other => other.map(drop),
        },
        Command::Record(arguments) => records::record(&arguments),
        Command::Summary(arguments) => records::run_summary(&arguments),
        Command::Accuracy(arguments) => accuracy::run(&arguments),
        Command::Load(arguments) => load::run(&arguments),
        Command::LoadScenes(arguments) => load::scenes::run(&arguments),
        Command::Stress(arguments) => stress::run(&arguments),
        Command::Inside(arguments) => inside::run(&arguments),
        Command::Costs(arguments) => costs::run(&arguments),
        Command::Paper(arguments) => paper::run(&arguments),
        Command::Quality(arguments) => quality::run(&arguments),
        Command::Scales(arguments) => scales::run(&arguments),
        Command::Scenes(arguments) => scenes::run(&arguments),
        Command::Instances(arguments) => instances::run(&arguments),
        Command::Refit(arguments) => refit::run(&arguments),
        Command::Animation(arguments) => animation::run(&arguments),
        Command::Shutter(arguments) => shutter::run(&arguments),
        Command::Probe(arguments) => load::probe::run(&arguments),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            output::note(&format!("error: {error:#}"));
            ExitCode::FAILURE
        }
    }
}
