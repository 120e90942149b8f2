//! The rivals. One that is missing on a machine is skipped, with the reason.

pub(crate) mod embree;
mod library;
mod obvhs;
mod tinybvh;

pub(crate) use self::library::installed;

use crate::model::Model;
use crate::tracer::Contender;
use anyhow::Result;

/// A rival that can be measured.
pub struct Rival {
    /// Its name in tables.
    pub name: &'static str,
    build: fn(&Model, &'static str, usize) -> Result<Contender>,
}

/// All rivals, in the order of the tables.
pub const RIVALS: [Rival; 9] = [
    Rival { name: embree::NAME, build: |m, n, t| embree::contender(m, n, &embree::DEFAULT, t) },
    Rival { name: "embree robust", build: |m, n, t| embree::contender(m, n, &embree::ROBUST, t) },
    Rival { name: "embree own", build: |m, n, t| embree::contender(m, n, &embree::OWN, t) },
    Rival { name: "embree robust own", build: |m, n, t| embree::contender(m, n, &embree::ROBUST_OWN, t) },
    Rival { name: "embree compact", build: |m, n, t| embree::contender(m, n, &embree::COMPACT, t) },
    Rival { name: "embree hq packet16", build: |m, n, t| embree::contender(m, n, &embree::PACKETS, t) },
    Rival { name: "embree sse4.2", build: |m, n, t| embree::contender(m, n, &embree::SSE4, t) },
    Rival { name: "tinybvh bvh8 hq", build: |m, n, _| tinybvh::contender(m, n) },
    Rival { name: "obvhs cwbvh", build: |m, n, _| obvhs::contender(m, n) },
];

impl Rival {
    /// Builds the structure, on `threads` threads if the rival supports that.
    ///
    /// # Errors
    /// If its library is missing or fails.
    pub fn build(&self, model: &Model, threads: usize) -> Result<Contender> {
        (self.build)(model, self.name, threads)
    }
}
