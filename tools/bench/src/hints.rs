//! What it is worth in scenes to say on which triangle a ray starts (`bth-bench hints`): bounces and ambient occlusion rays with
//! hints and without, through scenes whose objects have free directions and through scenes whose objects have none.

use crate::args::Hints;
use crate::clock::Clock;
use crate::isa;
use crate::markdown::{cells, count, table};
use crate::output::{Head, Report};
use crate::progress::Progress;
use crate::rounds::medians;
use crate::scenes::{FrameRaySet, FrameRays, Source};
use crate::structures::BATCH;
use anyhow::{Context, Result, ensure};
use bth::Scene;
use bth::rays::Hit;
use bth_compile::Silent;
use bth_compile::free::{FreeOptions, KeepFree};
use bth_compile::pipeline::{CompileOptions, Structure};
use serde::Serialize;
use serde_json::json;
use std::path::Path;

/// Contenders: the name, whether the objects have free directions, and whether rays say where they start.
const CONTENDERS: [(&str, bool, bool); 4] = [
    ("bvh", false, false),
    ("bvh from", false, true),
    ("bvh free", true, false),
    ("bvh free from", true, true),
];
/// The sets, and whether any hit ends a ray.
const SETS: [(&str, bool); 3] = [("diffuse", false), ("later", false), ("ao", true)];

/// What was measured of a set of rays through a scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HintTimes {
    /// Name of the scene.
    pub scene: String,
    /// Name of the set.
    pub set: &'static str,
    /// Rays of the set.
    pub rays: usize,
    /// Nanoseconds a ray of one thread, by contender.
    pub ns: Vec<f64>,
    /// Answers that differ from those without hints and free directions in any bit, of all contenders.
    pub differ: usize,
}

/// Measures, prints and writes the report.
///
/// # Errors
/// If an option or scene cannot be used, an answer differs, or the report cannot be written.
pub fn run(arguments: &Hints) -> Result<()> {
    let isa = isa::select(arguments.run.isa.as_deref())?;
    let progress = Progress::new();
    let options =
        json!({ "pixels": arguments.size(), "rounds": arguments.rounds, "quick": arguments.run.quick });
    let head = Head::now("hints", isa, options);
    let mut rows = Vec::new();
    for name in &arguments.scenes {
        progress.show(format!("{name}: compiling"));
        let source = Source::load(name)?;
        rows.extend(measure(&source, arguments)?);
    }
    drop(progress);
    let json = json!({ "head": head, "rows": rows });
    let body = markdown(&rows);
    Report { head: &head, title: "Hints in scenes", body, json, charts: Vec::new() }
        .write(&arguments.run.output)?;
    ensure!(rows.iter().all(|row| row.differ == 0), "answers differ");
    Ok(())
}

fn measure(source: &Source, arguments: &Hints) -> Result<Vec<HintTimes>> {
    let frame = source.frames(1)[0];
    let scenes = [compiled(source, KeepFree::None, frame)?, compiled(source, KeepFree::All, frame)?];
    let rays = FrameRays::of(&scenes[0], arguments.size())?;
    let sets = [&rays.sets[1], &rays.sets[2], &rays.occlusion];
    let times = SETS.iter().zip(sets).map(|((name, any), set)| {
        let expected = answers(&scenes[0], set, *any, false).0;
        let mut differ = 0;
        let ns = medians(&CONTENDERS, arguments.rounds, |_, (_, free, hinted)| {
            let (found, seconds) = answers(&scenes[usize::from(*free)], set, *any, *hinted);
            differ += expected.iter().zip(&found).filter(|(a, b)| a != b).count();
            Some(1e9 * seconds / set.rays.len() as f64)
        });
        let ns = ns.into_iter().map(|ns| ns.unwrap_or(f64::NAN)).collect();
        HintTimes { scene: source.name.clone(), set: name, rays: set.rays.len(), ns, differ }
    });
    Ok(times.collect())
}

/// A scene without tetrahedra at a frame.
fn compiled(source: &Source, keep: KeepFree, frame: i32) -> Result<Scene> {
    let free = FreeOptions { keep, ..FreeOptions::default() };
    let options = CompileOptions { structure: Structure::Bvh, free, ..CompileOptions::default() };
    let name = Path::new(&source.name);
    let (compiled, _) =
        bth_compile::scene::compile(&source.manifest, &source.folder, name, &options, &Silent)?;
    let mut scene = bth::from_bytes(&compiled.bytes).context("a file that was just compiled")?;
    scene.set_frame(frame)?;
    Ok(scene)
}

/// The nearest hits of a set, or misses and anything else where any hit ends a ray; and the seconds that they took.
fn answers(scene: &Scene, set: &FrameRaySet, any: bool, hinted: bool) -> (Vec<Hit>, f64) {
    let batch = set.batch();
    let hints = |from| if hinted { from } else { None };
    let mut hits = vec![Hit::MISS; set.rays.len()];
    let mut found = vec![false; set.rays.len()];
    let seconds = Clock::ThreadCpu.time(|| {
        if any {
            for (batch, found) in batch.chunks(BATCH).zip(found.chunks_mut(BATCH)) {
                scene.batch(batch.rays).from(hints(batch.from)).any(found);
            }
        } else {
            for (batch, hits) in batch.chunks(BATCH).zip(hits.chunks_mut(BATCH)) {
                scene.batch(batch.rays).from(hints(batch.from)).nearest(hits);
            }
        }
    });
    for (hit, found) in hits.iter_mut().zip(found) {
        hit.t = if found { 0.0 } else { hit.t };
    }
    (hits, seconds)
}

fn markdown(rows: &[HintTimes]) -> String {
    let mut head = cells(&["scene", "set", "rays"]);
    head.extend(CONTENDERS.map(|(name, ..)| format!("{name}, ns")));
    head.extend(cells(&["hints alone", "hints and section", "differ"]));
    let rows: Vec<Vec<String>> = rows
        .iter()
        .map(|row| {
            let mut line = vec![row.scene.clone(), row.set.to_owned(), count(row.rays as u64)];
            line.extend(row.ns.iter().map(|ns| format!("{ns:.1}")));
            line.extend([1, 3].map(|with| format!("{:.3}", row.ns[0] / row.ns[with])));
            line.push(count(row.differ as u64));
            line
        })
        .collect();
    format!(
        "One thread, its CPU clock; medians of interleaved rounds, batches of {BATCH}, one frame. `from`: rays say where they start; `free`: all \
         objects have free directions. The ratios are the time of `bvh` over that of `bvh from` and of `bvh free from`: above 1, hints gain.\n\n{}",
        table(&head, &rows)
    )
}
