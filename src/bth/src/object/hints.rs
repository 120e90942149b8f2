//! Setting of how rays that start on known triangles are traced, by the caller or the environment.

use std::str::FromStr;
use std::sync::atomic::{AtomicU8, Ordering};

/// Environment variable with the default: `measured`, `bvh` or `tets`.
const HINTS_VARIABLE: &str = "BTH_HINTS";

/// How batches use hints where a file has tetrahedra and a BVH over the same triangles, or knows of free directions. Answers have the
/// same bits in all cases; the setting serves measurements and tests.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Hinted {
    /// Rays take the strategy that was measured to be faster for such rays through the object on this thread.
    #[default]
    Measured,
    /// Hints are not used: all rays go through the BVH.
    Bvh,
    /// Hints are used wherever they can be: rays in free directions end, rays that may be faster through tetrahedra walk through them
    /// first.
    Tets,
}

/// 0 if no value is chosen yet, else the index of the value in `ALL` plus one.
static CHOSEN_HINTS: AtomicU8 = AtomicU8::new(0);

impl Hinted {
    const ALL: [(Hinted, &str); 3] =
        [(Hinted::Measured, "measured"), (Hinted::Bvh, "bvh"), (Hinted::Tets, "tets")];

    /// Sets how all later batches of this process use hints.
    pub fn choose(self) {
        CHOSEN_HINTS.store(self as u8 + 1, Ordering::Relaxed);
    }

    /// The value set by [`Self::choose`], else the one that the environment variable `BTH_HINTS` names, else
    /// [`Hinted::Measured`].
    pub fn chosen() -> Hinted {
        match CHOSEN_HINTS.load(Ordering::Relaxed) {
            0 => {
                let named = std::env::var(HINTS_VARIABLE).ok().and_then(|name| name.parse().ok());
                let hinted: Hinted = named.unwrap_or_default();
                // Two threads that are here at the same time store the same value.
                hinted.choose();
                hinted
            }
            n => Hinted::ALL[usize::from(n) - 1].0,
        }
    }
}

impl Hinted {
    /// Whether hints are used although that may take longer.
    pub(crate) fn are_forced() -> bool {
        Hinted::chosen() == Hinted::Tets
    }
}

impl FromStr for Hinted {
    type Err = ();
    fn from_str(name: &str) -> Result<Self, ()> {
        Hinted::ALL.iter().find(|(_, spelling)| *spelling == name).map(|(hinted, _)| *hinted).ok_or(())
    }
}
