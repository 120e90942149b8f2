//! Objects that deform: new positions of the source's vertices, for which the boxes of the same nodes are computed again.
//!
//! A file that is compiled with `--deformable` says for each leaf which vertices of the source stand in it. New positions go
//! from there into the leaves, and boxes from the leaves to the root, in memory of the scene's own ([`refit`]), by tasks that are
//! determined once ([`plan`]). The tree remains that of the pose for which it was compiled; [`cost`] tells how much worse it is
//! for the new one.

mod cost;
mod deforming;
mod plan;
mod refit;

pub(crate) use deforming::Deforming;
