//! The cheapest plane that splits a node, found with bins of equal width along each axis: for object splits by the
//! references' centres, for spatial splits by the parts of the references in each bin.

use super::boxes::{Box3, Reference, parts};
use bth_import::Mesh;

/// Bins per axis.
const BINS: usize = 32;

/// A candidate split of a node by an axis-aligned plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct SplitPlane {
    pub(super) axis: usize,
    /// Coordinate of the plane on its axis.
    pub(super) at: f32,
    /// Sum of the costs of both sides.
    pub(super) cost: f64,
}

/// Cost of a box with half this surface area that holds this many references.
type Cost<'a> = &'a dyn Fn(f64, usize) -> f64;

#[derive(Clone, Copy)]
struct Bin {
    /// Around the references, or their parts, in the bin.
    bounds: Box3,
    /// References whose first bin this is.
    begin: usize,
    /// References whose last bin this is.
    end: usize,
}

const EMPTY_BINS: [Bin; BINS] = [Bin { bounds: Box3::EMPTY, begin: 0, end: 0 }; BINS];

/// Lower ends of the bins between two coordinates; `None` if these are too close for as many different numbers.
fn ends(lower: f32, upper: f32) -> Option<[f32; BINS]> {
    let ends: [f32; BINS] = std::array::from_fn(|i| lower + (upper - lower) * (i as f32 / BINS as f32));
    (ends.windows(2).all(|w| w[0] < w[1]) && ends[BINS - 1] < upper).then_some(ends)
}

/// The last slab that begins at or below x.
fn bin_of(ends: &[f32; BINS], x: f32) -> usize {
    ends.partition_point(|&end| end <= x).saturating_sub(1)
}

/// The cheapest plane that divides the references by their centres; no reference is split.
pub(super) fn by_centers(references: &[Reference], cost: Cost<'_>) -> Option<SplitPlane> {
    let mut best = None;
    for axis in 0..3 {
        let centers = || references.iter().map(|r| r.bounds.center(axis));
        let (lower, upper) =
            centers().fold((f32::INFINITY, f32::NEG_INFINITY), |(l, u), c| (l.min(c), u.max(c)));
        let Some(ends) = ends(lower, upper) else { continue };
        let mut bins = EMPTY_BINS;
        for reference in references {
            let bin = &mut bins[bin_of(&ends, reference.bounds.center(axis))];
            bin.bounds.grow(&reference.bounds);
            bin.begin += 1;
            bin.end += 1;
        }
        cheapest(axis, &ends, &bins, references.len(), cost, &mut best);
    }
    best
}

/// The cheapest plane that splits the references where it crosses them.
pub(super) fn by_space(mesh: &Mesh, references: &[Reference], cost: Cost<'_>) -> Option<SplitPlane> {
    let mut best = None;
    for axis in 0..3 {
        let lower = references.iter().map(|r| r.bounds.lower[axis]).fold(f32::INFINITY, f32::min);
        let upper = references.iter().map(|r| r.bounds.upper[axis]).fold(f32::NEG_INFINITY, f32::max);
        let Some(ends) = ends(lower, upper) else { continue };
        let mut bins = EMPTY_BINS;
        for reference in references {
            let first = bin_of(&ends, reference.bounds.lower[axis]);
            // A reference that ends on a plane has no part beyond it.
            let last = bin_of(&ends, reference.bounds.upper[axis].next_down()).max(first);
            bins[first].begin += 1;
            bins[last].end += 1;
            let corners = mesh.corners(reference.id);
            let mut rest = reference.bounds;
            for at in first..last {
                let [here, beyond] = parts(&corners, &rest, axis, ends[at + 1]);
                if !here.is_empty() {
                    bins[at].bounds.grow(&here);
                }
                rest = beyond;
            }
            if !rest.is_empty() {
                bins[last].bounds.grow(&rest);
            }
        }
        cheapest(axis, &ends, &bins, references.len(), cost, &mut best);
    }
    best
}

/// Replaces `best` by a cheaper plane between two bins, if there is one. Planes that leave a side empty, or all `total`
/// references on one side, do not count.
fn cheapest(
    axis: usize,
    ends: &[f32; BINS],
    bins: &[Bin; BINS],
    total: usize,
    cost: Cost<'_>,
    best: &mut Option<SplitPlane>,
) {
    let mut right = [(0.0, 0); BINS];
    let (mut bounds, mut count) = (Box3::EMPTY, 0);
    for (bin, right) in bins.iter().zip(&mut right).rev() {
        bounds.grow(&bin.bounds);
        count += bin.end;
        *right = (bounds.half_area(), count);
    }
    let (mut bounds, mut left) = (Box3::EMPTY, 0);
    for at in 1..BINS {
        bounds.grow(&bins[at - 1].bounds);
        left += bins[at - 1].begin;
        let (area, right) = right[at];
        if left.min(right) == 0 || left.max(right) == total {
            continue;
        }
        let cost = cost(bounds.half_area(), left) + cost(area, right);
        if best.is_none_or(|best| cost < best.cost) {
            *best = Some(SplitPlane { axis, at: ends[at], cost });
        }
    }
}
