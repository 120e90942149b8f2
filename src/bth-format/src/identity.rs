//! Numbers that tell apart what a process opens.

use std::sync::atomic::{AtomicUsize, Ordering};

/// A number that no other object or scene of the process has or had. What is measured of one is
/// kept under it: an address could later belong to another object, opened after this one closed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity(usize);

impl Identity {
    /// A number that was never returned before, and is not 0.
    #[expect(clippy::new_without_default, reason = "no two are equal")]
    pub fn new() -> Identity {
        static LAST: AtomicUsize = AtomicUsize::new(0);
        Identity(LAST.fetch_add(1, Ordering::Relaxed).wrapping_add(1))
    }

    /// The number itself.
    #[inline(always)]
    pub fn number(self) -> usize {
        self.0
    }
}
