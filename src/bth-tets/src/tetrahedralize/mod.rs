//! Constrained tetrahedralizations of chosen nodes by the TetGen worker, checked exactly.
//!
//! gather (triangles, box) → free_space (extra points) → worker (TetGen, a separate process) →
//! check (with nudge) → order (Hilbert) → encode (the file's sections). `build` schedules the
//! nodes over a pool of workers and replaces a node that fails by smaller ones.

mod build;
mod check;
mod encode;
mod faces;
mod failure;
mod free_space;
mod gather;
mod node;
mod nudge;
mod options;
mod order;
mod orientation;
mod pool;
mod report;
mod worker;

pub use build::{build, build_through};
pub use encode::{Encoded, encode};
pub use gather::NodeInput;
pub use node::{NodeJob, NodeResult, NodeRunner, TimedNodes};
pub use options::TetOptions;
pub use pool::{version, worker};
pub use report::{NodeReport, Outcome, TetReport, WorkerStatus};

/// A tet leaf: the node of the binary BVH, and its tetrahedralization.
pub type Leaf = (u32, TetMesh);

/// A checked tetrahedralization of one node's triangles inside a box slightly larger than the
/// node's.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TetMesh {
    /// Box that the tetrahedra fill.
    pub lower: [f32; 3],
    /// Upper end of the box.
    pub upper: [f32; 3],
    /// Positions, in Hilbert order: corners of the triangles and of the box, free-space and Steiner
    /// points.
    pub vertices: Vec<[f32; 3]>,
    /// Vertices of each tetrahedron, in Hilbert order of the centroids, in ascending order of
    /// vertex index; every tetrahedron has non-zero volume (its orientation sign depends on the
    /// order).
    pub tets: Vec<[u32; 4]>,
    /// What lies behind the face opposite to each vertex of a tetrahedron.
    pub behind: Vec<[Behind; 4]>,
    /// Constrained faces, in Hilbert order of their centroids: one per triangle of the node.
    pub faces: Vec<Face>,
    /// Points that are neither corners of triangles nor of the box.
    pub steiner_points: u32,
}

/// The neighbour of a tetrahedron across a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Behind {
    /// This tetrahedron.
    Tet(u32),
    /// This constrained face (and beyond it its other tetrahedron).
    Face(u32),
    /// Nothing, because it is a face of the hull.
    Hull,
}

/// A constrained face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Face {
    /// Triangle id in the source.
    pub triangle: u32,
    /// Its vertices in source order, rows of `TetMesh::vertices`.
    pub vertex: [u32; 3],
    /// The tetrahedron on the side that (v1-v0)x(v2-v0) points to, and the one behind.
    pub tet: [u32; 2],
}
