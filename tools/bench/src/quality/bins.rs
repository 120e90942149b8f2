//! The best plane across a node: by slabs of equal width, of the references' centres or of space.

use super::boxes::{Box3, parts};
use super::spatial::Reference;
use bth_import::Mesh;

/// Slabs per axis.
const SLABS: usize = 32;

/// A plane, and what both of its sides cost.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    pub(super) axis: usize,
    pub(super) at: f32,
    pub(super) cost: f64,
}

/// What references in a box of so much area cost.
type Cost<'a> = &'a dyn Fn(f64, usize) -> f64;

#[derive(Clone, Copy)]
struct Slab {
    bounds: Box3,
    /// References that begin in it, and that end in it.
    begin: usize,
    end: usize,
}

const EMPTY: [Slab; SLABS] = [Slab { bounds: Box3::EMPTY, begin: 0, end: 0 }; SLABS];

/// Lower ends of the slabs between two places.
fn ends(lower: f32, upper: f32) -> Option<[f32; SLABS]> {
    let ends: [f32; SLABS] = std::array::from_fn(|i| lower + (upper - lower) * (i as f32 / SLABS as f32));
    (ends.windows(2).all(|w| w[0] < w[1]) && ends[SLABS - 1] < upper).then_some(ends)
}

/// The last slab that begins at or below x.
fn slab(ends: &[f32; SLABS], x: f32) -> usize {
    ends.partition_point(|&end| end <= x).saturating_sub(1)
}

/// The plane that best parts the references by their centres, each whole.
pub(super) fn by_centers(references: &[Reference], cost: Cost<'_>) -> Option<Plane> {
    let mut best = None;
    for axis in 0..3 {
        let centers = || references.iter().map(|r| r.bounds.center(axis));
        let (lower, upper) =
            centers().fold((f32::INFINITY, f32::NEG_INFINITY), |(l, u), c| (l.min(c), u.max(c)));
        let Some(ends) = ends(lower, upper) else { continue };
        let mut slabs = EMPTY;
        for reference in references {
            let slab = &mut slabs[slab(&ends, reference.bounds.center(axis))];
            slab.bounds.grow(&reference.bounds);
            slab.begin += 1;
            slab.end += 1;
        }
        cheapest(axis, &ends, &slabs, references.len(), cost, &mut best);
    }
    best
}

/// The plane that best parts the space of the references.
pub(super) fn by_space(mesh: &Mesh, references: &[Reference], cost: Cost<'_>) -> Option<Plane> {
    let mut best = None;
    for axis in 0..3 {
        let lower = references.iter().map(|r| r.bounds.lower[axis]).fold(f32::INFINITY, f32::min);
        let upper = references.iter().map(|r| r.bounds.upper[axis]).fold(f32::NEG_INFINITY, f32::max);
        let Some(ends) = ends(lower, upper) else { continue };
        let mut slabs = EMPTY;
        for reference in references {
            let first = slab(&ends, reference.bounds.lower[axis]);
            // What ends on a plane is not beyond it.
            let last = slab(&ends, reference.bounds.upper[axis].next_down()).max(first);
            slabs[first].begin += 1;
            slabs[last].end += 1;
            let corners = mesh.corners(reference.id);
            let mut rest = reference.bounds;
            for at in first..last {
                let [here, beyond] = parts(&corners, &rest, axis, ends[at + 1]);
                if !here.is_empty() {
                    slabs[at].bounds.grow(&here);
                }
                rest = beyond;
            }
            if !rest.is_empty() {
                slabs[last].bounds.grow(&rest);
            }
        }
        cheapest(axis, &ends, &slabs, references.len(), cost, &mut best);
    }
    best
}

/// Takes the cheapest plane between slabs that leaves something on either side and all on none.
fn cheapest(
    axis: usize,
    ends: &[f32; SLABS],
    slabs: &[Slab; SLABS],
    total: usize,
    cost: Cost<'_>,
    best: &mut Option<Plane>,
) {
    let mut right = [(0.0, 0); SLABS];
    let (mut bounds, mut count) = (Box3::EMPTY, 0);
    for (slab, right) in slabs.iter().zip(&mut right).rev() {
        bounds.grow(&slab.bounds);
        count += slab.end;
        *right = (bounds.half_area(), count);
    }
    let (mut bounds, mut left) = (Box3::EMPTY, 0);
    for at in 1..SLABS {
        bounds.grow(&slabs[at - 1].bounds);
        left += slabs[at - 1].begin;
        let (area, right) = right[at];
        if left.min(right) == 0 || left.max(right) == total {
            continue;
        }
        let cost = cost(bounds.half_area(), left) + cost(area, right);
        if best.is_none_or(|best| cost < best.cost) {
            *best = Some(Plane { axis, at: ends[at], cost });
        }
    }
}
