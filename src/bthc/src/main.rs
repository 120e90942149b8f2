//! `bthc`, the BTH compiler: compiles models, inspects and verifies compiled files, traces rays.

mod args;
mod calibrate;
mod commands;
mod explain;
mod failure;
mod measure;
mod output;
mod progress;
mod ray_files;
mod table;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let wants_json = std::env::args_os().skip(1).take_while(|a| a != "--").any(|a| a == "--json");
    let args = match args::Args::try_parse() {
        Ok(args) => args,
        Err(error) => return failure::usage(&error, wants_json),
    };
    match choose_isa(args.isa).and_then(|()| commands::run(args.command)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(wants_json),
    }
}

/// Chooses the instruction set of the kernels: by the command line, else by the environment.
fn choose_isa(wanted: Option<bth::Isa>) -> Result<(), failure::Failure> {
    let chosen = match wanted {
        Some(isa) => isa.choose(),
        None => bth::Isa::from_environment().map(|_| ()),
    };
    chosen.map_err(|error| failure::Failure::isa(&error, wanted.is_none()))
}
