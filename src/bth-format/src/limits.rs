//! Every cap in one place. The reader refuses files beyond them, and the compiler writes none.

/// Nodes on a path from the root (BTH-F110). Bounds the traversal stack, on which at every level
/// all children but the one entered stay.
pub const MAX_DEPTH: usize = 96;
/// Entries of the section table (BTH-F008).
pub const MAX_SECTIONS: u32 = 1 << 22;
/// Triangles of an object (BTH-F022).
pub const MAX_TRIANGLES: u32 = 1 << 30;
/// Tetrahedra of an object (BTH-F022).
pub const MAX_TETS: u32 = 1 << 30;
/// Words of an object that hold states of micro-triangles (BTH-F022).
pub const MAX_OPACITY_WORDS: u32 = 1 << 28;
/// Rows of LEAF_VERTICES of an object (BTH-F022): more than the leaves of all lines have.
pub const MAX_LEAF_VERTICES: u32 = 1 << 28;
/// Bytes of the name of a group or material (BTH-F144), of an object (BTH-F148), or of a node,
/// camera or light (BTH-F153).
pub const MAX_NAME: u32 = 4096;
/// Nodes on a path of a hierarchy whose groups have stored trees (BTH-F212).
pub const MAX_STORED_LEVELS: u32 = 64;
/// Instances on the way to an instance of an object through groups of nodes, that one included
/// (BTH-F188).
pub const MAX_PATH: u32 = 16;
