//! The subcommands.

mod cache;
mod compile;
mod compile_one;
mod deliver;
mod depfile;
mod diff;
mod dry_run;
mod holes;
mod import;
mod info;
mod job;
mod jobs;
mod marks;
mod positions;
mod scene;
mod summary;
mod threads;
mod trace;
mod verify;
mod watch;

use crate::args::{Args, Command};
use crate::failure::Failure;
use crate::output;
use clap::CommandFactory;

/// Runs a subcommand. `wants_json`: whether errors are printed as JSON, too.
pub(crate) fn run(command: Command, wants_json: bool) -> Result<(), Failure> {
    crate::progress::listen_for_interrupts(wants_json)?;
    match command {
        Command::Compile(args) => compile::run(&args),
        Command::Cache(args) => cache::run(&args),
        Command::Diff(args) => diff::run(&args),
        Command::Import(args) => import::run(&args),
        Command::Info(args) => info::run(&args),
        Command::Verify(args) => verify::run(&args),
        Command::Marks(args) => marks::run(&args),
        Command::Positions(args) => positions::run(&args),
        Command::Trace(args) => trace::run(&args),
        Command::Completions(args) => {
            let mut script = Vec::new();
            clap_complete::generate(args.shell, &mut Args::command(), "bthc", &mut script);
            Ok(output::text(&String::from_utf8_lossy(&script))?)
        }
        Command::Man => manual(),
    }
}

/// Prints the manual page, subcommands included, as roff.
fn manual() -> Result<(), Failure> {
    let mut page = Vec::new();
    let mut command = Args::command();
    command.build();
    clap_mangen::Man::new(command.clone()).render(&mut page)?;
    for sub in command.get_subcommands().filter(|s| s.get_name() != "help") {
        let man = clap_mangen::Man::new(sub.clone());
        man.render_synopsis_section(&mut page)?;
        man.render_description_section(&mut page)?;
        man.render_options_section(&mut page)?;
    }
    // Subcommands have no separate pages: the page describes them further down.
    let mut page = String::from_utf8_lossy(&page).into_owned();
    for name in command.get_subcommands().map(clap::Command::get_name) {
        page = page.replace(&format!("bthc\\-{name}(1)"), &format!("\\fBbthc {name}\\fR"));
    }
    Ok(output::text(&page)?)
}
