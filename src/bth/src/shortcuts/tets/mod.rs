//! Walks of rays through the tetrahedra of tet leaves.
//!
//! The rest of the runtime sees a [`SpecialLeaf`](leaf::SpecialLeaf).
//!
//! A single ray is walked in f64 ([`walk`], [`flood`]). The rays of a batch are walked in f32,
//! sixteen to a vector ([`batch`], [`queue`], [`lanes`], [`rounds`]), and in f64 where f32 does not
//! decide ([`decide`]).

mod batch;
mod decide;
mod exit_lanes;
mod flood;
mod lanes;
pub(super) mod leaf;
mod queue;
mod reached;
mod rounds;
mod starts;
mod walk;
mod walks;
pub(super) mod whole;
