//! The BTH compiler: mesh → coordinates → bvh → marks → costs → tets → free → write.
//!
//! The output of each stage depends on its inputs and options alone: not on files, terminals, the
//! cache or the number of threads. From the bottom up:
//!
//! | modules | |
//! |---|---|
//! | [`bvh`], [`sampling`] | crate `bth-bvh`: binary BVH, collapse to the wide BVH, sample rays |
//! | [`marks`], [`costs`], [`tets`] | crate `bth-tets`: the tetrahedralizations of nodes |
//! | [`opacity`], [`coordinates`], [`free`], [`mod@write`] | the work of the other stages |
//! | `stage` | what all stages have: name, version, key, run |
//! | [`cached`] | the cache, which runs stages and keeps their results |
//! | [`pipeline`] | the list of stages: from a model to a file |
//! | [`scene`] | many objects, each by the same stages, into one file |
//! | [`memory`] | both for triangles that are in memory |
#![warn(missing_docs)]

pub mod cached;
pub mod coordinates;
pub mod free;
pub mod jobs;
pub mod memory;
pub mod opacity;
mod options;
pub mod pipeline;
pub mod scene;
pub mod settings;
mod shard;
pub mod source;
mod stage;
pub mod write;

pub use bth_bvh as bvh;
pub use bth_bvh::sampling;
use bth_bvh::vectors;
pub use bth_tets as tets;
pub use bth_tets::{costs, marks};

pub use shard::Shard;

pub use bth_import::{Error, Monitor, Place, Result, Silent, error, monitor};
