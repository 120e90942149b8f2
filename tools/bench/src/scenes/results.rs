//! What `scenes` measured, as it is written to JSON.

use crate::output::Head;
use serde::Serialize;

/// Everything that was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ScenesResults {
    /// When and where.
    #[serde(flatten)]
    pub head: Head,
    /// In the order of the command line.
    pub scenes: Vec<SceneTimes>,
}

/// What was measured on a scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SceneTimes {
    /// Its name.
    pub name: String,
    /// Instances, visible or not.
    pub instances: u32,
    /// Objects.
    pub objects: u32,
    /// Triangles of all instances.
    pub triangles: u64,
    /// The frames that were measured.
    pub frames: Vec<i32>,
    /// Rays of each set, all frames together.
    pub rays: [u64; 3],
    /// The contenders.
    pub rows: Vec<ContenderRow>,
    /// What could not be built, and why.
    pub left_out: Vec<String>,
}

/// What was measured of a contender.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ContenderRow {
    /// Its name.
    pub name: String,
    /// Whether it is one of ours, whose answers have to be the same to the last bit.
    pub ours: bool,
    /// Seconds to compile or build the objects.
    pub build_s: f64,
    /// Share of the objects' triangles in tetrahedra.
    pub in_tets: f64,
    /// Milliseconds of a frame: the update, then each set of rays. Medians of the rounds, mean over the frames.
    pub milliseconds: [f64; 4],
    /// Answers that differ from those of our plain BVH.
    pub differ: u64,
}

/// Parts of a frame that are compared: the camera rays, the first bounce, and all of them; each with the update.
pub(super) const PARTS: [&str; 3] = ["camera", "diffuse", "path"];

impl ContenderRow {
    /// Milliseconds of a frame that traces these rays.
    pub fn frame(&self, part: usize) -> f64 {
        let [update, camera, diffuse, later] = self.milliseconds;
        update + [camera, diffuse, camera + diffuse + later][part]
    }
}

impl SceneTimes {
    /// The time of `over` divided by that of `of`, for a part of the frame.
    pub fn speedup(&self, of: &str, over: &str, part: usize) -> Option<f64> {
        let row = |name: &str| self.rows.iter().find(|r| r.name == name);
        Some(row(over)?.frame(part) / row(of)?.frame(part))
    }
}
