//! `bthc compile`: a model into a BTH file.

use super::with_threads;
use crate::args::Compile;
use crate::failure::Failure;
use crate::output;
use crate::progress::Progress;
use crate::table::{Table, bytes, count, seconds};
use bth_compile::pipeline::{self, Report};
use bth_compile::tets::WorkerStatus;
use bth_compile::write;
use serde_json::json;
use std::path::Path;

pub(crate) fn run(args: &Compile) -> Result<(), Failure> {
    let path = args.output.clone().unwrap_or_else(|| args.model.with_extension("bth"));
    if path == args.model {
        let message = "the output would replace the model".to_owned();
        return Err(Failure::Usage { message, hint: "name another output with -o" });
    }
    if super::scene::is_scene(args) {
        return super::scene::compile(args, &path);
    }
    let options = args.options();
    let progress = Progress::new(args.quiet || args.json);
    let (compiled, report) =
        with_threads(args.threads, || pipeline::compile(&args.model, &options, &progress))??;
    write::write_atomically(&path, &compiled.bytes)?;
    drop(progress);
    if args.json {
        output::json(&json!({"output": path.to_string_lossy(), "report": report}))?;
    } else if !args.quiet {
        output::text(&summary(&path, &report))?;
    }
    Ok(())
}

/// The report for people: stages with their seconds, then counts.
fn summary(path: &Path, report: &Report) -> String {
    let mut stages = Table::default();
    for stage in &report.seconds {
        stages.row([stage.name, &seconds(stage.seconds)]);
    }
    stages.row(["total", &seconds(report.seconds.iter().map(|s| s.seconds).sum())]);

    let mut facts = Table::default();
    let (mesh, file) = (&report.mesh, &report.file);
    facts.row(["triangles", &count(mesh.triangles)]);
    nonzero(&mut facts, "degenerate (never hit)", mesh.degenerate);
    nonzero(&mut facts, "duplicate", mesh.duplicate);
    nonzero(&mut facts, "elements skipped", mesh.skipped);
    nonzero(&mut facts, "boundary edges", mesh.boundary_edges);
    nonzero(&mut facts, "non-manifold edges", mesh.non_manifold_edges);
    if let Some(marks) = &report.marks {
        facts.row(["suitable nodes", &format!("{} of {}", count(marks.suitable), count(marks.nodes))]);
    }
    if let Some(tets) = &report.tets {
        facts.row(["nodes chosen", &count(tets.chosen)]);
        facts.row(["tet leaves", &count(file.tet_leaves)]);
        facts.row(["triangles in tet leaves", &count(file.tet_triangles)]);
        facts.row(["tetrahedra", &count(tets.tets)]);
        facts.row(["Steiner points", &count(tets.steiner_points)]);
        nonzero(&mut facts, "nodes split after failure", tets.split);
        nonzero(&mut facts, "nodes left to the BVH", tets.given_up);
    }
    facts.row(["file", &bytes(file.bytes)]);
    facts.row(["traversal reads", &bytes(file.resident_bytes)]);
    facts.row(["bytes a triangle", &format!("{:.1}", file.resident_bytes_per_triangle)]);
    format!(
        "{}\n{}{}\n{}",
        stages.render(),
        facts.render(),
        worker_note(report),
        format_args!("wrote {}\n", path.display())
    )
}

pub(super) fn nonzero(table: &mut Table, name: &str, n: u64) {
    if n > 0 {
        table.row([name, &count(n)]);
    }
}

/// Why chosen nodes were not tetrahedralized, if no worker did it.
fn worker_note(report: &Report) -> String {
    note(report.tets.as_ref().map(|t| &t.worker))
}

/// Why there are no tetrahedra, if the worker is the reason.
pub(super) fn note(worker: Option<&WorkerStatus>) -> String {
    match worker {
        Some(WorkerStatus::Missing { hint }) => format!("note: no tetrahedralization worker: {hint}\n"),
        Some(WorkerStatus::Unusable { reason }) => {
            format!("note: tetrahedralization worker unusable: {reason}\n")
        }
        _ => String::new(),
    }
}
