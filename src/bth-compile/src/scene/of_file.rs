//! Warnings about one of the source files of a scene.

use super::sources::File;
use crate::monitor::Monitor;

/// Passes warnings about a file on with its name, where the scene has several. What is kept has
/// them without: it is found by content, whatever the file is called.
pub(super) struct OfFile<'a> {
    to: &'a dyn Monitor,
    name: Option<&'a str>,
}

impl<'a> OfFile<'a> {
    pub(super) fn new(file: &File<'a>, to: &'a dyn Monitor) -> Self {
        Self { to, name: file.shown }
    }
}

impl Monitor for OfFile<'_> {
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
        match self.name {
            Some(name) => self.to.warn(&format!("{name}: {message}")),
            None => self.to.warn(message),
        }
    }
    fn notice(&self, message: &str) {
        self.to.notice(message);
    }
}
