//! The gain of tetrahedralizing a node, by sample rays through the binary BVH.
//!
//! A ray that starts on a triangle of a tet leaf walks its tetrahedra first, and traverses the BVH only if it leaves the
//! leaf's box without a hit. Rays from outside take the BVH that is kept beside the tetrahedra; where none is kept they
//! walk through the tetrahedra too. So the saving of a node is a sum over rays, and the savings of disjoint nodes add up.

use super::bvh_walk::{Traced, walk};
use super::options::CostOptions;
use super::prices::{LINES_THAT_HIT, Prices};
use super::rays::{self, SampleRay, along};
use super::subtree_sums::Sums;
use super::{Start, Weighting};
use crate::bvh::BinaryBvh;
use bth_import::Mesh;

/// Steps of a ray as short as those for ambient occlusion, as a share of those of a bounce: 19 of 32 on the bunny.
const SHORT_STEPS: f64 = 0.6;
/// Triangles for each ray of a kind, and the least and greatest number of rays of a kind.
const TRIANGLES_PER_RAY: usize = 16;
const RAYS_OF_KIND: [usize; 2] = [512, 4096];

/// Estimated gain of a node.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Gain {
    /// Nanoseconds saved for each ray of the model; below 0 where tetrahedra are the slower.
    pub(super) saved: f64,
    /// Nanoseconds of a ray that may use the tetrahedra: through the tetrahedra, and through the BVH.
    pub(super) tets: f64,
    pub(super) bvh: f64,
    /// Estimated steps.
    pub(super) steps: f64,
}

/// The sample rays, traced through the BVH.
pub(super) struct Sampled {
    /// Rays from surfaces, with the row that each starts on and its result.
    surface: Vec<(SampleRay, u32, Traced)>,
    /// How many rays from outside there were, and for each node how many entered it and how many visits its
    /// subtree had of them.
    outside: usize,
    entered: Vec<u32>,
    visits: Vec<u64>,
    /// Nanoseconds of a ray through the BVH alone, all kinds.
    pub(super) cost_bvh: f64,
}

/// Draws and traces the rays: those of the scene if there is one, else uniform lines and rays from the fronts of all
/// triangles.
pub(super) fn sample(
    mesh: &Mesh,
    bvh: &BinaryBvh,
    options: &CostOptions,
    scene: Option<&Weighting>,
) -> Sampled {
    let [camera, surface] = scene.map_or(options.optimize_for.weights(), |s| s.shares());
    let drawn;
    let (from_outside, from_surface): (&[SampleRay], &[SampleRay]) = match scene {
        Some(scene) => (&scene.outside, &scene.surface),
        None => {
            let count = (bvh.order.len() / TRIANGLES_PER_RAY).clamp(RAYS_OF_KIND[0], RAYS_OF_KIND[1]);
            let root = bvh.nodes.first();
            let lines = root.map_or(Vec::new(), |root| rays::outside(root.lower, root.upper, count, 1));
            drawn = (lines, rays::from_surface(mesh, bvh, 0..bvh.order.len(), count, 2));
            (&drawn.0, &drawn.1)
        }
    };
    let costs = options.profile.bvh;
    let mut sampled = Sampled {
        surface: Vec::with_capacity(from_surface.len()),
        outside: from_outside.len(),
        entered: vec![0; bvh.nodes.len()],
        visits: vec![0; bvh.nodes.len()],
        cost_bvh: 0.0,
    };
    let mut total = 0;
    for ray in from_outside {
        total += walk(mesh, bvh, ray, |node| sampled.entered[node as usize] += 1).visits;
    }
    for i in (0..bvh.nodes.len()).rev() {
        let node = &bvh.nodes[i];
        let below =
            if node.is_leaf() { 0 } else { sampled.visits[i + 1] + sampled.visits[node.right as usize] };
        sampled.visits[i] = below + u64::from(sampled.entered[i]);
    }
    let row_of = rows(bvh, mesh.triangles.len());
    let mut surface_total = 0;
    for ray in from_surface {
        let traced = walk(mesh, bvh, ray, |_| {});
        surface_total += traced.visits;
        let row = ray.from.map_or(u32::MAX, |triangle| row_of[triangle as usize]);
        sampled.surface.push((*ray, row, traced));
    }
    let mean = |visits: u32, rays: usize| f64::from(visits) / rays.max(1) as f64;
    sampled.cost_bvh = costs.ray
        + camera * costs.outside * mean(total, from_outside.len())
        + surface * costs.surface * mean(surface_total, from_surface.len());
    sampled
}

/// Row of the BVH's order of each triangle, or `u32::MAX`.
fn rows(bvh: &BinaryBvh, triangles: usize) -> Vec<u32> {
    let mut rows = vec![u32::MAX; triangles];
    for (row, &triangle) in bvh.order.iter().enumerate() {
        rows[triangle as usize] = row as u32;
    }
    rows
}

impl Sampled {
    /// The gains of these nodes, which are ascending. `weights` are those of rays from outside and from surfaces.
    pub(super) fn gains(
        &self,
        bvh: &BinaryBvh,
        sums: &[Sums],
        nodes: &[u32],
        prices: &Prices<'_>,
        weights: [f64; 2],
    ) -> Vec<Gain> {
        let costs = prices.bvh();
        let mut gains: Vec<Gain> = Vec::with_capacity(nodes.len());
        let mut started = vec![0u32; nodes.len()];
        let depth = |i: u32| sums[i as usize].depth as f64 / f64::from(bvh.nodes[i as usize].count);
        let steps = |start: Start, i: u32| prices.steps(start, bvh.nodes[i as usize].count, depth(i));
        gains.resize(nodes.len(), Gain::default());
        for (ray, row, traced) in &self.surface {
            let bvh_time = costs.ray + costs.surface * f64::from(traced.visits);
            for at in path(bvh, *row) {
                let Ok(k) = nodes.binary_search(&at) else { continue };
                let node = &bvh.nodes[at as usize];
                let share = if ray.tmax.is_finite() { SHORT_STEPS } else { 1.0 };
                let mut time =
                    prices.surface(node.count, share * steps(Start::Surface, at), hits(traced, node));
                if at != 0 && leaves(ray, traced, node) {
                    time += bvh_time;
                }
                started[k] += 1;
                gains[k].tets += time;
                gains[k].bvh += bvh_time;
            }
        }
        for ((gain, &at), &started) in gains.iter_mut().zip(nodes).zip(&started) {
            let node = &bvh.nodes[at as usize];
            gain.steps = steps(Start::Surface, at);
            if prices.hints() {
                gain.saved += weights[1] * (gain.bvh - gain.tets) / self.surface.len().max(1) as f64;
            }
            if !prices.keep_subtrees {
                let n = steps(Start::Outside, at);
                let walked = match at {
                    0 => prices.outside(node.count, n, LINES_THAT_HIT),
                    _ => prices.alone(node.count, n, LINES_THAT_HIT),
                };
                // A ray that enters the root's tetrahedra is not prepared for the BVH.
                let prepared = if at == 0 { costs.ray } else { 0.0 };
                let through = costs.outside * self.visits[at as usize] as f64
                    + (prepared - walked) * f64::from(self.entered[at as usize]);
                gain.saved += weights[0] * through / self.outside.max(1) as f64;
            }
            let started = f64::from(started.max(1));
            (gain.tets, gain.bvh) = (gain.tets / started, gain.bvh / started);
        }
        gains
    }
}

/// 1 for a ray that ends at one of the node's triangles, else 0.
fn hits(traced: &Traced, node: &crate::bvh::Node) -> f64 {
    let here = |(row, _)| (node.first..node.first + node.count).contains(&row);
    if traced.hit.is_some_and(here) { 1.0 } else { 0.0 }
}

/// Whether a ray leaves a node's box without having hit one of its triangles.
pub(super) fn leaves(ray: &SampleRay, traced: &Traced, node: &crate::bvh::Node) -> bool {
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
