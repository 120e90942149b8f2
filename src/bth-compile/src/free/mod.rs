//! Free directions: what a ray that starts on a triangle certainly cannot meet, by bins of directions.
//!
//! For each triangle and bin the *shaft* holds all points that rays reach from any point of the triangle in any direction of the bin. If
//! no other triangle meets the shaft, the bin is free; if none does within the reach, it is free nearby. A bin whose directions lie on
//! both sides of the triangle is never free, so that a bin belongs to one side and needs no more than one class.
//!
//! A proof for each pair of bin and triangle nearby would take too long: nodes of the BVH are left out by conservative tests of
//! boxes, and bins that are blocked are not asked again.

mod bins;
mod places;
mod search;
mod shaft;

#[cfg(test)]
mod tests;

use crate::bvh::BinaryBvh;
use crate::error::Result;
use crate::monitor::Monitor;
use bth_format::layout::{FREE_BINS, FREE_BYTES, FREE_REACH_RANGE, FreeClass, FreeDirections, NONE};
use bth_import::Mesh;
use rayon::prelude::*;
use search::{Search, Surroundings};

pub(crate) use places::FreeRows;

use serde::{Deserialize, Serialize};

/// Whether free directions are decided and kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum KeepFree {
    /// Not at all.
    #[default]
    None,
    /// Where enough directions are free.
    Auto,
    /// Always.
    All,
}

/// Least share of free directions, all or nearby, for which [`KeepFree::Auto`] keeps them.
const LEAST_SHARE: f64 = 0.25;

/// Options of [`find`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FreeOptions {
    /// Whether and where they are kept.
    pub keep: KeepFree,
    /// Distance within which [`FreeClass::Near`] promises that nothing is met, relative to the diagonal of the object's box.
    pub reach: f64,
}

impl Default for FreeOptions {
    fn default() -> Self {
        FreeOptions { keep: KeepFree::default(), reach: 1.0 / 16.0 }
    }
}

/// Classes of the bins of all triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Free {
    /// The reach in object space.
    pub reach: f32,
    /// For each triangle of the mesh the classes as [`FreeDirections`] stores them; zeros for those without an area.
    pub classes: Vec<[u8; FREE_BYTES]>,
}

/// Report of [`find`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FreeReport {
    /// Triangles that rays may start on.
    pub triangles: u64,
    /// Share of the cosine-weighted rays from the more open side of each triangle that certainly meet nothing, by area.
    pub free: f64,
    /// The same within the reach.
    pub free_nearby: f64,
    /// The reach in object space.
    pub reach: f64,
    /// Whether they are kept.
    pub kept: bool,
    /// Wall-clock time of the stage as the pipeline measures it, seconds; 0 where the stage is called on its own.
    pub seconds: f64,
}

/// Most triangles of a subtree whose bins are decided together.
const CLUSTER: u32 = 16;
/// Most triangles of a subtree that one task decides, cluster by cluster. Part of the result: what blocked a bin is remembered within
/// a task.
const TASK: u32 = 512;

impl FreeReport {
    /// Whether the directions are worth their bytes.
    pub fn is_worthwhile(&self, keep: KeepFree) -> bool {
        match keep {
            KeepFree::None => false,
            KeepFree::Auto => self.free.max(self.free_nearby) >= LEAST_SHARE,
            KeepFree::All => true,
        }
    }
}

/// Decides the bins of all triangles of a mesh. Only what is certain is called free.
///
/// # Errors
/// Only [`crate::Error::Cancelled`].
pub fn find(
    mesh: &Mesh,
    tree: &BinaryBvh,
    options: &FreeOptions,
    monitor: &dyn Monitor,
) -> Result<(Free, FreeReport)> {
    monitor.stage("free directions", Some(tree.order.len() as u64));
    let reach = reach(tree, options.reach);
    let around = Surroundings::new(mesh, tree, reach, options.keep == KeepFree::All);
    let parts = subtrees(tree, 0, TASK).into_par_iter().map(|task| {
        monitor.check()?;
        let mut search = Search::new(&around);
        let mut classes = Vec::with_capacity(TASK as usize);
        for cluster in subtrees(tree, task, CLUSTER) {
            search.decide(cluster, &mut |row, of_row| classes.push((row, FreeDirections::new(NONE, &of_row).classes)));
        }
        monitor.advance(classes.len() as u64);
        Ok(classes)
    });
    let parts = parts.collect::<Result<Vec<_>>>()?;
    let mut free = Free { reach, classes: vec![[0; FREE_BYTES]; mesh.triangles.len()] };
    for (row, classes) in parts.into_iter().flatten() {
        free.classes[tree.order[row as usize] as usize] = classes;
    }
    let report = report(mesh, tree, &free);
    Ok((free, report))
}

/// The largest subtrees of at most `most` triangles below a node, from left to right.
fn subtrees(tree: &BinaryBvh, node: u32, most: u32) -> Vec<u32> {
    let (mut stack, mut found) = (vec![node], Vec::new());
    while let Some(node) = stack.pop() {
        match tree.nodes.get(node as usize) {
            Some(inner) if inner.count > most => stack.extend([inner.right, node + 1]),
            Some(_) => found.push(node),
            None => {}
        }
    }
    found
}

/// The reach in object space; 0, within which nothing lies, where it would not be in the range of the format.
fn reach(tree: &BinaryBvh, relative: f64) -> f32 {
    let Some(root) = tree.nodes.first() else { return 0.0 };
    let square = |k: usize| (f64::from(root.upper[k]) - f64::from(root.lower[k])).powi(2);
    let reach = (relative * (0..3).map(square).sum::<f64>().sqrt()) as f32;
    if FREE_REACH_RANGE[0] <= reach && reach <= FREE_REACH_RANGE[1] { reach } else { 0.0 }
}

/// Shares of free directions, by area and cosine.
fn report(mesh: &Mesh, tree: &BinaryBvh, free: &Free) -> FreeReport {
    let (mut area, mut shares) = (0.0, [0.0; 2]);
    for &triangle in &tree.order {
        let normal = crate::vectors::double_area(crate::vectors::corners(mesh, triangle));
        let size = normal.length();
        let row = FreeDirections { place: NONE, classes: free.classes[triangle as usize] };
        let mut sides = [[0.0; 2]; 2];
        for bin in 0..FREE_BINS {
            let class = row.class(bin);
            let d = bins::CONES[bin].corners;
            let d: glam::DVec3 = std::array::from_fn(|k| (d[0][k] + d[2][k]) / 2.0).into();
            // Bins have nearly the same solid angle.
            let cosine = crate::vectors::unit(d).dot(normal) / size;
            let weight = 4.0 / FREE_BINS as f64 * cosine.abs();
            let side = &mut sides[usize::from(cosine < 0.0)];
            side[0] += if class == FreeClass::All { weight } else { 0.0 };
            side[1] += if class == FreeClass::Unknown { 0.0 } else { weight };
        }
        let side = if sides[0] >= sides[1] { sides[0] } else { sides[1] };
        area += size;
        shares.iter_mut().zip(side).for_each(|(sum, share)| *sum += size * share);
    }
    let share = |sum: f64| if area > 0.0 { (sum / area).min(1.0) } else { 0.0 };
    FreeReport {
        triangles: tree.order.len() as u64,
        free: share(shares[0]),
        free_nearby: share(shares[1]),
        reach: f64::from(free.reach),
        kept: false,
        seconds: 0.0,
    }
}
