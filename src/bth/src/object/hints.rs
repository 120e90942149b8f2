//! How rays that start on known surfaces are traced: told, or left to measurement.

use std::str::FromStr;
use std::sync::atomic::{AtomicU8, Ordering};

/// Names what to do: `measured`, `bvh` or `tets`.
const VARIABLE: &str = "BTH_HINTS";

/// What batches do with hints where a file has tetrahedra and a BVH beside them. Answers are the same bits always; this is
/// for measurements and tests.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Hinted {
    /// Whichever way has proved the faster for such rays through the object, on this thread.
    #[default]
    Measured,
    /// Nothing: all rays go through the BVH.
    Bvh,
    /// Rays that may gain by it go through tetrahedra first.
    Tets,
}

/// 0: not chosen yet; else the place in `ALL`, plus one.
static CHOSEN: AtomicU8 = AtomicU8::new(0);

impl Hinted {
    const ALL: [(Hinted, &str); 3] =
        [(Hinted::Measured, "measured"), (Hinted::Bvh, "bvh"), (Hinted::Tets, "tets")];

    /// What all tracing in this process does from now on.
    pub fn choose(self) {
        CHOSEN.store(self as u8 + 1, Ordering::Relaxed);
    }

    /// What tracing does: what [`Self::choose`] said, else what the environment variable `BTH_HINTS` says if that is known,
    /// else [`Hinted::Measured`].
    pub fn chosen() -> Hinted {
        match CHOSEN.load(Ordering::Relaxed) {
            0 => {
                let named = std::env::var(VARIABLE).ok().and_then(|name| name.parse().ok());
                let hinted: Hinted = named.unwrap_or_default();
                // Two threads that get here at once store the same.
                hinted.choose();
                hinted
            }
            n => Hinted::ALL[usize::from(n) - 1].0,
        }
    }
}

impl FromStr for Hinted {
    type Err = ();
    fn from_str(name: &str) -> Result<Self, ()> {
        Hinted::ALL.iter().find(|(_, own)| *own == name).map(|(hinted, _)| *hinted).ok_or(())
    }
}
