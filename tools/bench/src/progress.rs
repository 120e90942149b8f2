//! Progress on a terminal; silent in a pipe.

use indicatif::{ProgressBar, ProgressStyle};

/// A line that names the current step.
pub struct Progress(ProgressBar);

impl Progress {
    /// Shows nothing until [`Self::show`].
    pub fn new() -> Self {
        let bar = ProgressBar::new_spinner();
        bar.set_style(ProgressStyle::with_template("{elapsed} {msg}").expect("a fixed template"));
        Progress(bar)
    }

    /// Replaces the line.
    pub fn show(&self, what: impl Into<String>) {
        self.0.set_message(what.into());
        self.0.tick();
    }
}

impl Default for Progress {
    fn default() -> Self {
        Self::new()
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
