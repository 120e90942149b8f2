//! Decides if free directions are worth their bytes: by what rays that hit the mesh from everywhere
//! would know where they start again.
//!
//! Many triangles of a mesh may be where no ray comes, such as the inner ones of parts that lie in
//! each other, and a room's walls are seen from one side. So triangles are not sampled by
//! themselves, but by rays: from outside, as an object is seen, and from points within its box, as
//! a room is.

use super::frame::{beyond, share};
use super::search::{Found, Surroundings};
use super::{Kept, decide};
use crate::bvh::BinaryBvh;
use crate::error::Result;
use crate::monitor::Monitor;
use crate::sampling::{SampleRay, affordable, outside, walk, within};
use crate::vectors::{corners, double_area};
use bth_format::layout::FreeBins;
use bth_import::Mesh;
use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeSet, HashMap};
use std::fmt;

/// Smallest share of directions beyond the first level, from outside and from within, for which
/// [`super::KeepFree::Auto`] keeps anything.
const LEAST_OPEN: f64 = 0.5;
/// Smallest share of free directions from outside for which it keeps them, and not distances alone.
/// Half of the lines hit terrain on its back, for which rows then hold nothing.
const LEAST_FREE: f64 = 1.0 / 3.0;
/// Triangles for each ray of a kind, and the min and max number of rays of a kind.
const TRIANGLES_A_RAY: usize = 16;
const RAYS: [usize; 2] = [256, 2048];
/// Rays from each point within the box.
const RAYS_A_POINT: usize = 8;

/// What is known, in the mean, of the directions from the points where rays hit the mesh, on the
/// side that they hit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Seen {
    /// Rays that hit the mesh.
    pub rays: u64,
    /// Share of cosine-weighted directions in which rays certainly hit nothing within the distance
    /// of the first level.
    pub open: f64,
}

/// What [`super::KeepFree::Auto`] decides by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Worth {
    /// By lines that are uniform in space.
    pub from_outside: Seen,
    /// By rays in uniform directions from uniform points of the box that are not in solids.
    pub from_within: Seen,
    /// Share of cosine-weighted directions in which rays certainly hit nothing, where lines from
    /// outside hit the mesh; 0 where too few are open, or where there is no room for free
    /// directions.
    pub free: f64,
}

impl Worth {
    /// Returns true if anything is worth its bytes.
    fn is_open(&self) -> bool {
        let kinds = [self.from_outside, self.from_within];
        kinds.iter().all(|seen| seen.rays == 0 || seen.open >= LEAST_OPEN)
            && kinds.iter().any(|seen| seen.rays > 0)
    }
}

impl Worth {
    /// Returns true if no ray was judged.
    pub fn is_unmeasured(&self) -> bool {
        self.from_outside.rays == 0 && self.from_within.rays == 0
    }
}

impl fmt::Display for Worth {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [outside, within, free] =
            [self.from_outside.open, self.from_within.open, self.free].map(|share| 100.0 * share);
        write!(
            f,
            "where rays from outside meet it {outside:.0} % of directions are open up to the first distance and {free:.0} % free, where rays from \
             within do {within:.0} %"
        )
    }
}

/// A triangle that a ray hits.
#[derive(Clone, Copy)]
struct RayHit {
    /// Row of the BVH's order.
    row: usize,
    is_back: bool,
}

/// What is worth keeping, and what that was decided by.
///
/// # Errors
/// Only [`crate::Error::Cancelled`].
pub(super) fn worth(
    around: &mut Surroundings<'_>,
    tree: &BinaryBvh,
    monitor: &dyn Monitor,
) -> Result<(Kept, Worth)> {
    let mut worth = Worth::default();
    let count = (tree.order.len() / TRIANGLES_A_RAY).clamp(RAYS[0], RAYS[1]);
    let root = &tree.nodes[0];
    let all = outside(root.lower, root.upper, count, 1);
    let drawn = all.len();
    let lines = affordable(around.mesh, tree, all);
    let count = if drawn == 0 { count } else { (count * lines.len()).div_ceil(drawn) };
    let from_outside: Vec<RayHit> =
        lines.par_iter().filter_map(|line| meet(around.mesh, tree, line)).collect();
    let from_within = met_from_within(around.mesh, tree, count);
    around.kept = Kept::Distances;
    let of_row = decide_met(around, from_outside.iter().chain(&from_within), monitor)?;
    let open = |met: &RayHit| beyond(of_row[&met.row].sectors[usize::from(met.is_back)], 1);
    let seen = |met: &[RayHit]| Seen { rays: met.len() as u64, open: mean(met, open) };
    (worth.from_outside, worth.from_within) = (seen(&from_outside), seen(&from_within));
    if !worth.is_open() {
        return Ok((Kept::None, worth));
    }
    around.kept = Kept::Directions;
    let of_row = decide_met(around, &from_outside, monitor)?;
    worth.free = mean(&from_outside, |met| {
        let bins = of_row[&met.row].bins;
        if bins.is_back() == met.is_back { share(bins.0 & FreeBins::ALL) } else { 0.0 }
    });
    Ok((if worth.free >= LEAST_FREE { Kept::Directions } else { Kept::Distances }, worth))
}

/// Returns the triangles that rays in uniform directions from uniform points of the box hit. Skips
/// points in solids, from which only backs are seen: what is in a room shows its front.
fn met_from_within(mesh: &Mesh, tree: &BinaryBvh, count: usize) -> Vec<RayHit> {
    let root = &tree.nodes[0];
    let rays = within(root.lower, root.upper, [count.div_ceil(RAYS_A_POINT), RAYS_A_POINT], 2);
    let of_point = |rays: &[SampleRay]| {
        let met: Vec<RayHit> = rays.iter().filter_map(|ray| meet(mesh, tree, ray)).collect();
        if met.iter().all(|met| met.is_back) { Vec::new() } else { met }
    };
    rays.par_chunks(RAYS_A_POINT).flat_map_iter(of_point).collect()
}

/// The first triangle that a ray hits.
fn meet(mesh: &Mesh, tree: &BinaryBvh, ray: &SampleRay) -> Option<RayHit> {
    let (row, _) = walk(mesh, tree, ray, |_| ()).hit?;
    let normal = double_area(corners(mesh, tree.order[row as usize]));
    Some(RayHit { row: row as usize, is_back: normal.dot(DVec3::from(ray.direction)) > 0.0 })
}

/// What is known of the triangles that rays hit, by rows.
fn decide_met<'a>(
    around: &Surroundings<'_>,
    met: impl IntoIterator<Item = &'a RayHit>,
    monitor: &dyn Monitor,
) -> Result<HashMap<usize, Found>> {
    let rows: BTreeSet<usize> = met.into_iter().map(|met| met.row).collect();
    let tasks: Vec<_> = rows.into_iter().map(|row| row..row + 1).collect();
    Ok(decide(around, &tasks, monitor, |_| ())?.into_iter().collect())
}

/// The mean of a share over the hits; 0 without hits.
fn mean(met: &[RayHit], share: impl Fn(&RayHit) -> f64) -> f64 {
    let sum = met.iter().fold(0.0, |sum, met| sum + share(met));
    (sum / (met.len() as f64).max(1.0)).min(1.0)
}
