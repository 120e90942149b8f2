//! What `bthc explain` adds to the table of decisions: measured costs, and pictures.

mod measured;
mod picture;

pub(crate) use measured::{MeasuredNode, measure};
pub(crate) use picture::{free_picture, picture};

use bth_compile::bvh::BinaryBvh;
use bth_compile::costs::{Choice, CostOptions};
use bth_compile::tets::TetMesh;
use bth_import::Mesh;

/// A model and the decisions on its nodes.
pub(crate) struct Explained<'a> {
    pub(crate) mesh: &'a Mesh,
    pub(crate) tree: &'a BinaryBvh,
    pub(crate) choice: &'a Choice,
    pub(crate) costs: &'a CostOptions,
    /// Tetrahedralizations of the chosen nodes; a node that failed may be replaced by some below
    /// it.
    pub(crate) built: &'a [(u32, TetMesh)],
    /// The model compiled with tetrahedra, and with a BVH only.
    pub(crate) compiled: &'a bth::Scene,
    pub(crate) plain: &'a bth::Scene,
}
