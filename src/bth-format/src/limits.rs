//! Every cap in one place. Files beyond them are refused by the reader and not written by the compiler.

/// Wide nodes on a path from the root; bounds the traversal stack: at every level all children but the one entered stay on it.
pub const MAX_DEPTH: usize = 96;
/// Entries of the section table.
pub const MAX_SECTIONS: u32 = 1 << 20;
/// Triangles of an object.
pub const MAX_TRIANGLES: u32 = 1 << 30;
/// Tetrahedra of an object.
pub const MAX_TETS: u32 = 1 << 30;
/// Bytes of a name of a node, camera or light.
pub const MAX_NAME: u32 = 4096;
