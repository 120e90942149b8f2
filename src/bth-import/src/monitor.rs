//! How stages report progress and are cancelled.

use crate::error::{Error, Result};
use std::collections::HashSet;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Receives progress and warnings, and cancels. All methods may be called from any thread.
pub trait Monitor: Sync {
    /// A stage begins that consists of `total` units of work, if that is known.
    fn stage(&self, _name: &'static str, _total: Option<u64>) {}
    /// `units` more units of the stage are done.
    fn advance(&self, _units: u64) {}
    /// Returns true if the user cancelled. Stages call this a few times a second.
    fn cancelled(&self) -> bool {
        false
    }
    /// A message for the user about something that is not an error.
    fn warn(&self, _message: &str) {}
    /// As [`Self::warn`], about this machine or this run and not about what is compiled, so that it
    /// is not kept with results.
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

/// A monitor that also keeps the warnings that it passes on. Of several with the same text the
/// first counts: a document that holds many meshes is read more than once.
pub struct Recording<'a> {
    to: &'a dyn Monitor,
    keeps_notices: bool,
    warnings: Mutex<Warnings>,
}

/// Warnings in their order, without repetitions.
#[derive(Default)]
struct Warnings {
    all: Vec<String>,
    known: HashSet<String>,
}

impl Warnings {
    /// Keeps a warning; whether it is a new one.
    fn keep(&mut self, message: &str) -> bool {
        let is_new = self.known.insert(message.to_owned());
        if is_new {
            self.all.push(message.to_owned());
        }
        is_new
    }
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
        self.lock().all.clone()
    }

    fn lock(&self) -> MutexGuard<'_, Warnings> {
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
        let is_new = self.lock().keep(message);
        if is_new {
            self.to.warn(message);
        }
    }
    fn notice(&self, message: &str) {
        let is_new = !self.keeps_notices || self.lock().keep(message);
        if is_new {
            self.to.notice(message);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Default)]
    struct Heard(Mutex<Vec<String>>);

    impl Monitor for Heard {
        fn warn(&self, message: &str) {
            self.0.lock().unwrap().push(message.to_owned());
        }
    }

    #[test]
    fn warnings_of_the_same_text_are_given_and_kept_once() {
        let heard = Heard::default();
        let all = Recording::with_notices(&heard);
        for _ in 0..2 {
            let of_object = Recording::new(&all);
            ["a", "b", "a"].iter().for_each(|message| of_object.warn(message));
            of_object.notice("c");
            assert_eq!(of_object.warnings(), ["a", "b"]);
        }
        assert_eq!(all.warnings(), ["a", "b", "c"]);
        assert_eq!(*heard.0.lock().unwrap(), ["a", "b", "c"]);
    }
}
