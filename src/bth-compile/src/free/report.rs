//! How many directions are free.

use super::frame::{beyond, share};
use super::search::Found;
use super::worth::Worth;
use crate::bvh::BinaryBvh;
use bth_format::layout::{FreeBins, FreeSectors};
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

/// Report of [`super::find`]. Shares are shares of cosine-weighted rays from triangles, by area,
/// for what is kept.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FreeReport {
    /// Triangles that rays may start on.
    pub triangles: u64,
    /// Share of the rays that certainly hit nothing; 0 where distances alone were decided.
    pub free: f64,
    /// For each level the share of the rays that certainly hit nothing within its distance, from
    /// the sides that the rows hold.
    pub beyond: [f64; FreeSectors::LEVELS],
    /// The distances of the levels, object space.
    pub levels: [f32; FreeSectors::LEVELS],
    /// What is kept.
    pub kept: Kept,
    /// What [`super::KeepFree::Auto`] decided by: of what is kept, or of distances where nothing
    /// is.
    pub worth: Option<Worth>,
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
            out.free += size * share(found.bins.0 & FreeBins::ALL);
            for level in 0..FreeSectors::LEVELS {
                let beyond = if kept == Kept::Directions {
                    beyond(found.sectors[usize::from(found.bins.is_back())], level + 1)
                } else {
                    (beyond(found.sectors[0], level + 1) + beyond(found.sectors[1], level + 1)) / 2.0
                };
                out.beyond[level] += size * beyond;
            }
        }
        if area > 0.0 {
            out.free = (out.free / area).min(1.0);
            out.beyond = out.beyond.map(|sum| (sum / area).min(1.0));
        }
        out
    }
}
