//! Progress on a terminal, and cancellation by Ctrl-C, SIGTERM or SIGHUP.

use crate::failure::Failure;
use crate::output::{self, Interrupted};
use crate::temporary;
use bth_compile::Monitor;
use bth_files::{Diagnosis, signals};
use indicatif::{HumanCount, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::io::IsTerminal;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Set by Ctrl-C and the signals that are like it; stages poll it a few times a second.
static CANCELLED: AtomicBool = AtomicBool::new(false);
/// Values of [`Progress`] that live: while there is one, stages poll [`CANCELLED`].
static POLLERS: AtomicUsize = AtomicUsize::new(0);
/// Set once a signal was left to the error that was being reported.
static LEFT_ALONE: AtomicBool = AtomicBool::new(false);

/// Makes Ctrl-C stop the compilation cleanly; a second one ends the program at once, as does the
/// first where nothing polls for it: while standard input is read, and in commands without stages.
/// SIGTERM and SIGHUP are like Ctrl-C.
///
/// # Errors
/// `BTH-L090` if the thread that waits for signals cannot be started.
pub(crate) fn listen_for_interrupts(wants_json: bool) -> Result<(), Failure> {
    let end = move || {
        let again = CANCELLED.swap(true, Ordering::Relaxed);
        if again || POLLERS.load(Ordering::Relaxed) == 0 {
            let cancelled = bth_compile::Error::Cancelled;
            match output::interrupt() {
                // The second signal is reported, too: `timeout` sends one to the program and at
                // once another to its group.
                Interrupted::Silent => drop(Diagnosis::from(&cancelled).report(wants_json)),
                Interrupted::Begun => {}
                // The program ends by itself, unless nobody reads the report.
                Interrupted::Failing if !LEFT_ALONE.swap(true, Ordering::Relaxed) => return,
                Interrupted::Failing => {}
            }
            temporary::exit(Failure::from(cancelled).exit_code());
        }
    };
    match signals::install(|| ctrlc::set_handler(end)) {
        // Nothing would end the program, since the signals are taken over already.
        Err(ctrlc::Error::System(e)) => Err(no_thread(&e, "signals")),
        // Else it fails only when a handler is there already, and then Ctrl-C works anyway.
        _ => Ok(()),
    }
}

/// Returns true if the user cancelled.
pub(crate) fn is_cancelled() -> bool {
    CANCELLED.load(Ordering::Relaxed)
}

/// Stops the compilation cleanly when standard input ends.
///
/// # Errors
/// `BTH-L090` if the thread that waits for the end cannot be started.
pub(crate) fn end_with_input() -> Result<(), Failure> {
    let wait = || {
        // An error is an end, too.
        let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
        CANCELLED.store(true, Ordering::Relaxed);
    };
    match std::thread::Builder::new().spawn(wait) {
        Ok(_) => Ok(()),
        Err(e) => Err(no_thread(&e, "the end of standard input")),
    }
}

fn no_thread(error: &std::io::Error, awaits: &str) -> Failure {
    let message = format!("cannot start a thread that waits for {awaits}: {error}");
    bth_compile::Error::Limit { code: "BTH-L090", message }.into()
}

/// Units per second, without decimals.
fn whole_rate(state: &ProgressState, out: &mut dyn std::fmt::Write) {
    // An error of the writer does not stop the bar.
    let _ = write!(out, "{}/s", HumanCount(state.per_sec() as u64));
}

/// Shows stage, count, rate and remaining time on standard error if that is a terminal.
#[derive(Debug)]
pub(crate) struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// Without stages if `quiet`. Warnings are printed in any case.
    pub(crate) fn new(quiet: bool) -> Self {
        let visible = !quiet && std::io::stderr().is_terminal();
        let target = if visible { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        POLLERS.fetch_add(1, Ordering::Relaxed);
        Self { bar: ProgressBar::with_draw_target(None, target) }
    }

    /// Turns the bar into one that counts jobs.
    pub(crate) fn of_jobs(self, total: u64) -> Self {
        self.stage("models", Some(total));
        self
    }

    /// Counts a finished job.
    pub(crate) fn done(&self) {
        self.bar.inc(1);
    }

    /// Prints a line above the bar.
    pub(crate) fn print(&self, line: &str) {
        // A closed standard output is ignored, since the files are written all the same.
        self.bar.suspend(|| {
            let _ = output::text(&format!("{line}\n"));
        });
    }
}

/// Monitor of one of many jobs: shows no stages, and names the model in warnings.
pub(crate) struct Quiet<'a> {
    all: &'a Progress,
    model: &'a Path,
}

impl<'a> Quiet<'a> {
    pub(crate) fn new(all: &'a Progress, model: &'a Path) -> Self {
        Self { all, model }
    }
}

impl Monitor for Quiet<'_> {
    fn cancelled(&self) -> bool {
        self.all.cancelled()
    }
    fn warn(&self, message: &str) {
        self.all.warn(&format!("{}: {message}", self.model.display()));
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
        POLLERS.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Monitor for Progress {
    fn stage(&self, name: &'static str, total: Option<u64>) {
        let template = match total {
            Some(_) => "{msg:<12} {bar:30} {human_pos}/{human_len}  {rate}  {eta} left",
            None => "{msg:<12} {spinner} {human_pos}  {elapsed}",
        };
        self.bar.reset();
        if let Ok(style) = ProgressStyle::with_template(template) {
            self.bar.set_style(style.with_key("rate", whole_rate));
        }
        match total {
            Some(total) => self.bar.set_length(total),
            None => self.bar.unset_length(),
        }
        self.bar.set_message(name);
    }
    fn advance(&self, units: u64) {
        self.bar.inc(units);
    }
    fn cancelled(&self) -> bool {
        is_cancelled()
    }
    fn warn(&self, message: &str) {
        self.bar.suspend(|| output::warning(message));
    }
}
