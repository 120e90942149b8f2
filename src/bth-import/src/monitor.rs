//! How stages report progress and are cancelled.

use crate::error::{Error, Result};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Receives progress and warnings, and cancels. All methods may be called from any thread.
pub trait Monitor: Sync {
    /// A stage begins that consists of `total` units of work, if that is known.
    fn stage(&self, _name: &'static str, _total: Option<u64>) {}
    /// `units` more units of the stage are done.
    fn advance(&self, _units: u64) {}
    /// Whether the user cancelled. Stages call this a few times a second.
    fn cancelled(&self) -> bool {
        false
    }
    /// A message for the user about something that is not an error.
    fn warn(&self, _message: &str) {}
    /// As [`Self::warn`], about this machine or this run and not about what is compiled, so that it is not kept with results.
    fn notice(&self, message: &str) {
        self.warn(message);
    }
}

impl dyn Monitor + '_ {
    /// Fails with [`Error::Cancelled`] once the user cancelled.
    pub fn check(&self) -> Result<()> {
        if self.cancelled() { Err(Error::Cancelled) } else { Ok(()) }
    }
}

/// A monitor that ignores everything and never cancels.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;
impl Monitor for Silent {}

/// A monitor that also keeps the warnings that it passes on.
pub struct Recording<'a> {
    to: &'a dyn Monitor,
    keeps_notices: bool,
    warnings: Mutex<Vec<String>>,
}

impl<'a> Recording<'a> {
    /// Keeps warnings about what is compiled.
    pub fn new(to: &'a dyn Monitor) -> Self {
        Self { to, keeps_notices: false, warnings: Mutex::default() }
    }

    /// Keeps notices about this run, too.
    pub fn with_notices(to: &'a dyn Monitor) -> Self {
        Self { keeps_notices: true, ..Self::new(to) }
    }

    /// The warnings so far.
    pub fn warnings(&self) -> Vec<String> {
        self.lock().clone()
    }

    fn lock(&self) -> MutexGuard<'_, Vec<String>> {
        self.warnings.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl std::fmt::Debug for Recording<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Recording").field("warnings", &self.warnings()).finish_non_exhaustive()
    }
}

impl Monitor for Recording<'_> {
    fn stage(&self, name: &'static str, total: Option<u64>) {
        self.to.stage(name, total);
    }
    fn advance(&self, units: u64) {
        self.to.advance(units);
    }
    fn cancelled(&self) -> bool {
        self.to.cancelled()
    }
    fn warn(&self, message: &str) {
        self.lock().push(message.to_owned());
        self.to.warn(message);
    }
    fn notice(&self, message: &str) {
        if self.keeps_notices {
            self.lock().push(message.to_owned());
        }
        self.to.notice(message);
    }
}
