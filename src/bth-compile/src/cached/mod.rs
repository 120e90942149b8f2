//! The cache of results: what was made from the same content is taken from there.
//!
//! [`Cache`] accesses the store and runs stages; `codec`, `rows` and `topology` turn results into
//! bytes; `warnings` keeps what the user was told with the results; `nodes` keeps
//! tetrahedralizations of single nodes. A damaged result is made again; a cache that cannot be
//! written costs time and nothing else.

mod cache;
mod codec;
mod log;
mod nodes;
mod rows;
mod text;
mod topology;
mod warnings;

pub use cache::Cache;
pub use log::{Log, Miss};

pub(crate) use codec::{Codec, MeshSummary, decode, encode, geometry};
pub(crate) use nodes::CachedNodes;
pub(crate) use rows::{HashedRows, RowReader, Sink};
pub(crate) use text::{fields, text};
pub(crate) use topology::Topology;
pub(crate) use warnings::{replay, with_warnings};
