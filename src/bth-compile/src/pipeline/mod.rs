//! The compilation of a model: import → coordinates → BVH → visits → costs → marks → tets → probe →
//! free directions → collapse → file.
//!
//! `compiler` calls the stages in order; each is a `Stage` (`stage.rs`) in a separate file.
//! `compile` is the way in, for a model in a file or in memory, with or without a cache.
//! Very large meshes go from their coordinates to the wide tree in `parts`.
//! `direct` is the short way in, for a mesh in memory and a fast BVH.

mod choose_nodes;
mod compile;
mod compiler;
mod direct;
mod free_directions;
mod hashed;
mod import;
mod keys;
mod marks;
mod moving;
mod object;
mod parts;
mod place;
mod provenance;
mod report;
mod tetrahedralize;
mod traced;
mod tree;

pub use crate::options::{CompileOptions, MotionOptions, Structure};
pub use crate::stage::StageTime;
pub use compile::{CachedCompilation, CompileInput, DryRun, compile, compile_cached, compile_parts, dry_run};
pub use direct::{compile_fast, compile_model_fast, fast_model};
pub use object::Compiled;
pub use report::{CompileReport, FileReport, MotionReport};

pub(crate) use compile::{compile_or_fetch, tetgen_in_keys};
pub(crate) use compiler::Compiler;
pub(crate) use import::Import;
pub(crate) use keys::{MOTION, ObjectKeys, scene};
pub(crate) use moving::{PoseSource, warn_of_options};
pub(crate) use parts::{in_parts, may_be_in_parts};
pub(crate) use provenance::of_scene as provenance_of_scene;
