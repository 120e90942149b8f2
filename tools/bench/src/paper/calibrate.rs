//! Costs of the scalar traversals, which the paper's rule compares: measured on camera rays to two models.

use super::tet_records::{Tet20, Tet32, TetRecord};
use super::tree::{self, PaperTree};
use crate::clock::Clock;
use crate::model::{Model, position};
use crate::rays::{self, Finder};
use crate::rounds::least;
use crate::structures;
use crate::tracer::{Batch, Tracer};
use anyhow::{Result, bail};
use bth::rays::{Hit, Ray};
use bth_compile::costs::{Profile, TetCosts, TetWalker, Walk};
use bth_compile::sampling::SampleRay;
use bth_compile::{Silent, bvh, tets};

/// A model whose tetrahedra fit the caches, and one whose tetrahedra do not.
const MODELS: [&str; 2] = ["blob:6000", "blob:150000"];
/// Pixels of the camera.
const SIZE: (u32, u32) = (256, 144);
const ROUNDS: usize = 7;

/// A profile of the scalar traversals.
pub(super) fn profile() -> Result<Profile> {
    let mut profile = Profile { isa: "scalar, the paper's".to_owned(), ..Profile::default() };
    let mut found = Vec::new();
    for name in MODELS {
        found.push(measure(&Model::load(name)?)?);
    }
    let [small, large] = &found[..] else { bail!("two models were measured") };
    profile.bvh.ray = 0.0;
    profile.bvh.outside = 0.5 * (small.visit + large.visit);
    for (row, record) in super::PROFILE_RECORDS.into_iter().enumerate() {
        let (entry, step) = small.walks[row];
        let walk = Walk { entry, hit: 0.0, step: [step, large.walks[row].1.max(step)] };
        profile.tets.insert(record.name().to_owned(), TetCosts { outside: walk, surface: walk, alone: walk });
    }
    profile.bytes = [small.bytes, large.bytes];
    Ok(profile)
}

struct MeasuredCosts {
    /// Nanoseconds for each node of the binary BVH.
    visit: f64,
    /// Entry and step of each record.
    walks: [(f64, f64); 2],
    bytes: f64,
}

fn measure(model: &Model) -> Result<MeasuredCosts> {
    let (tree, _) = bvh::build(&model.mesh, &tree::bvh_options(), &Silent)?;
    let (built, _) = tets::build(&model.mesh, &tree, &[0], &tets::TetOptions::default(), &Silent)?;
    let [(0, tets)] = &built[..] else { bail!("{} could not be tetrahedralized", model.name) };
    let rays = camera(model)?;
    // Rays of few steps and of many.
    let walker = TetWalker::new(tets);
    let steps: Vec<(u32, Ray)> =
        rays.iter().filter_map(|r| Some((walker.walk(&sample(r))?.steps, *r))).collect();
    let mut sorted: Vec<u32> = steps.iter().map(|s| s.0).collect();
    sorted.sort_unstable();
    let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0);
    let (few, many): (Vec<_>, Vec<_>) = steps.into_iter().partition(|s| s.0 <= median);
    let mean = |part: &[(u32, Ray)]| part.iter().map(|p| f64::from(p.0)).sum::<f64>() / part.len() as f64;
    let plain = PaperTree::<Tet32>::new(&model.mesh, &tree, &[]);
    let bvh_time = times(&plain, &[&rays])[0];
    let walks = |tracer: &dyn Tracer| {
        let sets = [&few, &many].map(|part| part.iter().map(|p| p.1).collect::<Vec<Ray>>());
        let times = times(tracer, &[&sets[0], &sets[1]]);
        let step = ((times[1] - times[0]) / (mean(&many) - mean(&few))).max(0.0);
        ((times[0] - step * mean(&few)).max(0.0), step)
    };
    fn tracer<R: TetRecord>(
        model: &Model,
        tree: &bvh::BinaryBvh,
        built: &[(u32, tets::TetMesh)],
    ) -> PaperTree<R> {
        PaperTree::new(&model.mesh, tree, built)
    }
    Ok(MeasuredCosts {
        visit: bvh_time / expected_visits(&tree),
        walks: [walks(&tracer::<Tet32>(model, &tree, &built)), walks(&tracer::<Tet20>(model, &tree, &built))],
        bytes: (tets.tets.len() * 32 + tets.vertices.len() * 16) as f64,
    })
}

/// The camera's rays that enter the model's box, neighbours together.
fn camera(model: &Model) -> Result<Vec<Ray>> {
    let plain = structures::compile(model, &structures::BVH)?;
    let scene = bth::from_bytes(&plain.bytes)?;
    let options = rays::Options { size: SIZE, most: usize::MAX, view: None };
    let (_, [mut far, _]) = rays::cameras(&Finder::new(model, &scene), &options);
    let bounds = model.bounds();
    far.retain(|r| bounds.meets(position(r.origin), position(r.direction)));
    Ok(far)
}

fn sample(ray: &Ray) -> SampleRay {
    let [origin, direction] = [ray.origin, ray.direction].map(|v| v.map(f64::from));
    SampleRay { origin, direction, tmax: f64::from(ray.tmax), from: None }
}

/// Nodes that a uniform line through the root's box enters, if nothing stops it: the measure of the surface area
/// heuristic. The cost of a visit is what makes it the time of a ray, so what rays save that stop early is in it.
fn expected_visits(tree: &bvh::BinaryBvh) -> f64 {
    let area = |node: &bvh::Node| {
        let [x, y, z] = [0, 1, 2].map(|k| f64::from(node.upper[k]) - f64::from(node.lower[k]));
        x * y + y * z + z * x
    };
    tree.nodes.iter().map(area).sum::<f64>() / tree.nodes.first().map_or(1.0, area)
}

/// Nanoseconds of a ray of each set.
fn times(tracer: &dyn Tracer, sets: &[&[Ray]]) -> Vec<f64> {
    let most = sets.iter().map(|set| set.len()).max().unwrap_or(0);
    let mut hits = vec![Hit::MISS; most];
    let seconds = least(sets, ROUNDS, |_, rays| {
        let batch = Batch { rays, starts: None, coherent: true };
        Some(Clock::ThreadCpu.time(|| tracer.nearest(batch, &mut hits[..rays.len()])))
    });
    sets.iter().zip(seconds).map(|(rays, s)| 1e9 * s.unwrap_or(0.0) / rays.len().max(1) as f64).collect()
}
