//! The gain of tetrahedralizing a node, by sample rays through the binary BVH.
//!
//! A ray that starts on a triangle of a tet leaf walks its tetrahedra first, and traverses the BVH
//! only if it leaves the leaf's box without a hit. Rays from outside that enter the box walk
//! through the tetrahedra, too. So the saving of a node is a sum over rays, and the savings of
//! disjoint nodes add up.

use super::estimate::{Start, steps};
use super::options::CostOptions;
use super::prices::{LINES_THAT_HIT, Prices};
use bth_bvh::BinaryBvh;
use bth_bvh::sampling::{self, KnownRays, SampleRay, along};
use bth_bvh::sampling::{Traced, walk};
use bth_import::Mesh;
use rayon::prelude::*;
use std::collections::HashMap;

/// Steps of a short ray, such as for ambient occlusion, as a share of the steps of a bounce: 19 of
/// 32 on the bunny.
const SHORT_STEPS: f64 = 0.6;
/// Triangles for each ray of a kind, and the min and max number of rays of a kind.
const TRIANGLES_PER_RAY: usize = 16;
const RAYS_OF_KIND: [usize; 2] = [512, 4096];

/// The sample rays, traced through the BVH.
pub(super) struct Sampled {
    /// Rays from surfaces, with the row that each starts on and its result.
    surface: Vec<(SampleRay, u32, Traced)>,
    /// How many rays from outside there were, and the nodes that they entered, ascending, once for
    /// each ray.
    outside: usize,
    entered: Vec<u32>,
    /// Nanoseconds of a ray through the BVH alone, all kinds.
    pub(super) cost_bvh: f64,
}

/// Draws and traces the rays: those that are known, else uniform lines and rays from the fronts of
/// all triangles.
pub(super) fn sample(mesh: &Mesh, bvh: &BinaryBvh, options: &CostOptions) -> Sampled {
    let known = options.rays.as_deref();
    let [camera, surface_share] = known.map_or(options.optimize_for.weights(), KnownRays::shares);
    let (from_outside, from_surface) = match known {
        Some(known) => (known.outside.clone(), known.surface.clone()),
        None => {
            let count = (bvh.order.len() / TRIANGLES_PER_RAY).clamp(RAYS_OF_KIND[0], RAYS_OF_KIND[1]);
            let root = bvh.nodes.first();
            let lines = root.map_or(Vec::new(), |root| sampling::outside(root.lower, root.upper, count, 1));
            (lines, sampling::from_surface(mesh, bvh, 0..bvh.order.len(), count, 2))
        }
    };
    let [from_outside, from_surface] =
        [from_outside, from_surface].map(|rays| sampling::affordable(mesh, bvh, rays));
    let costs = options.profile.bvh;
    let nodes_of = |ray: &SampleRay| {
        let mut nodes = Vec::new();
        walk(mesh, bvh, ray, |node| nodes.push(node));
        nodes
    };
    let mut entered: Vec<u32> = from_outside.par_iter().flat_map_iter(nodes_of).collect();
    entered.par_sort_unstable();
    let rows = rows(bvh, mesh.triangles.len(), from_surface.iter().filter_map(|ray| ray.from));
    let row = |triangle: u32| rows.get(&triangle).copied();
    let surface: Vec<(SampleRay, u32, Traced)> = from_surface
        .par_iter()
        .map(|ray| (*ray, ray.from.and_then(row).unwrap_or(u32::MAX), walk(mesh, bvh, ray, |_| {})))
        .collect();
    let surface_visits = surface.iter().map(|(_, _, traced)| traced.visits as usize).sum();
    let mean = |visits: usize, rays: usize| visits as f64 / rays.max(1) as f64;
    let cost_bvh = costs.ray
        + camera * costs.outside * mean(entered.len(), from_outside.len())
        + surface_share * costs.surface * mean(surface_visits, from_surface.len());
    Sampled { surface, outside: from_outside.len(), entered, cost_bvh }
}

/// Rows of the BVH's order of some of this many triangles; those that are in no leaf are skipped.
fn rows(bvh: &BinaryBvh, triangles: usize, of: impl Iterator<Item = u32>) -> HashMap<u32, u32> {
    let mut wanted = vec![false; triangles];
    of.for_each(|triangle| wanted[triangle as usize] = true);
    let order = bvh.order.par_iter().zip(0..bvh.order.len() as u32);
    order
        .filter(|(triangle, _)| wanted[**triangle as usize])
        .map(|(triangle, row)| (*triangle, row))
        .collect()
}

impl Sampled {
    /// How often rays from outside entered these nodes.
    fn entered(&self, nodes: std::ops::Range<u32>) -> usize {
        let before = |node: u32| self.entered.partition_point(|entered| *entered < node);
        before(nodes.end) - before(nodes.start)
    }

    /// Nanoseconds that tetrahedra in these nodes, which are ascending, save for each ray of the
    /// model; below 0 where they are the slower. `weights` are the weights of rays from outside and
    /// from surfaces.
    pub(super) fn gains(
        &self,
        bvh: &BinaryBvh,
        nodes: &[u32],
        prices: &Prices<'_>,
        weights: [f64; 2],
    ) -> Vec<f64> {
        let costs = prices.bvh();
        let steps = |start: Start, k: usize| steps(start, bvh.nodes[nodes[k] as usize].count);
        // Of the rays that start on each node: through its tetrahedra, and through the BVH.
        let mut times = vec![[0.0; 2]; nodes.len()];
        for (ray, row, traced) in &self.surface {
            let bvh_time = costs.ray + costs.surface * f64::from(traced.visits);
            for at in path(bvh, *row) {
                let Ok(k) = nodes.binary_search(&at) else { continue };
                let node = &bvh.nodes[at as usize];
                let share = if ray.tmax.is_finite() { SHORT_STEPS } else { 1.0 };
                let mut time =
                    prices.surface(node.count, share * steps(Start::Surface, k), hits(traced, node));
                if at != 0 && leaves(ray, traced, node) {
                    time += bvh_time;
                }
                times[k][0] += time;
                times[k][1] += bvh_time;
            }
        }
        let gain = |(k, (&at, [tets, plain])): (usize, (&u32, [f64; 2]))| {
            let node = &bvh.nodes[at as usize];
            let n = steps(Start::Outside, k);
            let walked = match at {
                0 => prices.outside(node.count, n, LINES_THAT_HIT),
                _ => prices.alone(node.count, n, LINES_THAT_HIT),
            };
            // A ray that enters the root's tetrahedra is not prepared for the BVH.
            let prepared = if at == 0 { costs.ray } else { 0.0 };
            let through = costs.outside * self.entered(at..at + 2 * node.count - 1) as f64
                + (prepared - walked) * self.entered(at..at + 1) as f64;
            weights[1] * (plain - tets) / self.surface.len().max(1) as f64
                + weights[0] * through / self.outside.max(1) as f64
        };
        nodes.iter().zip(times).enumerate().map(gain).collect()
    }
}

/// 1 for a ray that ends at one of the node's triangles, else 0.
fn hits(traced: &Traced, node: &bth_bvh::Node) -> f64 {
    let here = |(row, _)| (node.first..node.first + node.count).contains(&row);
    if traced.hit.is_some_and(here) { 1.0 } else { 0.0 }
}

/// Returns true if a ray leaves a node's box without having hit one of its triangles.
pub(super) fn leaves(ray: &SampleRay, traced: &Traced, node: &bth_bvh::Node) -> bool {
    match traced.hit {
        Some((row, _)) if (node.first..node.first + node.count).contains(&row) => false,
        Some(_) => true,
        None if ray.tmax.is_finite() => {
            let end = along(ray, ray.tmax);
            (0..3).any(|k| end[k] < f64::from(node.lower[k]) || end[k] > f64::from(node.upper[k]))
        }
        None => true,
    }
}

/// The nodes from the root to a row.
fn path(bvh: &BinaryBvh, row: u32) -> impl Iterator<Item = u32> {
    let mut at = (row != u32::MAX).then_some(0);
    std::iter::from_fn(move || {
        let here = at?;
        let node = &bvh.nodes[here as usize];
        at = (!node.is_leaf())
            .then(|| if row < bvh.nodes[node.right as usize].first { here + 1 } else { node.right });
        Some(here)
    })
}
