//! How many directions are free, and whether they are worth their bytes.

use super::frame::{SECTOR_SHARES, share};
use super::search::Found;
use crate::bvh::BinaryBvh;
use bth_format::layout::{FREE_SECTORS, FreeBins, FreeSectors};
use bth_import::Mesh;
use serde::{Deserialize, Serialize};

/// What is kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kept {
    /// Nothing.
    #[default]
    None,
    /// Distances of both sides of triangles.
    Distances,
    /// Free directions and distances of one side.
    Directions,
}

/// Least share of free directions for which [`super::KeepFree::Auto`] keeps them.
const LEAST_SHARE: f64 = 0.5;
/// Least share of directions beyond the first level for which it keeps distances.
const LEAST_BEYOND: f64 = 0.5;

/// Report of [`super::find`]. Shares are those of cosine-weighted rays from triangles, by area. They are estimates from a sample
/// of the triangles where nothing is kept.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FreeReport {
    /// Triangles that rays may start on.
    pub triangles: u64,
    /// Share of the rays that certainly meet nothing; 0 where distances alone were decided.
    pub free: f64,
    /// As `free`, where each triangle counts the same: the outside of the walls of a room may be most of its area.
    pub free_by_triangle: f64,
    /// For each level the share of the rays that certainly meet nothing within its distance, from the sides that are told.
    pub beyond: [f64; FreeSectors::LEVELS],
    /// As `beyond`, where each triangle counts the same.
    pub beyond_by_triangle: [f64; FreeSectors::LEVELS],
    /// The distances of the levels, object space.
    pub levels: [f32; FreeSectors::LEVELS],
    /// What is kept.
    pub kept: Kept,
    /// Whether nothing was decided, since there are too many triangles ([`super::FreeOptions::most_triangles`]).
    pub undecided: bool,
    /// Wall-clock time of the stage as the pipeline measures it, seconds; 0 where the stage is called on its own.
    pub seconds: f64,
}

impl FreeReport {
    /// The report of some rows of the order of the BVH.
    pub(super) fn new(
        (mesh, tree): (&Mesh, &BinaryBvh),
        decided: &[(usize, Found)],
        levels: [f32; FreeSectors::LEVELS],
        kept: Kept,
    ) -> Self {
        let mut out =
            FreeReport { triangles: tree.order.len() as u64, levels, kept, ..FreeReport::default() };
        let mut area = 0.0;
        for (row, found) in decided {
            let corners = crate::vectors::corners(mesh, tree.order[*row]);
            let size = crate::vectors::double_area(corners).length();
            area += size;
            let free = share(found.bins.0 & FreeBins::ALL);
            out.free += size * free;
            out.free_by_triangle += free;
            for level in 0..FreeSectors::LEVELS {
                let beyond = if kept == Kept::Directions {
                    beyond(found.sectors[usize::from(found.bins.is_back())], level + 1)
                } else {
                    (beyond(found.sectors[0], level + 1) + beyond(found.sectors[1], level + 1)) / 2.0
                };
                out.beyond[level] += size * beyond;
                out.beyond_by_triangle[level] += beyond;
            }
        }
        let triangles = (decided.len() as f64).max(1.0);
        let mean = |sum: f64, of: f64| if of > 0.0 { (sum / of).min(1.0) } else { 0.0 };
        out.free = mean(out.free, area);
        out.free_by_triangle = mean(out.free_by_triangle, triangles);
        out.beyond = out.beyond.map(|sum| mean(sum, area));
        out.beyond_by_triangle = out.beyond_by_triangle.map(|sum| mean(sum, triangles));
        out
    }

    /// What is worth its bytes by these shares ([`super::KeepFree::Auto`]), from whatever triangles rays start.
    pub(super) fn worthwhile(&self) -> Kept {
        if self.free.min(self.free_by_triangle) >= LEAST_SHARE {
            Kept::Directions
        } else if self.beyond[0].min(self.beyond_by_triangle[0]) >= LEAST_BEYOND {
            Kept::Distances
        } else {
            Kept::None
        }
    }
}

/// Share of the cosine-weighted directions of a side that lie in sectors of a level or a greater one.
fn beyond(sectors: FreeSectors, level: usize) -> f64 {
    (0..FREE_SECTORS)
        .filter(|sector| sectors.level(*sector) >= level)
        .map(|sector| SECTOR_SHARES[sector])
        .sum()
}
