//! What `paper` measured, as it is written to JSON.

use crate::output::Head;
use crate::rays::View;
use bth_compile::costs::Profile;
use serde::Serialize;

/// Everything that was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PaperResults {
    /// When and where.
    #[serde(flatten)]
    pub head: Head,
    /// Costs of the scalar traversals.
    pub profile: Profile,
    /// In the order of the command line.
    pub scenes: Vec<PaperScene>,
}

/// What was measured on a model, which the paper calls a scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PaperScene {
    /// Name without folder.
    pub name: String,
    /// Triangles.
    pub triangles: usize,
    /// Where the cameras stand.
    pub view: View,
    /// The structures.
    pub rows: Vec<StructureRow>,
    /// What could not be built, and why.
    pub left_out: Vec<String>,
}

/// What was measured of a structure.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StructureRow {
    /// Its name.
    pub structure: String,
    /// Seconds to construct it on one thread.
    pub construction: f64,
    /// Milliseconds to render the far and the close view: CPU time of all threads over their number.
    pub milliseconds: [f64; 2],
    /// Pixels that hit where the exact answer misses, or the other way round.
    pub differ: [usize; 2],
    /// Bytes that traversal reads.
    pub bytes: u64,
    /// Share of the triangles in tetrahedra.
    pub in_tets: f64,
    /// Tet leaves.
    pub leaves: usize,
}

impl PaperScene {
    /// The row of a structure.
    pub fn row(&self, structure: &str) -> Option<&StructureRow> {
        self.rows.iter().find(|r| r.structure == structure)
    }

    /// Ratio of two structures' times to render a view.
    pub fn ratio(&self, of: &str, to: &str, view: usize) -> Option<f64> {
        Some(self.row(of)?.milliseconds[view] / self.row(to)?.milliseconds[view])
    }

    /// Ratio of two structures' times to be constructed.
    pub fn construction_ratio(&self, of: &str, to: &str) -> Option<f64> {
        Some(self.row(of)?.construction / self.row(to)?.construction)
    }
}
