//! Guesses of the child that a single ray enters next: the one that the last ray entered from the
//! same node.
//!
//! A step through a node is a long chain of instructions from a child's code to the next one. The
//! processor predicts that a guess is right, as it predicts any branch. It then loads the next node
//! at once, and the chain only confirms the guess (value speculation: Lipasti, Wilkerson and Shen
//! 1996). Guesses change no answer: where one is wrong, the ray goes to the right child.

use crate::query::Goal;
use std::cell::Cell;

/// Number of guesses for queries of a kind. They fit next to the nodes in the first cache.
const SIZE: usize = 1 << BITS;
const BITS: u32 = 8;
/// A guess is followed once this many rays in turn went the same way. Where rays go here and there,
/// the processor would predict wrong guesses, which cost more than the step.
const SURE: u32 = 2;

/// No guesses where they cannot help: modules of WebAssembly and Miri.
const NONE: bool = cfg!(any(target_family = "wasm", miri));

thread_local! {
    static OF_THREAD: Guesses = const { Guesses([const { Guess { code: Cell::new(0), copy: Cell::new(0), times: Cell::new(0) } }; 2 * SIZE]) };
}

/// Guesses by the code of a node. Nodes share entries.
pub(crate) struct Guesses([Guess; 2 * SIZE]);

/// The child that the last ray entered.
pub(crate) struct Guess {
    code: Cell<u32>,
    /// Always equal to `code`. The compiler does not know that: else it would go on with the right
    /// code, which is known late, instead of an equal guess.
    copy: Cell<u32>,
    /// How many rays in turn entered it.
    times: Cell<u32>,
}

impl Guesses {
    /// Calls a function with the guesses of this thread.
    #[inline(always)]
    pub(crate) fn with<T>(f: impl FnOnce(&Guesses) -> T) -> T {
        OF_THREAD.with(f)
    }

    /// The guess for a node. Rays for any hit enter other children than those for the nearest.
    #[inline(always)]
    pub(crate) fn of(&self, node: u32, goal: impl Goal) -> &Guess {
        let hash = node.wrapping_mul(0x9E37_79B1) >> (u32::BITS - BITS);
        &self.0[hash as usize % SIZE + if goal.is_any() { SIZE } else { 0 }]
    }
}

impl Guess {
    /// Returns the code of the child that is entered, from the guess if it is right.
    #[inline(always)]
    pub(crate) fn corrected(&self, next: u32) -> u32 {
        if NONE {
            return next;
        }
        let (times, is_right) = (self.times.get(), next == self.code.get());
        if times >= SURE {
            let copy = self.copy.get();
            if is_right {
                return copy;
            }
        }
        self.times.set(if is_right { times + 1 } else { 0 });
        self.code.set(next);
        self.copy.set(next);
        next
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::query::{AnyHit, NearestHit};
    use bth_random::Rng;

    #[test]
    fn guesses_change_no_code() {
        let mut rng = Rng::new(8);
        Guesses::with(|guesses| {
            for _ in 0..10_000 {
                // More nodes than entries, so that some share one; few children, so that some
                // guesses are right.
                let (node, next) = (rng.below(1000) as u32, rng.below(3) as u32);
                assert_eq!(guesses.of(node, NearestHit).corrected(next), next);
                assert_eq!(guesses.of(node, AnyHit).corrected(next + 7), next + 7);
                assert_eq!(guesses.of(u32::MAX - node, NearestHit).corrected(node), node);
            }
        });
    }
}
