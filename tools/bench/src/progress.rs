//! Progress on a terminal; silent in a pipe.

use indicatif::{ProgressBar, ProgressStyle};

/// One line that says what is being done.
pub struct Progress(ProgressBar);

impl Progress {
    /// Shows nothing until [`Self::say`].
    pub fn new() -> Self {
        let bar = ProgressBar::new_spinner();
        bar.set_style(ProgressStyle::with_template("{elapsed} {msg}").expect("a fixed template"));
        Progress(bar)
    }

    /// Says what is being done now.
    pub fn say(&self, what: impl Into<String>) {
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
