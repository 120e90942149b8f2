//! How stages report progress and learn that they should stop.

use crate::error::{Error, Result};

/// Watches a compilation; called from any thread.
pub trait Monitor: Sync {
    /// A stage begins; `total` units of work if that is known.
    fn stage(&self, _name: &'static str, _total: Option<u64>) {}
    /// `units` more are done.
    fn advance(&self, _units: u64) {}
    /// Whether the user asked to stop; stages look a few times a second.
    fn cancelled(&self) -> bool {
        false
    }
    /// Something that the user should know but that stops nothing.
    fn warn(&self, _message: &str) {}
}

impl dyn Monitor + '_ {
    /// Fails with [`Error::Cancelled`] once the user asked to stop.
    pub fn check(&self) -> Result<()> {
        if self.cancelled() { Err(Error::Cancelled) } else { Ok(()) }
    }
}

/// Watches nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;
impl Monitor for Silent {}
