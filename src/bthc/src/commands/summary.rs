//! The report of a compiled model for people.

use crate::table::{Table, bytes, count, seconds};
use bth_compile::free::Kept;
use bth_compile::pipeline::{CompileReport, StageTime};
use bth_compile::tets::WorkerStatus;
use bth_import::Rounding;

/// The stages with their seconds, then counts. `known_rays` are those for which the tree was built.
pub(super) fn summary(report: &CompileReport, known_rays: u64) -> String {
    let mut facts = Table::default();
    let (mesh, file) = (&report.mesh, &report.file);
    facts.row(["triangles", &count(mesh.triangles)]);
    facts.count("degenerate (never hit)", mesh.degenerate);
    facts.count("duplicate", mesh.duplicate);
    if let Some(rounding) = &mesh.rounding {
        facts.count("positions moved by rounding", rounding.positions);
        facts.count("triangles without area by rounding", rounding.triangles);
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
    facts.count("concave polygons", mesh.concave);
    facts.count("elements skipped", mesh.skipped);
    facts.count("boundary edges", mesh.boundary_edges);
    facts.count("non-manifold edges", mesh.non_manifold_edges);
    if let Some(opacity) = &mesh.opacity {
        facts.row(["triangles of cut-out materials", &count(opacity.triangles)]);
        let [opaque, transparent, unknown] = [opacity.opaque, opacity.transparent, opacity.unknown]
            .map(|share| format!("{:.1} %", 100.0 * share));
        facts.row(["opaque, transparent, unknown", &format!("{opaque}, {transparent}, {unknown}")]);
    }
    facts.count("known rays", known_rays);
    if let Some(free) = &report.free {
        let [near, middle, far] = free.beyond.map(|share| 100.0 * share);
        let shares =
            format!("{:.0} %, up to distances {near:.0} %, {middle:.0} %, {far:.0} %", 100.0 * free.free);
        let told = match free.kept {
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
    if let Some(marks) = report.marks.as_ref().filter(|marks| marks.nodes > 0) {
        facts.row(["suitable nodes", &format!("{} of {}", count(marks.suitable), count(marks.nodes))]);
    }
    if let Some(tets) = &report.tets {
        facts.count("nodes chosen", tets.chosen);
        facts.count("tet leaves", file.tet_leaves);
        facts.count("triangles in tet leaves", file.tet_triangles);
        facts.count("tetrahedra", tets.tets);
        facts.count("Steiner points", tets.steiner_points);
        facts.count("nodes split after failure", tets.split);
        facts.count("nodes left to the BVH", tets.given_up);
    }
    facts.row(["file", &bytes(file.bytes)]);
    facts.row(["traversal reads", &bytes(file.resident_bytes)]);
    facts.row(["bytes a triangle", &format!("{:.1}", file.resident_bytes_per_triangle)]);
    format!(
        "{}\n{}{}\n",
        stages(&report.seconds),
        facts.render(),
        worker_note(report.tets.as_ref().map(|t| &t.worker))
    )
}

/// The stages that took any time, and the total.
pub(super) fn stages(all: &[StageTime]) -> String {
    let mut table = Table::default();
    for stage in all.iter().filter(|stage| stage.seconds >= 0.0005) {
        table.row([stage.name, &seconds(stage.seconds)]);
    }
    table.row(["total", &seconds(all.iter().map(|stage| stage.seconds).sum())]);
    table.render()
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
