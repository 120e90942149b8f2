//! The BTH compiler: mesh → coordinates → bvh → marks → costs → tets → write.
//!
//! Each stage is `fn(&Input, &CompileOptions, &dyn Monitor) -> Result<(Output, CompileReport)>`: it depends on neither files, terminals
//! nor the cache, and its output is the same at any number of threads. From the bottom up:
//!
//! | modules | |
//! |---|---|
//! | [`bvh`], [`sampling`] | crate `bth-bvh`: the binary BVH, its collapse to the wide BVH, sample rays |
//! | [`marks`], [`costs`], [`tets`] | crate `bth-tets`: which nodes become tetrahedralizations, and how |
//! | [`opacity`], [`coordinates`], [`free`], [`mod@write`] | the other stages |
//! | [`pipeline`] | calls the stages in order, from a model to a file |
//! | [`cached`] | the same through a cache of results, which wraps the stages from outside |
//! | [`memory`] | the pipeline and the scenes for triangles that are in memory |
//! | [`scene`] | many objects, each by the pipeline, into one file |
#![warn(missing_docs)]

pub mod cached;
pub mod comparison;
pub mod coordinates;
pub mod free;
pub mod jobs;
pub mod memory;
pub mod opacity;
mod options;
pub mod pipeline;
pub mod scene;
pub mod settings;
pub mod source;
pub mod write;

pub use bth_bvh as bvh;
pub use bth_bvh::sampling;
use bth_bvh::vectors;
pub use bth_tets as tets;
pub use bth_tets::{costs, marks};

pub use bth_import::{Error, Monitor, Place, Result, Silent, error, monitor};
