//! What each step of the BVH builder is worth: binning, sweep, reinsertion, collapse, the order of blocks, and
//! what the compiler leaves out because it does not pay: spatial splits, narrower nodes, smaller leaves.

mod block_order;
mod boxes;
mod greedy_collapse;
pub mod results;
mod spatial_splits;
mod split_plane;
mod tables;
mod variations;

use results::STEPS_OF;
pub use results::{ModelQuality, QualityResults, VariationRow};
pub use tables::markdown;

use crate::args::Quality;
use crate::clock::Clock;
use crate::model::Model;
use crate::output::{Head, Report};
use crate::progress::Progress;
use crate::rays::{self, Finder, RaySet};
use crate::speed::Answers;
use crate::structures::{self, Use};
use anyhow::{Result, bail, ensure};
use bth::Scene;
use bth::rays::Hit;
use std::collections::BTreeMap;
use variations::BuiltVariation;

/// Rays of a set whose steps are counted, at most.
const COUNTED: usize = 10_000;

/// Measures, prints and writes the report.
///
/// # Errors
/// If an option or model cannot be used or a file cannot be written, and, when all is written, if a variation gave
/// another answer than the others.
pub fn run(arguments: &Quality) -> Result<()> {
    if let Some(name) = arguments.sets.unknown(&rays::NAMES).first() {
        bail!("--set {name}: there are {}", rays::NAMES.join(", "));
    }
    let results = measure(arguments)?;
    Report {
        head: &results.head,
        title: "What steps of the BVH builder are worth",
        body: markdown(&results),
        json: serde_json::to_value(&results)?,
        charts: Vec::new(),
    }
    .write(&arguments.run.output)?;
    let rows = results.models.iter().flat_map(|m| m.rows.iter().map(move |r| (m, r)));
    let wrong: Vec<String> =
        rows.filter(|(_, r)| r.differ > 0).map(|(m, r)| format!("{} on {}", r.name, m.name)).collect();
    ensure!(wrong.is_empty(), "answers differ: {}", wrong.join(", "));
    Ok(())
}

/// Measures all models.
///
/// # Errors
/// If a model cannot be used.
pub fn measure(arguments: &Quality) -> Result<QualityResults> {
    let (head, rounds) = Head::of_ray_sets("bvh-quality", &arguments.run, arguments.rays, arguments.rounds)?;
    let mut results = QualityResults { head, models: Vec::new() };
    let progress = Progress::new();
    for which in &arguments.models.models {
        results.models.push(measure_model(which, arguments, rounds, &progress)?);
    }
    Ok(results)
}

fn measure_model(
    which: &str,
    arguments: &Quality,
    rounds: usize,
    progress: &Progress,
) -> Result<ModelQuality> {
    let model = Model::load(which)?;
    let mut built = Vec::new();
    for variation in variations::all() {
        progress.show(format!("{}: building {}", model.name, variation.name));
        built.push((variation.name, variation.build(&model.mesh)?));
    }
    progress.show(format!("{}: making rays", model.name));
    let plain = bth::from_bytes(&built[0].1.bytes)?;
    let size = if arguments.run.quick { rays::QUICK_PICTURE_SIZE } else { rays::PICTURE_SIZE };
    let options = rays::Options { size, most: arguments.rays, view: arguments.models.seen_from.view() };
    let (view, mut sets) = rays::sets(&Finder::new(&model, &plain), &options);
    let counted: Vec<RaySet> = sets.iter().filter(|s| STEPS_OF.contains(&s.name)).cloned().collect();
    sets.retain(|s| arguments.sets.select(s.name) && s.rays.len() >= rays::FEWEST_TIMED);

    let tracer = structures::tracer(&built[0].1.bytes, Use::Batch)?;
    let expected: Vec<Answers> = sets.iter().map(|s| Answers::of(&*tracer, s)).collect();
    let mut rows = Vec::new();
    for (name, built) in &built {
        let scene = bth::from_bytes(&built.bytes)?;
        let mut row = row(name, built, &scene, model.triangles());
        row.steps = counted.iter().map(|set| (set.name, steps(&scene, &set.rays))).collect();
        row.differ = sets.iter().zip(&expected).map(|(set, expected)| differ(&scene, set, expected)).sum();
        rows.push(row);
    }
    progress.show(format!("{}: tracing", model.name));
    let mut times = vec![vec![Vec::new(); sets.len()]; built.len()];
    for round in 0..rounds {
        for i in (0..built.len()).map(|i| (i + round) % built.len()) {
            // Opened anew, so that the file lies on other pages of memory in every round.
            let scene = bth::from_bytes(&built[i].1.bytes)?;
            for (set, times) in sets.iter().zip(&mut times[i]) {
                times.push(1e9 * time(&scene, set) / set.rays.len() as f64);
            }
        }
    }
    for (row, times) in rows.iter_mut().zip(times) {
        // The least time, as other work of the machine can only add to it.
        let least = |times: Vec<f64>| times.into_iter().min_by(f64::total_cmp);
        row.nanoseconds =
            sets.iter().zip(times).filter_map(|(set, times)| Some((set.name, least(times)?))).collect();
    }
    Ok(ModelQuality { name: model.name.clone(), triangles: model.triangles(), view, rows })
}

/// The figures that are known without tracing.
fn row(name: &str, built: &BuiltVariation, scene: &Scene, triangles: usize) -> VariationRow {
    let collapse = &built.collapse;
    let leaves = (collapse.indexed_leaves + collapse.raw_leaves).max(1);
    VariationRow {
        name: name.to_owned(),
        seconds: built.seconds,
        visits: built.visits,
        wide_visits: [collapse.node_visits, collapse.leaf_visits],
        children: collapse.children as f64 / collapse.nodes.max(1) as f64,
        triangles: (collapse.indexed_triangles + collapse.raw_triangles) as f64 / leaves as f64,
        references: built.references,
        bytes: scene.resident_bytes() as f64 / triangles as f64,
        steps: BTreeMap::new(),
        nanoseconds: BTreeMap::new(),
        differ: 0,
    }
}

/// Nodes and leaves that a ray visits, on average.
fn steps(scene: &Scene, rays: &[bth::rays::Ray]) -> [f64; 2] {
    let step = rays.len().div_ceil(COUNTED).max(1);
    let mut sum = bth::Steps::default();
    let mut count = 0;
    for ray in rays.iter().step_by(step) {
        sum += scene.nearest_counted(ray).1;
        count += 1;
    }
    [sum.nodes, sum.leaves].map(|n| f64::from(n) / f64::from(count.max(1)))
}

/// How many answers to a set differ from the expected ones in any bit.
fn differ(scene: &Scene, set: &RaySet, expected: &Answers) -> usize {
    let (mut hits, mut found) = (vec![Hit::MISS; set.rays.len()], vec![false; set.rays.len()]);
    trace(scene, set, &mut hits, &mut found);
    expected.differ(true, &hits, &found)
}

/// CPU seconds that a set takes; it is traced once before, to warm up the caches.
fn time(scene: &Scene, set: &RaySet) -> f64 {
    let (mut hits, mut found) = (vec![Hit::MISS; set.rays.len()], vec![false; set.rays.len()]);
    trace(scene, set, &mut hits, &mut found);
    Clock::ThreadCpu.time(|| trace(scene, set, &mut hits, &mut found))
}

fn trace(scene: &Scene, set: &RaySet, hits: &mut [Hit], found: &mut [bool]) {
    for first in (0..set.rays.len()).step_by(structures::BATCH) {
        let part = first..set.rays.len().min(first + structures::BATCH);
        if set.any {
            scene.batch(&set.rays[part.clone()]).any(&mut found[part]);
        } else {
            scene.batch(&set.rays[part.clone()]).nearest(&mut hits[part]);
        }
    }
}
