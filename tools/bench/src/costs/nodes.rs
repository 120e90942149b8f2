//! Candidate nodes of models, each as an object of its own: the predictions of the estimators, and the measured steps and times
//! of rays.

use super::results::{ESTIMATORS, MeasuredNode};
use crate::clock::Clock;
use crate::model::Model;
use crate::progress::Progress;
use crate::rounds::least;
use crate::structures::{self, Use};
use crate::tracer::{Batch, Tracer};
use anyhow::Result;
use bth::rays::{Hit, Ray};
use bth_compile::costs::{Estimator, Start, TetWalker};
use bth_compile::pipeline::{self, CompileOptions, Structure};
use bth_compile::sampling::{self, SampleRay};
use bth_compile::{Silent, bvh, marks, tets};
use bth_format::layout::RecordKind;
use bth_import::Mesh;
use std::collections::HashMap;
use std::time::Instant;

/// Rays whose steps the sampling estimator counts.
const SAMPLED_RAYS: usize = 1024;
/// Rays that are measured.
const RAYS: usize = 8192;

/// What to measure of each model.
#[derive(Clone, Copy, Debug)]
pub(super) struct NodeChoice {
    /// Nodes of fewer triangles are left out.
    pub(super) least: u32,
    /// Nodes of more triangles are left out.
    pub(super) most: u32,
    /// Nodes of a model, at most.
    pub(super) nodes: usize,
    /// Rounds of which the fastest counts.
    pub(super) rounds: usize,
}

/// A candidate node as an object of its own, ready to be measured.
pub(super) struct Candidate {
    /// All figures but the times.
    node: MeasuredNode,
    tracer: Box<dyn Tracer>,
    /// Rays from outside and from surfaces.
    sets: [Vec<Ray>; 2],
}

/// The candidate nodes of a model: suitable ones, evenly spread over their sizes.
///
/// # Errors
/// If the model cannot be used.
pub(super) fn candidates(model: &Model, which: &NodeChoice, progress: &Progress) -> Result<Vec<Candidate>> {
    progress.show(format!("{}: marks", model.name));
    let (tree, _) = bvh::build(&model.mesh, &bvh::BvhOptions::default(), &Silent)?;
    let (marks, _) = marks::mark(&model.mesh, &tree, &Silent)?;
    let count = |i: &u32| tree.nodes[*i as usize].count;
    let mut candidates: Vec<u32> = (0..tree.nodes.len() as u32)
        .filter(|i| (which.least..=which.most).contains(&count(i)) && marks.suitable[*i as usize])
        .collect();
    candidates.sort_by_key(|i| (std::cmp::Reverse(count(i)), *i));
    let keep = which.nodes.min(candidates.len());
    let mut built = Vec::new();
    for k in 0..keep {
        let node = candidates[k * candidates.len() / keep];
        progress.show(format!("{}: node {} of {keep}", model.name, k + 1));
        let first = tree.nodes[node as usize].first as usize;
        let rows = &tree.order[first..first + tree.nodes[node as usize].count as usize];
        built.extend(candidate(&model.name, node, &part(&model.mesh, rows))?);
    }
    Ok(built)
}

/// Some of a mesh's triangles as a mesh.
fn part(mesh: &Mesh, triangles: &[u32]) -> Mesh {
    let mut part = Mesh::default();
    let mut row_of: HashMap<u32, u32> = HashMap::new();
    for &triangle in triangles {
        part.triangles.push(mesh.triangles[triangle as usize].map(|v| {
            *row_of.entry(v).or_insert_with(|| {
                part.positions.push(mesh.positions[v as usize]);
                part.positions.len() as u32 - 1
            })
        }));
    }
    part
}

/// `None` if TetGen fails on it.
fn candidate(model: &str, node: u32, mesh: &Mesh) -> Result<Option<Candidate>> {
    let options = CompileOptions {
        structure: Structure::Tets,
        record: RecordKind::Link32,
        keep_subtrees: false,
        geometry: false,
        ..CompileOptions::default()
    };
    let (tree, _) = bvh::build(mesh, &options.bvh, &Silent)?;
    let (built, _) = tets::build(mesh, &tree, &[0], &options.tets, &Silent)?;
    let [(0, tets)] = &built[..] else { return Ok(None) };
    let file = pipeline::assemble(mesh, &tree, &built, &options, &Silent)?;
    let tracer = structures::tracer(&file.bytes, Use::Batch)?;
    let root = &tree.nodes[0];
    let outside = sampling::outside(root.lower, root.upper, RAYS, 21);
    let surface = sampling::from_surface(mesh, &tree, 0..tree.order.len(), 2 * RAYS, 22);
    let surface: Vec<SampleRay> = surface.into_iter().filter(|r| r.tmax.is_infinite()).collect();
    let walker = TetWalker::new(tets);
    let counted = [&outside, &surface].map(|rays| count(&walker, rays));

    let triangles = tree.order.len() as u32;
    let mut estimates = [[0.0; 2]; ESTIMATORS.len()];
    let mut sampled_hits = [0.0; 2];
    let mut micros = [0.0; ESTIMATORS.len()];
    let depth = || average_depth(&tree);
    for (row, name) in ESTIMATORS.iter().enumerate() {
        let clock = Instant::now();
        estimates[row] = match *name {
            "face count" => [Estimator::FaceCount.levels(triangles, 0.0); 2],
            "average depth" => [Estimator::AverageDepth.levels(triangles, depth()); 2],
            "area" => {
                [Start::Outside, Start::Surface].map(|start| bth_compile::comparison::area_steps(tets, start))
            }
            _ => {
                // Rays of other seeds than those that are measured.
                let outside = sampling::outside(root.lower, root.upper, SAMPLED_RAYS, 23);
                let surface = sampling::from_surface(mesh, &tree, 0..tree.order.len(), 2 * SAMPLED_RAYS, 24);
                let surface: Vec<SampleRay> = surface.into_iter().filter(|r| r.tmax.is_infinite()).collect();
                // Making the walker belongs to the time of sampling.
                let walker = TetWalker::new(tets);
                let counted = [outside, surface].map(|rays| count(&walker, &rays));
                sampled_hits = counted.map(|c| c[1]);
                counted.map(|c| c[0])
            }
        };
        micros[row] = 1e6 * clock.elapsed().as_secs_f64();
    }
    let node = MeasuredNode {
        model: model.to_owned(),
        node,
        triangles,
        bytes: (tets.tets.len() * 32 + tets.vertices.len() * 16) as f64,
        steps: counted.map(|c| c[0]),
        hits: counted.map(|c| c[1]),
        nanoseconds: [0.0; 2],
        estimates,
        sampled_hits,
        micros,
    };
    Ok(Some(Candidate { node, tracer, sets: [rays(&outside), rays(&surface)] }))
}

/// Mean steps of rays, and the share of them that end at a triangle.
fn count(walker: &TetWalker<'_>, rays: &[SampleRay]) -> [f64; 2] {
    let (mut sums, mut walked) = ([0.0; 2], 0.0f64);
    for walk in rays.iter().filter_map(|ray| walker.walk(ray)) {
        sums[0] += f64::from(walk.steps);
        sums[1] += f64::from(u8::from(walk.hit));
        walked += 1.0;
    }
    sums.map(|sum| sum / walked.max(1.0))
}

/// Mean depth of the leaves.
fn average_depth(tree: &bvh::BinaryBvh) -> f64 {
    let mut depth = vec![0u32; tree.nodes.len()];
    let (mut sum, mut leaves) = (0.0, 0.0f64);
    for (i, node) in tree.nodes.iter().enumerate() {
        if node.is_leaf() {
            (sum, leaves) = (sum + f64::from(depth[i]), leaves + 1.0);
        } else {
            depth[i + 1] = depth[i] + 1;
            depth[node.right as usize] = depth[i] + 1;
        }
    }
    sum / leaves.max(1.0)
}

/// Measures candidates in batches, all of them in turn, so that other work of the machine affects all alike.
/// Each batch is traced once before it is timed, so that what it reads is in the caches.
pub(super) fn time(candidates: Vec<Candidate>, rounds: usize, progress: &Progress) -> Vec<MeasuredNode> {
    let mut hits = vec![Hit::MISS; RAYS];
    let items: Vec<(&Candidate, usize)> = candidates.iter().flat_map(|c| [(c, 0), (c, 1)]).collect();
    let mut said = usize::MAX;
    let seconds = least(&items, rounds, |round, (candidate, set)| {
        if round != said {
            progress.show(format!("round {round} of {rounds}: {} nodes", candidates.len()));
            said = round;
        }
        let rays = &candidate.sets[*set];
        let batch = Batch { rays, starts: None, coherent: false };
        let hits = &mut hits[..rays.len()];
        candidate.tracer.nearest(batch, hits);
        Some(Clock::ThreadCpu.time(|| candidate.tracer.nearest(batch, hits)))
    });
    let nanoseconds = |(row, rays): (usize, usize)| 1e9 * seconds[row].unwrap_or(0.0) / rays.max(1) as f64;
    let mut nodes = Vec::new();
    for (row, Candidate { node, sets, .. }) in candidates.into_iter().enumerate() {
        let nanoseconds = [0, 1].map(|set| nanoseconds((2 * row + set, sets[set].len())));
        nodes.push(MeasuredNode { nanoseconds, ..node });
    }
    nodes
}

/// Sampled rays, as the runtime library takes them.
pub(crate) fn rays(samples: &[SampleRay]) -> Vec<Ray> {
    let ray = |s: &SampleRay| Ray {
        origin: s.origin.map(|x| x as f32),
        tmin: 0.0,
        direction: s.direction.map(|x| x as f32),
        tmax: s.tmax as f32,
    };
    samples.iter().map(ray).collect()
}
