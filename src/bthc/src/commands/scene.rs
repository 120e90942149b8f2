//! `bthc compile` of scenes: glTF files and manifests.

use super::compile::{nonzero, note};
use super::with_threads;
use crate::args::Compile;
use crate::failure::Failure;
use crate::output;
use crate::progress::Progress;
use crate::table::{Table, bytes, count, seconds};
use bth_compile::scene::{self, SceneReport};
use bth_compile::write;
use bth_scene::Manifest;
use serde_json::json;
use std::path::Path;

/// Whether a compilation is one of a scene.
pub(super) fn is_scene(args: &Compile) -> bool {
    is_manifest(&args.model) || is_gltf(&args.model) && !args.flatten
}

fn has_extension(path: &Path, extensions: &[&str]) -> bool {
    path.extension().is_some_and(|e| extensions.iter().any(|wanted| e.eq_ignore_ascii_case(wanted)))
}

fn is_manifest(path: &Path) -> bool {
    has_extension(path, &["manifest", "toml"])
}

/// Whether a path names a glTF file.
pub(super) fn is_gltf(path: &Path) -> bool {
    has_extension(path, &["gltf", "glb"])
}

/// The folder that paths of a scene count from.
pub(super) fn folder(scene: &Path) -> &Path {
    scene.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Compiles a scene.
pub(super) fn compile(args: &Compile, path: &Path) -> Result<(), Failure> {
    let progress = Progress::new(args.quiet || args.json);
    let (manifest, import) = if is_manifest(&args.model) {
        (bth_scene::read(&args.model)?, None)
    } else {
        let name = args.model.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let (manifest, report) = scene::import(&args.model, &name, &args.gltf.options(), &progress)?;
        (manifest, Some(report))
    };
    let (compiled, report) = with_threads(args.threads, || {
        scene::compile(&manifest, folder(&args.model), &args.model, &args.options(), &progress)
    })??;
    write::write_atomically(path, &compiled.bytes)?;
    drop(progress);
    if args.json {
        let output = path.to_string_lossy();
        output::json(&json!({"output": output, "scene": report, "import": import}))?;
    } else if !args.quiet {
        output::text(&summary(path, &manifest, &report))?;
    }
    Ok(())
}

/// The report for people.
fn summary(path: &Path, manifest: &Manifest, report: &SceneReport) -> String {
    let mut stages = Table::default();
    for stage in &report.seconds {
        stages.row([stage.name, &seconds(stage.seconds)]);
    }
    stages.row(["total", &seconds(report.seconds.iter().map(|s| s.seconds).sum())]);

    let mut facts = Table::default();
    facts.row(["nodes", &count(report.nodes)]);
    facts.row(["instances", &count(report.instances)]);
    facts.row(["objects", &count(report.objects.len() as u64)]);
    let used = (manifest.objects.len() - report.unused.len()) as u64;
    nonzero(&mut facts, "objects of equal geometry, stored once", used - report.objects.len() as u64);
    nonzero(&mut facts, "objects that nobody sees, left out", report.unused.len() as u64);
    nonzero(&mut facts, "tracks", report.tracks);
    nonzero(&mut facts, "cameras", report.cameras);
    nonzero(&mut facts, "lights", report.lights);
    facts.row(["frames", &format!("{} to {} at {}/s", report.first_frame, report.last_frame, report.rate)]);
    facts.row(["triangles", &count(report.triangles)]);
    facts.row(["triangles of all instances", &count(report.instanced_triangles)]);
    nonzero(&mut facts, "degenerate (never hit)", report.objects.iter().map(|o| o.degenerate).sum());
    nonzero(&mut facts, "tet leaves", report.objects.iter().map(|o| o.tet_leaves).sum());
    nonzero(&mut facts, "triangles in tet leaves", report.objects.iter().map(|o| o.tet_triangles).sum());
    facts.row(["file", &bytes(report.bytes)]);
    facts.row(["traversal reads", &bytes(report.resident_bytes)]);
    let note = note(report.worker.as_ref());
    format!("{}\n{}{note}\nwrote {}\n", stages.render(), facts.render(), path.display())
}
