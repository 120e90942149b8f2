//! The BTH compiler: mesh → coordinates → bvh → marks → costs → tets → write.
//!
//! Each stage is `fn(&Input, &Options, &dyn Monitor) -> Result<(Output, Report)>`,
//! knows nothing of files or terminals, and gives the same output at any number of threads.
#![warn(missing_docs)]

pub mod bvh;
pub mod cached;
pub mod coordinates;
pub mod costs;
pub mod jobs;
pub mod marks;
pub mod pipeline;
pub mod scene;
pub mod tets;
pub mod write;

pub use bth_import::{Error, Monitor, Place, Result, Silent, error, monitor};
