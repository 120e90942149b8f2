//! Detection of the features of a machine.

use std::sync::atomic::{AtomicU8, Ordering};

/// True if this machine has the features of an instruction set, which is found out once.
pub(in crate::simd) struct Detected {
    find: fn() -> bool,
    /// [`Self::UNKNOWN`], [`Self::MISSING`] or [`Self::PRESENT`].
    state: AtomicU8,
}

impl Detected {
    const UNKNOWN: u8 = 0;
    const MISSING: u8 = 1;
    const PRESENT: u8 = 2;

    pub(in crate::simd) const fn new(find: fn() -> bool) -> Detected {
        Detected { find, state: AtomicU8::new(Detected::UNKNOWN) }
    }

    #[inline]
    pub(in crate::simd) fn get(&self) -> bool {
        match self.state.load(Ordering::Relaxed) {
            Detected::UNKNOWN => self.find(),
            state => state == Detected::PRESENT,
        }
    }

    /// Like [`Self::get`]; false before it was found out.
    #[inline(always)]
    pub(in crate::simd) fn is_found(&self) -> bool {
        self.state.load(Ordering::Relaxed) == Detected::PRESENT
    }

    /// Calls `find`. Threads that run this concurrently store the same value.
    #[cold]
    #[inline(never)]
    fn find(&self) -> bool {
        let found = (self.find)();
        self.state.store(if found { Detected::PRESENT } else { Detected::MISSING }, Ordering::Relaxed);
        found
    }
}
