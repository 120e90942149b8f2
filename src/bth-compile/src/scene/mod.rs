//! The compilation of scenes: manifest → plan (visible nodes, source files) → meshes → objects →
//! file.
//!
//! `compile` is the entry, `in_memory` that for meshes in memory; `objects` compiles all objects
//! and `object` one; `sources` and `meshes` read the source files, `of_file` names them in
//! warnings; `clips` gives the poses of objects that skins and morph targets deform; `sections`
//! holds the sections of objects, and `keeper` keeps them until they are written; `encode` lays out
//! the scene itself.

mod clips;
mod compile;
mod context;
mod deformers;
mod encode;
mod files;
mod images;
mod in_memory;
mod keeper;
mod meshes;
mod moving;
mod object;
mod objects;
mod of_file;
mod paint;
mod parallel;
mod places;
mod plan;
mod report;
mod sections;
mod sources;
mod visible;
mod whole_files;

pub use compile::{CachePolicy, SceneSource, ShardReport, compile, compile_cached, compile_objects, dry_run};
pub use files::files;
pub(crate) use in_memory::compile_meshes;
pub use in_memory::{Instance, SceneNames};
pub use report::{ObjectReport, SceneReport};
