//! How stages report progress and are cancelled.

use crate::error::{Error, Result};

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
