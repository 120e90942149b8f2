//! Free directions: what a ray that starts on a triangle certainly cannot meet, by bins of directions.
//!
//! For each triangle and bin the *shaft* holds all points that rays reach from any point of the triangle in any direction of the bin. If
//! no other triangle meets the shaft, the bin is free; if none does within the reach, it is free nearby. Bins are those of one side of
//! the triangle, nearly always its front, and a row tells either what is free or what is free nearby: there are bits for twice as many
//! directions then.
//!
//! A proof for each pair of bin and triangle would take too long: nodes of the BVH are left out by conservative tests of boxes, what is
//! small for its distance blocks without a proof, and bins that are blocked are not asked again.

// Kernels loop over lanes by index: closures could be compiled as functions without the kernel's instruction set.
#![allow(clippy::needless_range_loop)]

mod frame;
mod meet;
mod places;
mod search;
mod see;
mod start;
mod tree;

#[cfg(test)]
mod tests;

pub(crate) use places::FreeRows;

use crate::bvh::BinaryBvh;
use crate::error::Result;
use crate::monitor::Monitor;
use bth::Isa;
use bth_format::layout::{FREE_REACH_RANGE, FreeBins, FreeDirections, NONE};
use bth_import::Mesh;
use frame::share;
use rayon::prelude::*;
use search::{Decide, Surroundings};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use tree::Tree;

/// Whether free directions are decided and kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum KeepFree {
    /// Not at all.
    #[default]
    None,
    /// Where enough directions are free, at all distances.
    Auto,
    /// Always.
    All,
}

/// Least share of free directions for which [`KeepFree::Auto`] keeps them.
const LEAST_SHARE: f64 = 0.5;
/// [`KeepFree::Auto`] decides the bins of the first `SAMPLED` of `EVERY` consecutive triangles first, and no others if the share of their
/// free directions is less than this part of the least one.
const SAMPLED: usize = 32;
const EVERY: usize = 512;
const CLEARLY: f64 = 0.8;

/// Options of [`find`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FreeOptions {
    /// Whether and where they are kept.
    pub keep: KeepFree,
    /// Distance within which nothing is met in directions that are free nearby, relative to the diagonal of the object's box.
    pub reach: f64,
}

impl Default for FreeOptions {
    fn default() -> Self {
        FreeOptions { keep: KeepFree::default(), reach: 1.0 / 16.0 }
    }
}

/// The free bins of all triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Free {
    /// The reach in object space.
    pub reach: f32,
    /// For each triangle of the mesh the bins as [`FreeDirections`] stores them; zeros where nothing is known.
    pub bins: Vec<[u32; 4]>,
}

/// Report of [`find`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FreeReport {
    /// Triangles that rays may start on.
    pub triangles: u64,
    /// Share of the cosine-weighted rays from triangles that certainly meet nothing, by area. An estimate from a sixteenth of the
    /// triangles where that already shows that they are not worth their bytes.
    pub free: f64,
    /// Share of those that certainly meet nothing within the reach, where no more is known.
    pub free_nearby: f64,
    /// As `free`, where each triangle counts the same: the outside of the walls of a room may be most of its area.
    pub free_by_triangle: f64,
    /// The reach in object space.
    pub reach: f64,
    /// Whether they are kept.
    pub kept: bool,
    /// Wall-clock time of the stage as the pipeline measures it, seconds; 0 where the stage is called on its own.
    pub seconds: f64,
}

impl FreeReport {
    /// Whether the directions are worth their bytes.
    pub fn is_worthwhile(&self, keep: KeepFree) -> bool {
        match keep {
            KeepFree::None => false,
            KeepFree::Auto => self.certain_share() >= LEAST_SHARE,
            KeepFree::All => true,
        }
    }

    /// The share of free directions from whatever triangles rays start on.
    fn certain_share(&self) -> f64 {
        self.free.min(self.free_by_triangle)
    }
}

/// Rows that one task decides.
const TASK: usize = 512;

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
    let rows = tree.order.len();
    let mut free = Free { reach, bins: vec![[0; 4]; mesh.triangles.len()] };
    let Some(wide) = Tree::new(mesh, tree) else {
        return Ok((free, report(mesh, tree, &[], reach)));
    };
    let around = Surroundings { mesh, order: &tree.order, tree: wide, reach };
    if options.keep == KeepFree::Auto {
        let samples: Vec<Range<usize>> =
            (0..rows).step_by(EVERY).map(|first| first..rows.min(first + SAMPLED)).collect();
        let report = report(mesh, tree, &decide(&around, &samples, monitor, |_| ())?, reach);
        if report.certain_share() < CLEARLY * LEAST_SHARE {
            return Ok((free, report));
        }
    }
    let tasks: Vec<Range<usize>> =
        (0..rows).step_by(TASK).map(|first| first..rows.min(first + TASK)).collect();
    let decided = decide(&around, &tasks, monitor, |rows| monitor.advance(rows))?;
    for (row, bins) in &decided {
        free.bins[tree.order[*row] as usize] = FreeDirections::new(NONE, *bins).bins;
    }
    Ok((free, report(mesh, tree, &decided, reach)))
}

/// Decides the bins of rows of the order of the BVH, in parallel by tasks.
fn decide(
    around: &Surroundings<'_>,
    tasks: &[Range<usize>],
    monitor: &dyn Monitor,
    advance: impl Fn(u64) + Sync,
) -> Result<Vec<(usize, FreeBins)>> {
    let parts = tasks.par_iter().map(|rows| {
        monitor.check()?;
        let decided = Isa::chosen().run(Decide { around, rows: rows.clone() });
        advance(decided.len() as u64);
        Ok(rows.clone().zip(decided).collect::<Vec<_>>())
    });
    Ok(parts.collect::<Result<Vec<_>>>()?.into_iter().flatten().collect())
}

/// The reach in object space; 0, within which nothing lies, where it would not be in the range of the format.
fn reach(tree: &BinaryBvh, relative: f64) -> f32 {
    let Some(root) = tree.nodes.first() else { return 0.0 };
    let square = |k: usize| (f64::from(root.upper[k]) - f64::from(root.lower[k])).powi(2);
    let reach = (relative * (0..3).map(square).sum::<f64>().sqrt()) as f32;
    let [least, most] = FREE_REACH_RANGE;
    if (least..=most).contains(&reach) { reach } else { 0.0 }
}

/// Shares of free directions of rows of the order of the BVH, by area and cosine.
fn report(mesh: &Mesh, tree: &BinaryBvh, decided: &[(usize, FreeBins)], reach: f32) -> FreeReport {
    let (mut area, mut shares, mut by_triangle) = (0.0, [0.0; 2], 0.0);
    for (row, bins) in decided {
        let corners = crate::vectors::corners(mesh, tree.order[*row]);
        let size = crate::vectors::double_area(corners).length();
        area += size;
        let free = share(bins.0 & FreeBins::ALL);
        shares[usize::from(bins.is_nearby())] += size * free;
        by_triangle += if bins.is_nearby() { 0.0 } else { free };
    }
    let [free, free_nearby] = shares.map(|sum| if area > 0.0 { (sum / area).min(1.0) } else { 0.0 });
    FreeReport {
        triangles: tree.order.len() as u64,
        free,
        free_nearby,
        free_by_triangle: by_triangle / (decided.len() as f64).max(1.0),
        reach: f64::from(reach),
        kept: false,
        seconds: 0.0,
    }
}
