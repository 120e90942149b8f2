//! The report of a compiled model for people.

use crate::table::{Table, bytes, count, seconds};
use bth_compile::free::Kept;
use bth_compile::pipeline::CompileReport;
use bth_compile::tets::WorkerStatus;
use bth_import::Rounding;

/// The stages with their seconds, then counts. `known_rays` are those for which the tree was built.
pub(super) fn summary(report: &CompileReport, known_rays: u64) -> String {
    let mut stages = Table::default();
    for stage in &report.seconds {
        stages.row([stage.name, &seconds(stage.seconds)]);
    }
    stages.row(["total", &seconds(report.seconds.iter().map(|s| s.seconds).sum())]);

    let mut facts = Table::default();
    let (mesh, file) = (&report.mesh, &report.file);
    facts.row(["triangles", &count(mesh.triangles)]);
    row_unless_zero(&mut facts, "degenerate (never hit)", mesh.degenerate);
    row_unless_zero(&mut facts, "duplicate", mesh.duplicate);
    if let Some(rounding) = &mesh.rounding {
        row_unless_zero(&mut facts, "positions moved by rounding", rounding.positions);
        row_unless_zero(&mut facts, "triangles without area by rounding", rounding.triangles);
    }
    if let Some(avoided) = &mesh.avoided_rounding {
        let Rounding { positions, farthest, triangles } = avoided;
        let f32_would = format!(
            "f64; f32 would move {} by up to {farthest:.2e}, and {} triangles would lose their area",
            count(*positions),
            count(*triangles)
        );
        facts.row(["positions", &f32_would]);
    }
    row_unless_zero(&mut facts, "concave polygons", mesh.concave);
    row_unless_zero(&mut facts, "elements skipped", mesh.skipped);
    row_unless_zero(&mut facts, "boundary edges", mesh.boundary_edges);
    row_unless_zero(&mut facts, "non-manifold edges", mesh.non_manifold_edges);
    if let Some(opacity) = &mesh.opacity {
        facts.row(["triangles of cut-out materials", &count(opacity.triangles)]);
        let [opaque, transparent, unknown] = [opacity.opaque, opacity.transparent, opacity.unknown]
            .map(|share| format!("{:.1} %", 100.0 * share));
        facts.row(["opaque, transparent, unknown", &format!("{opaque}, {transparent}, {unknown}")]);
    }
    row_unless_zero(&mut facts, "known rays", known_rays);
    if let Some(free) = &report.free {
        let [near, middle, far] = free.beyond.map(|share| 100.0 * share);
        let shares =
            format!("{:.0} %, up to distances {near:.0} %, {middle:.0} %, {far:.0} %", 100.0 * free.free);
        let told = match free.kept {
            Kept::None if free.undecided => {
                "left out of objects so large; --free-directions auto finds them".to_owned()
            }
            Kept::None if free.worth.is_none_or(|worth| worth.is_unmeasured()) => {
                "none kept: no ray met the model, or the limit on bytes leaves no room".to_owned()
            }
            Kept::None => {
                format!("not worth their bytes: {}", free.worth.unwrap_or_default())
            }
            Kept::Distances => format!("{shares}; distances kept"),
            Kept::Directions => format!("{shares}; kept"),
        };
        facts.row(["free directions", &told]);
    }
    if let Some(found) = &report.coordinates {
        facts.row(["coordinates", &format!("{} bits", found.bits)]);
        facts.row(["vertices moved by at most", &found.displacement.to_string()]);
    }
    if let Some(marks) = &report.marks {
        facts.row(["suitable nodes", &format!("{} of {}", count(marks.suitable), count(marks.nodes))]);
    }
    if let Some(tets) = &report.tets {
        facts.row(["nodes chosen", &count(tets.chosen)]);
        facts.row(["tet leaves", &count(file.tet_leaves)]);
        facts.row(["triangles in tet leaves", &count(file.tet_triangles)]);
        facts.row(["tetrahedra", &count(tets.tets)]);
        facts.row(["Steiner points", &count(tets.steiner_points)]);
        row_unless_zero(&mut facts, "nodes split after failure", tets.split);
        row_unless_zero(&mut facts, "nodes left to the BVH", tets.given_up);
    }
    facts.row(["file", &bytes(file.bytes)]);
    facts.row(["traversal reads", &bytes(file.resident_bytes)]);
    facts.row(["bytes a triangle", &format!("{:.1}", file.resident_bytes_per_triangle)]);
    format!(
        "{}\n{}{}\n",
        stages.render(),
        facts.render(),
        worker_note(report.tets.as_ref().map(|t| &t.worker))
    )
}

/// Adds a row unless the count is 0.
pub(super) fn row_unless_zero(table: &mut Table, name: &str, n: u64) {
    if n > 0 {
        table.row([name, &count(n)]);
    }
}

/// Why nodes were not tetrahedralized, if the worker is missing or unusable.
pub(super) fn worker_note(worker: Option<&WorkerStatus>) -> String {
    match worker {
        Some(WorkerStatus::Missing { hint }) => format!("note: no tetrahedralization worker: {hint}\n"),
        Some(WorkerStatus::Unusable { reason }) => {
            format!("note: tetrahedralization worker unusable: {reason}\n")
        }
        _ => String::new(),
    }
}
