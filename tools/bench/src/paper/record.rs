//! What `paper` measured, as it is written to JSON.

use crate::output::Head;
use crate::rays::View;
use bth_compile::costs::Profile;
use serde::Serialize;

/// Everything.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PaperRecord {
    /// When and where.
    #[serde(flatten)]
    pub head: Head,
    /// Costs of the scalar traversals.
    pub profile: Profile,
    /// In the order of the command line.
    pub scenes: Vec<SceneRecord>,
}

/// A scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SceneRecord {
    /// Name without folder.
    pub name: String,
    /// Triangles.
    pub triangles: usize,
    /// Where it is seen from.
    pub view: View,
    /// The structures.
    pub rows: Vec<Row>,
    /// What could not be built, and why.
    pub left_out: Vec<String>,
}

/// A structure.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
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

impl SceneRecord {
    /// The row of a structure.
    pub fn row(&self, structure: &str) -> Option<&Row> {
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
