//! Tetrahedralizations of the nodes of a BVH, behind one door: a mesh and its binary BVH go in, tet
//! leaves and reports come out.
//!
//! | modules | |
//! |---|---|
//! | [`marks`] | which nodes may be tetrahedralized: triangles touch only at shared vertices |
//! | [`costs`] | which of these save time: by estimate, then by sample rays through the tets |
//! | [`tetrahedralize`] | runs TetGen in a process, checks its result exactly, encodes it |
#![warn(missing_docs)]

pub mod costs;
pub mod marks;
pub mod tetrahedralize;

pub use tetrahedralize::{
    Behind, Encoded, Face, Leaf, NodeInput, NodeJob, NodeReport, NodeResult, NodeRunner, Outcome, TetMesh,
    TetOptions, TetReport, TimedNodes, WorkerStatus, build, build_through, encode, version, worker,
};
