//! New positions of a deformable object, and the refit of its tree.
//!
//! A deformable object knows for each leaf which vertices of the source are in it. Positions that
//! the caller gives, or that an animation computes ([`crate::animation`]), are staged
//! ([`own_positions`]). A refit copies them into the leaves and computes boxes from the leaves to
//! the root ([`boxes`]), in memory of the scene, by tasks that are made once ([`plan`]). The tree
//! stays the one that was compiled; [`cost`] tells how much worse it is for the new positions.

mod boxes;
mod cost;
mod own_positions;
mod plan;

pub(crate) use own_positions::OwnPositions;

use std::time::Duration;

/// Statistics of the refit of some objects.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Refitted {
    /// Number of the objects.
    pub(crate) objects: usize,
    /// Max expected cost of rays through one of them relative to the cost for its compiled
    /// positions; 1 without objects.
    pub(crate) cost_ratio: f64,
    pub(crate) time: Duration,
}
