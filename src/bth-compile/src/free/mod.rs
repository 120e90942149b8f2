//! Free directions: what a ray that starts on a triangle certainly cannot hit, by bins of
//! directions.
//!
//! For each triangle and bin the *shaft* holds all points that rays reach from any point of the
//! triangle in any direction of the bin. If no other triangle touches the shaft, the bin is free.
//! Bins are joined to *sectors*, and a sector has a distance within which no other triangle touches
//! the shafts of its bins. A row holds either the free bins and the sectors of one side of the
//! triangle, nearly always its front, or the sectors of both sides.
//!
//! A proof for each pair of bin and triangle would take too long. So conservative tests of boxes
//! skip nodes of the BVH, what is small for its distance blocks without a proof, and bins that are
//! blocked are not tested again.

// Kernels loop over lanes by index: closures could be compiled as functions without the kernel's
// instruction set.
#![allow(clippy::needless_range_loop)]

mod frame;
mod meet;
mod report;
mod rows;
mod search;
mod see;
mod start;
mod tree;
mod worth;

#[cfg(test)]
mod tests;

pub use report::{FreeReport, Kept};
pub(crate) use rows::FreeRows;
pub use worth::{Seen, Worth};

use crate::bvh::BinaryBvh;
use crate::error::Result;
use crate::monitor::Monitor;
use bth::Isa;
use bth_format::layout::{FREE_DISTANCE_RANGE, FreeDirections, FreeDistances, FreeSectors};
use bth_import::Mesh;
use rayon::prelude::*;
use search::{Decide, Found, Surroundings};
use serde::Serialize;
use std::ops::Range;
use tree::Tree;

/// Selects which free directions and distances are decided and kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum KeepFree {
    /// Not at all.
    #[default]
    None,
    /// Directions and distances where they pay, else distances alone where those do, else nothing.
    Auto,
    /// Distances alone, always.
    Distances,
    /// Directions and distances, always.
    All,
}

impl KeepFree {
    /// Returns true if they are to be kept whatever they are worth.
    pub(crate) fn always(self) -> bool {
        matches!(self, KeepFree::Distances | KeepFree::All)
    }
}

/// Options of [`find`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FreeOptions {
    /// Which of them are kept.
    pub keep: KeepFree,
    /// The second of three distances that are told apart, an eighth of it, it and four times it,
    /// relative to the diagonal of the object's box.
    pub reach: f64,
}

impl Default for FreeOptions {
    fn default() -> Self {
        FreeOptions { keep: KeepFree::default(), reach: 1.0 / 16.0 }
    }
}

/// What is known of the directions of all triangles. At most one of the lists has rows, one for
/// each triangle of the mesh, zeros where nothing is known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Free {
    /// Distances of the levels of sectors, object space.
    pub levels: [f32; FreeSectors::LEVELS],
    /// Bins and sectors of one side.
    pub directions: Vec<FreeDirections>,
    /// Sectors of both sides.
    pub distances: Vec<FreeDistances>,
}

impl Free {
    /// Returns true if the rows belong to a mesh with this number of triangles.
    pub(crate) fn is_of(&self, triangles: usize) -> bool {
        let [directions, distances] = [self.directions.len(), self.distances.len()];
        [directions, distances].iter().all(|rows| [0, triangles].contains(rows))
            && directions.min(distances) == 0
    }
}

/// Rows that one task decides.
const TASK: usize = 512;

/// Decides what is known of the directions of all triangles of a mesh, as far as it is to be kept.
/// Only what is certain is told.
///
/// # Errors
/// Only [`crate::Error::Cancelled`].
pub fn find(
    mesh: &Mesh,
    tree: &BinaryBvh,
    options: &FreeOptions,
    monitor: &dyn Monitor,
) -> Result<(Free, FreeReport)> {
    let (levels, rows) = (levels(tree, options.reach), tree.order.len());
    let mut free = Free { levels, ..Free::default() };
    monitor.stage("free directions", Some(rows as u64));
    let Some(wide) = Tree::new(mesh, tree) else {
        return Ok((free, FreeReport::new((mesh, tree), &[], levels, Kept::None)));
    };
    let mut around = Surroundings { mesh, order: &tree.order, tree: wide, levels, kept: Kept::None };
    let mut of_auto = None;
    around.kept = match options.keep {
        KeepFree::None => Kept::None,
        KeepFree::All => Kept::Directions,
        KeepFree::Distances => Kept::Distances,
        KeepFree::Auto => {
            let (kept, known) = worth::worth(&mut around, tree, monitor)?;
            of_auto = Some(known);
            kept
        }
    };
    if around.kept == Kept::None {
        let report = FreeReport::new((mesh, tree), &[], levels, Kept::None);
        return Ok((free, FreeReport { worth: of_auto, ..report }));
    }
    let tasks: Vec<Range<usize>> =
        (0..rows).step_by(TASK).map(|first| first..rows.min(first + TASK)).collect();
    let decided = decide(&around, &tasks, monitor, |rows| monitor.advance(rows))?;
    let triangles = mesh.triangles.len();
    if around.kept == Kept::Directions {
        free.directions = vec![FreeDirections::UNKNOWN; triangles];
        for (row, found) in &decided {
            let side = usize::from(found.bins.is_back());
            let of_triangle = FreeDirections::new(found.sectors[side], found.bins);
            free.directions[tree.order[*row] as usize] = of_triangle;
        }
    } else {
        free.distances = vec![FreeDistances::UNKNOWN; triangles];
        for (row, found) in &decided {
            free.distances[tree.order[*row] as usize].sectors = found.sectors.map(|sectors| sectors.0);
        }
    }
    let report = FreeReport::new((mesh, tree), &decided, levels, around.kept);
    Ok((free, FreeReport { worth: of_auto, ..report }))
}

/// Decides rows of the order of the BVH, in parallel by tasks.
fn decide(
    around: &Surroundings<'_>,
    tasks: &[Range<usize>],
    monitor: &dyn Monitor,
    advance: impl Fn(u64) + Sync,
) -> Result<Vec<(usize, Found)>> {
    let parts = tasks.par_iter().map(|rows| {
        monitor.check()?;
        let decided = Isa::chosen().run(Decide { around, rows: rows.clone() });
        advance(decided.len() as u64);
        Ok(rows.clone().zip(decided).collect::<Vec<_>>())
    });
    Ok(parts.collect::<Result<Vec<_>>>()?.into_iter().flatten().collect())
}

/// The distances of the levels in object space; zeros, within which nothing lies, where they would
/// not be in the range of the format.
fn levels(tree: &BinaryBvh, reach: f64) -> [f32; FreeSectors::LEVELS] {
    /// Shares of the reach.
    const LEVELS: [f64; FreeSectors::LEVELS] = [1.0 / 8.0, 1.0, 4.0];
    let Some(root) = tree.nodes.first() else { return [0.0; FreeSectors::LEVELS] };
    let square = |k: usize| (f64::from(root.upper[k]) - f64::from(root.lower[k])).powi(2);
    let reach = reach * (0..3).map(square).sum::<f64>().sqrt();
    let levels = LEVELS.map(|share| (share * reach) as f32);
    let [least, most] = FREE_DISTANCE_RANGE;
    if least <= levels[0] && levels[2] <= most { levels } else { [0.0; FreeSectors::LEVELS] }
}
