//! Reports of a scene's compilation.

use crate::pipeline::MotionReport;
use crate::stage::StageTime;
use crate::tets::WorkerStatus;
use bth_import::{OpacityReport, Rounding};
use serde::{Deserialize, Serialize};

/// CompileReport on an object of the file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ObjectReport {
    /// Its names in the manifest; several for equal geometry.
    pub names: Vec<String>,
    /// Triangles.
    pub triangles: u64,
    /// Triangles of zero area.
    pub degenerate: u64,
    /// What rounding positions to f32 moves and drops, where that is more than next to nothing; not
    /// known, as the next, of objects that were taken from an earlier file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rounding: Option<Rounding>,
    /// What it would move and drop, if positions are kept in f64 instead.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub avoided_rounding: Option<Rounding>,
    /// Tet leaves.
    pub tet_leaves: u64,
    /// Triangles in tet leaves.
    pub tet_triangles: u64,
    /// Bytes of its sections that tracing reads.
    #[serde(default)]
    pub resident_bytes: u64,
    /// Opacity of its triangles, where some are not opaque; not known of objects that were taken
    /// from an earlier file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub opacity: Option<OpacityReport>,
    /// How it was compiled if its vertices move by themselves; not known of objects that were taken
    /// from an earlier file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<MotionReport>,
    /// True if it was copied unchanged from a compiled file.
    pub copied: bool,
}

/// CompileReport on a scene and the stages of its compilation.
#[derive(Clone, Debug, Serialize)]
pub struct SceneReport {
    /// Wall-clock time of each stage, summed over all objects.
    pub seconds: Vec<StageTime>,
    /// Objects of the file, in order.
    pub objects: Vec<ObjectReport>,
    /// Objects of the manifest that no visible instance uses.
    pub unused: Vec<String>,
    /// Nodes.
    pub nodes: u64,
    /// Instances that may be visible.
    pub instances: u64,
    /// Instances as the file holds them: each group of nodes once.
    pub rows: u64,
    /// Tracks.
    pub tracks: u64,
    /// Cameras.
    pub cameras: u64,
    /// Lights.
    pub lights: u64,
    /// Objects that deform.
    pub deformers: u64,
    /// First frame.
    pub first_frame: i32,
    /// Last frame.
    pub last_frame: i32,
    /// Frames per second.
    pub rate: f64,
    /// Triangles of all objects.
    pub triangles: u64,
    /// Triangles of all instances.
    pub instanced_triangles: u64,
    /// Bytes of the file.
    pub bytes: u64,
    /// Bytes of the objects' sections that traversal reads.
    pub resident_bytes: u64,
    /// The tetrahedralization worker, if one was needed.
    pub worker: Option<WorkerStatus>,
}
