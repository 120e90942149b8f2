//! The bytes of a `.bth` file, version 1: every structure on disk.
//!
//! `format-spec/README.md` is normative; a test compares its tables with these structures. All
//! numbers are little-endian. Structures have no padding and no pointers: a reference is an index,
//! and [`NONE`] is no index.

mod assert_layout;
mod bvh;
mod container;
mod deformer;
mod free;
mod grid;
mod grid_leaves;
mod groups;
pub mod kind;
mod materials;
mod object;
mod opacity;
mod places;
mod scene;
mod tets;

pub use bvh::*;
pub use container::*;
pub use deformer::*;
pub use free::*;
pub use grid::*;
pub use grid_leaves::*;
pub use groups::*;
pub use materials::*;
pub use object::*;
pub use opacity::*;
pub use places::*;
pub use scene::*;
pub use tets::*;

/// No index: the reference leads nowhere.
pub const NONE: u32 = u32::MAX;
