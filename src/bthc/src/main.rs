//! `bthc`, the BTH compiler: compiles models, inspects and verifies compiled files, traces rays.

mod args;
mod commands;
mod deep;
mod failure;
mod output;
mod overwrite;
mod progress;
mod ray_files;
mod table;
mod temporary;
mod version;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    bth_files::signals::survive_file_size_limit();
    let wants_json = std::env::args_os().skip(1).take_while(|a| a != "--").any(|a| a == "--json");
    let args = match args::Args::try_parse() {
        Ok(args) => args,
        Err(error) => return failure::usage(&error, wants_json),
    };
    let done = std::panic::catch_unwind(|| run(args, wants_json)).unwrap_or_else(|panic| {
        // The message was printed when it was raised.
        let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
        let message = text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default();
        Err(bth_compile::Error::Internal { code: "BTH-X090", message: format!("panicked: {message}") }.into())
    });
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(wants_json),
    }
}

fn run(args: args::Args, wants_json: bool) -> Result<(), failure::Failure> {
    choose_isa(args.isa)?;
    match args.command {
        _ if args.version => version::show(args.verbose),
        Some(command) => commands::run(command, wants_json),
        None => Err(failure::Failure::Usage {
            message: "expected a command".to_owned(),
            hint: "see `bthc --help`",
        }),
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
