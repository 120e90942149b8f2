//! Reports of a compilation.

use super::{Clock, StageTime};
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

/// Reports of the stages between the mesh and the wide BVH; see [`CompileReport`].
pub(crate) struct StageReports {
    coordinates: Option<coordinates::CoordinateReport>,
    bvh: bvh::BvhReport,
    pub(crate) free: Option<free::FreeReport>,
    marks: Option<marks::MarkReport>,
    costs: Option<costs::CostReport>,
    pub(crate) tets: Option<tets::TetReport>,
    probe: Option<costs::ProbeReport>,
    collapse: bvh::CollapseReport,
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
    pub(super) fn new(
        coordinates: Option<coordinates::CoordinateReport>,
        (bvh, free): (bvh::BvhReport, Option<free::FreeReport>),
        TetReports { marks, costs, tets, probe }: TetReports,
        collapse: bvh::CollapseReport,
    ) -> Self {
        Self { coordinates, bvh, free, marks, costs, tets, probe, collapse }
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
        let StageReports { coordinates, bvh, free, marks, costs, tets, probe, collapse } = stages;
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
