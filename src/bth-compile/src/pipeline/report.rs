//! Reports of a compilation.

use crate::stage::{Clock, StageTime};
use crate::{bvh, coordinates, costs, free, marks, tets};
use bth_import as mesh;
use serde::{Deserialize, Serialize};

/// Reports of all stages of a model's compilation.
#[derive(Clone, Debug, Serialize)]
pub struct CompileReport {
    /// BLAKE3 of the source file's bytes, hexadecimal.
    pub source_blake3: String,
    /// Wall-clock time of each stage, in order.
    pub seconds: Vec<StageTime>,
    /// Import.
    pub mesh: mesh::Report,
    /// Coordinates, unless they are `f32`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coordinates: Option<coordinates::CoordinateReport>,
    /// Binary BVH.
    pub bvh: bvh::BvhReport,
    /// Free directions, if they were decided.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub free: Option<free::FreeReport>,
    /// Marking; absent, as the next two, for structures without tetrahedra.
    pub marks: Option<marks::MarkReport>,
    /// Selection.
    pub costs: Option<costs::CostReport>,
    /// Tetrahedralization.
    pub tets: Option<tets::TetReport>,
    /// Probe of the tetrahedralizations, if there were any.
    pub probe: Option<costs::ProbeReport>,
    /// Wide BVH.
    pub collapse: bvh::CollapseReport,
    /// The compiled file.
    pub file: FileReport,
}

/// Size of the compiled file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FileReport {
    /// Bytes of the file.
    pub bytes: u64,
    /// Tet leaves.
    pub tet_leaves: u64,
    /// Triangles in tet leaves.
    pub tet_triangles: u64,
    /// Bytes of the sections that traversal reads.
    pub resident_bytes: u64,
    /// Resident bytes for each triangle of the source; 0 when it has none.
    pub resident_bytes_per_triangle: f64,
}

/// How an object whose vertices move was compiled.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MotionReport {
    /// Frames of the sequence.
    pub frames: u64,
    /// Poses over which the cost of the tree is summed.
    pub poses: u32,
    /// Bytes of the positions of all frames.
    pub position_bytes: u64,
}

/// Reports of the stages between the mesh and the wide BVH; see [`CompileReport`].
#[derive(Default)]
pub(crate) struct StageReports {
    pub(super) coordinates: Option<coordinates::CoordinateReport>,
    pub(super) bvh: bvh::BvhReport,
    pub(super) free: Option<free::FreeReport>,
    pub(super) tets: TetReports,
    pub(super) collapse: bvh::CollapseReport,
}

/// Reports of the stages that lead to tet leaves.
#[derive(Default)]
pub(super) struct TetReports {
    pub(super) marks: Option<marks::MarkReport>,
    pub(super) costs: Option<costs::CostReport>,
    pub(super) tets: Option<tets::TetReport>,
    pub(super) probe: Option<costs::ProbeReport>,
}

impl StageReports {
    /// The status of the worker, if one was needed.
    pub(crate) fn worker(&self) -> Option<&tets::WorkerStatus> {
        let worker = self.tets.tets.as_ref().map(|report| &report.worker);
        worker.filter(|worker| **worker != tets::WorkerStatus::NotNeeded)
    }
}

impl CompileReport {
    pub(super) fn new(
        source_blake3: String,
        clock: Clock,
        mesh: mesh::Report,
        stages: StageReports,
        file: FileReport,
    ) -> Self {
        let StageReports { coordinates, bvh, free, tets, collapse } = stages;
        let TetReports { marks, costs, tets, probe } = tets;
        let seconds = clock.into_times();
        Self {
            source_blake3,
            seconds,
            mesh,
            coordinates,
            bvh,
            free,
            marks,
            costs,
            tets,
            probe,
            collapse,
            file,
        }
    }
}
