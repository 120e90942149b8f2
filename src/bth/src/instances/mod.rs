//! Scenes of instances that move: per time the tracks and the hierarchy (`pose`), the instances' inverses
//! and boxes (`placed`), a BVH over these (`top_level`), and batches of rays through it (`batch`: rays that go together, `packets`, and others, `walk`)
//! and into objects (`entry`).
//!
//! A ray is transformed into the space of each object that it may meet and traced there, with t unchanged.

mod affine;
mod batch;
mod enter_object;
mod packets;
mod placement;
mod pose;
mod round;
mod top_level;
mod tracks;
mod traverse;
mod visit_queue;
mod world;

pub use world::Update;
pub(crate) use world::World;
