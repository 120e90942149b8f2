//! The worker that tetrahedralizes for the BTH compiler, with TetGen.
//!
//! It serves `bth-tetgen-protocol` on its standard input and output, one job after the other.
//! Usage: `bth-tetgen [--memory BYTES] [--parent PID]`; without a compiler it is of no use.

mod process;
mod serve;
mod tetgen;

use std::process::ExitCode;

fn main() -> ExitCode {
    let mut memory = None;
    let mut parent = None;
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let value = arguments.next().and_then(|v| v.parse::<u64>().ok());
        match (argument.as_str(), value) {
            ("--memory", Some(bytes)) => memory = Some(bytes),
            ("--parent", Some(pid)) => parent = Some(pid),
            _ => return usage(),
        }
    }
    if parent.is_none() && std::io::IsTerminal::is_terminal(&std::io::stdin()) {
        return usage();
    }
    let served = process::frames_apart_from_prints().and_then(|output| {
        process::confine(memory, parent)?;
        serve::serve(std::io::stdin().lock(), output)
    });
    match served {
        Ok(()) => ExitCode::SUCCESS,
        Err(_) => ExitCode::FAILURE,
    }
}

#[expect(clippy::print_stderr, reason = "this is the program")]
fn usage() -> ExitCode {
    eprintln!("bth-tetgen {} (TetGen {})", env!("CARGO_PKG_VERSION"), tetgen::VERSION);
    eprintln!("A worker of the BTH compiler, which starts it: bth-tetgen [--memory BYTES] [--parent PID]");
    ExitCode::from(2)
}
