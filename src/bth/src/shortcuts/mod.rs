//! Where a ray can begin, and what it can skip.
//!
//! A plain ray begins at the root of an object's tree, at the start of its range, and its leaves
//! are blocks of triangles. Everything else that a file or a batch knows passes through this
//! module:
//!
//! | shortcut | begins | skips |
//! |---|---|---|
//! | [special leaf](SpecialLeaf): tetrahedra | in a leaf, at a face | the tree below it |
//! | [`whole`] | in the only special leaf | the root |
//! | [entry node](FindEntryNode) of coherent rays | at nodes below the root | the nodes above |
//! | [free directions](free) of a start | at a later t, or never | what lies before |
//!
//! No shortcut changes an answer.

mod entry_node;
pub(crate) mod free;
mod tets;

pub(crate) use entry_node::{ENTRY_RAYS, FindEntryNode, entry_run};
pub(crate) use tets::leaf::{SpecialLeaf, has_special_leaves, special, whole};
pub(crate) use tets::whole::{RAYS_PER_PART, SpecialScratch};
