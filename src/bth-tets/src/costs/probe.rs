//! The probe: rays are traced through the tetrahedra that were built and through the BVH, and
//! tetrahedralizations that are not faster are dropped.
//!
//! Steps are counted in double precision and priced by the profile, so that the outcome, and with
//! it the file, is the same on every machine.

use super::gains::leaves;
use super::options::{CostOptions, Probe, Select};
use super::prices::Prices;
use super::tet_walk::TetWalker;
use crate::{Leaf, TetMesh};
use bth_bvh::BinaryBvh;
use bth_bvh::sampling::walk;
use bth_bvh::sampling::{KnownRays, SampleRay, from_surface, outside};
use bth_bvh::vectors::{corners, double_area};
use bth_import::Mesh;
use bth_import::error::Result;
use bth_import::monitor::Monitor;
use serde::Serialize;

/// Rays of all leaves together, and the min and max number of rays of one leaf.
const RAYS_OF_ALL_LEAVES: usize = 1 << 16;
const RAYS_OF_LEAF: [usize; 2] = [64, 1024];

/// Report of the probe.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ProbeReport {
    /// Each tet leaf that was built.
    pub leaves: Vec<ProbedLeaf>,
    /// Expected cost of a ray through the BVH alone, nanoseconds.
    pub cost_bvh: f64,
    /// Expected cost of a ray with the tet leaves that stay, nanoseconds.
    pub cost_with_tets: f64,
}

/// A tet leaf.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ProbedLeaf {
    /// Index in the binary BVH.
    pub node: u32,
    /// Number of its triangles.
    pub triangles: u32,
    /// Mean steps of rays that start on it.
    pub steps: f64,
    /// Nanoseconds of a ray that starts on the leaf, with the tetrahedra.
    pub cost_tet: f64,
    /// Nanoseconds of the same ray through the BVH alone.
    pub cost_bvh: f64,
    /// Nanoseconds saved for each ray of the model.
    pub gain: f64,
    /// True if it is kept.
    pub kept: bool,
}

/// Drops the tetrahedralizations that are not faster than the BVH, and all of them if together they
/// save less than the min gain of the options.
///
/// # Errors
/// [`bth_import::Error::Cancelled`].
pub fn probe(
    mesh: &Mesh,
    bvh: &BinaryBvh,
    built: Vec<Leaf>,
    options: &CostOptions,
    monitor: &dyn Monitor,
) -> Result<(Vec<Leaf>, Option<ProbeReport>)> {
    if options.probe == Probe::Off || options.select != Select::Best || built.is_empty() {
        return Ok((built, None));
    }
    monitor.stage("probe", Some(built.len() as u64));
    let prices = Prices::new(options);
    let known = options.rays.as_deref();
    let weights = known.map_or(options.optimize_for.weights(), KnownRays::shares);
    let all = super::gains::sample(mesh, bvh, options);
    let count = (RAYS_OF_ALL_LEAVES / built.len()).clamp(RAYS_OF_LEAF[0], RAYS_OF_LEAF[1]);
    let prober = Prober { mesh, bvh, options, prices: &prices, count };
    let areas = surface_areas(mesh, bvh);
    let mut report =
        ProbeReport { cost_bvh: all.cost_bvh, cost_with_tets: all.cost_bvh, ..Default::default() };
    for (node, tets) in &built {
        monitor.check()?;
        let mut leaf = prober.surface(*node, tets);
        let rows = rows(bvh, *node);
        // The share of the rays from surfaces that start on this leaf.
        let share = match known {
            Some(known) => share_of(known, bvh, &rows),
            None => (areas[rows.end] - areas[rows.start]) / areas[bvh.order.len()],
        };
        leaf.gain = weights[1] * share * (leaf.cost_bvh - leaf.cost_tet);
        leaf.gain += weights[0] * prober.entering(*node, tets);
        leaf.kept = leaf.gain > 0.0;
        report.leaves.push(leaf);
        monitor.advance(1);
    }
    let gain: f64 = report.leaves.iter().filter(|l| l.kept).map(|l| l.gain).sum();
    if gain < options.minimum_gain * report.cost_bvh {
        report.leaves.iter_mut().for_each(|leaf| leaf.kept = false);
    } else {
        report.cost_with_tets -= gain;
    }
    let kept = built.into_iter().zip(&report.leaves).filter(|(_, leaf)| leaf.kept).map(|(b, _)| b).collect();
    Ok((kept, Some(report)))
}

/// Rows of the BVH's order below a node.
fn rows(bvh: &BinaryBvh, node: u32) -> std::ops::Range<usize> {
    let node = &bvh.nodes[node as usize];
    node.first as usize..(node.first + node.count) as usize
}

/// Sums of the triangles' double areas up to each row of the order.
fn surface_areas(mesh: &Mesh, bvh: &BinaryBvh) -> Vec<f64> {
    let mut sums = Vec::with_capacity(bvh.order.len() + 1);
    sums.push(0.0);
    for &triangle in &bvh.order {
        sums.push(sums[sums.len() - 1] + double_area(corners(mesh, triangle)).length());
    }
    sums
}

/// Share of the known rays from surfaces that start on the triangles of these rows.
fn share_of(known: &KnownRays, bvh: &BinaryBvh, rows: &std::ops::Range<usize>) -> f64 {
    let mut ids: Vec<u32> = bvh.order[rows.clone()].to_vec();
    ids.sort_unstable();
    let here = known.surface.iter().filter(|r| r.from.is_some_and(|t| ids.binary_search(&t).is_ok()));
    here.count() as f64 / known.surface.len().max(1) as f64
}

/// Traces rays through the tetrahedra and the BVH of single leaves, and compares their costs.
struct Prober<'a> {
    mesh: &'a Mesh,
    bvh: &'a BinaryBvh,
    options: &'a CostOptions,
    prices: &'a Prices<'a>,
    /// Rays for each leaf.
    count: usize,
}

impl Prober<'_> {
    /// Traces rays that start on the leaf's triangles: known rays if there are any, else sampled
    /// rays.
    fn surface(&self, node: u32, tets: &TetMesh) -> ProbedLeaf {
        let Self { mesh, bvh, options, prices, count } = *self;
        let (costs, at) = (options.profile.bvh, &bvh.nodes[node as usize]);
        let rows = rows(bvh, node);
        let known = options.rays.as_deref();
        let known: Option<Vec<SampleRay>> = known.map(|known| {
            let mut ids: Vec<u32> = bvh.order[rows.clone()].to_vec();
            ids.sort_unstable();
            let here = known.surface.iter().filter(|r| r.from.is_some_and(|t| ids.binary_search(&t).is_ok()));
            here.copied().take(count).collect()
        });
        let rays = known.unwrap_or_else(|| from_surface(mesh, bvh, rows, count, 3 + u64::from(node)));
        let walker = TetWalker::new(tets);
        let (mut steps, mut through_tets, mut through_bvh, mut traced) = (0.0, 0.0, 0.0, 0.0f64);
        for ray in &rays {
            let Some(walked) = walker.walk(ray) else { continue };
            let traced_bvh = walk(mesh, bvh, ray, |_| {});
            let plain = costs.ray + costs.surface * f64::from(traced_bvh.visits);
            let mut time = prices.surface(at.count, f64::from(walked.steps), f64::from(u8::from(walked.hit)));
            if node != 0 && walked.left && leaves(ray, &traced_bvh, at) {
                time += plain;
            }
            steps += f64::from(walked.steps);
            through_tets += time;
            through_bvh += plain;
            traced += 1.0;
        }
        let mean = |sum: f64| sum / traced.max(1.0);
        ProbedLeaf {
            node,
            triangles: at.count,
            steps: mean(steps),
            cost_tet: mean(through_tets),
            cost_bvh: mean(through_bvh),
            gain: 0.0,
            kept: false,
        }
    }

    /// Nanoseconds saved for each ray from outside that enters the root, where no BVH stays next to
    /// the tetrahedra.
    fn entering(&self, node: u32, tets: &TetMesh) -> f64 {
        let Self { mesh, bvh, options, prices, count } = *self;
        let (costs, at) = (options.profile.bvh, &bvh.nodes[node as usize]);
        let below = node..node + 2 * at.count - 1;
        let walker = TetWalker::new(tets);
        let (mut saved, mut traced) = (0.0, 0.0f64);
        for ray in outside(at.lower, at.upper, count, 4 + u64::from(node)) {
            let Some(walked) = walker.walk(&ray) else { continue };
            let mut visits = 0u32;
            walk(mesh, bvh, &ray, |i| visits += u32::from(below.contains(&i)));
            let (steps, hits) = (f64::from(walked.steps), f64::from(u8::from(walked.hit)));
            saved += costs.outside * f64::from(visits);
            // A ray that enters the root's tetrahedra is not prepared for the BVH.
            saved -= match node {
                0 => prices.outside(at.count, steps, hits) - costs.ray,
                _ => prices.alone(at.count, steps, hits),
            };
            traced += 1.0;
        }
        at.half_area() / bvh.nodes[0].half_area() * saved / traced.max(1.0)
    }
}
