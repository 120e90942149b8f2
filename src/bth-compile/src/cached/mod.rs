//! Compilation through the cache: results that were made from the same content are taken from there.
//!
//! This module wraps the pipeline from outside; no stage depends on it. `cache` accesses the store, `keys` lists what each
//! result depends on, `warnings` keeps what the user has been told with the results, `codec`, `rows` and `topology` turn results into bytes, `stages` and `nodes` are the decorators of the
//! pipeline and of the tetrahedralization, and `compile` runs the pipeline through them. A damaged result is built again; a
//! cache that cannot be written costs time and nothing else.

mod cache;
mod codec;
mod compile;
mod keys;
mod log;
mod nodes;
mod rows;
mod stages;
mod topology;
mod warnings;

pub use cache::Cache;
pub use compile::{CachedCompilation, DryRun, compile, dry_run};
pub use log::{Log, Miss};

pub(crate) use codec::{Codec, MeshSummary, decode, encode};
pub(crate) use compile::{compile_or_fetch, compile_triangles, joined, tetgen_in_keys};
pub(crate) use keys::{MOTION, ObjectKeys, extension, file_index, mesh, scene};
pub(crate) use rows::{HashedRows, RowReader, RowWriter};
pub(crate) use stages::CachedStages;
pub(crate) use warnings::{replay, warnings};
