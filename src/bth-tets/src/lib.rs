//! Tetrahedralizations of the nodes of a BVH, behind one door: a mesh and its binary BVH go in, tet
//! leaves and reports come out.
//!
//! | modules | |
//! |---|---|
//! | [`marks`] | which nodes may be tetrahedralized: their triangles touch only where they share vertices |
//! | [`costs`] | which of these are worth it: the expected time of rays, and sample rays once the tetrahedra exist |
//! | [`tetrahedralize`] | the constrained tetrahedralization by TetGen, a process, checked exactly and encoded |
#![warn(missing_docs)]

pub mod costs;
pub mod marks;
pub mod tetrahedralize;

pub use tetrahedralize::{
    Behind, Encoded, Face, Leaf, NodeInput, NodeJob, NodeReport, NodeResult, NodeRunner, Outcome, TetMesh,
    TetOptions, TetReport, TimedNodes, WorkerStatus, build, build_through, encode, encoded_bytes, version,
    worker,
};
