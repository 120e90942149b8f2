//! What rays certainly do not meet, by what the file knows of the triangle on which they start.
//!
//! For directions in bins, a file may say that rays that leave a triangle meet nothing else, at all or within a distance (specification,
//! "Free directions"). If the line of a ray certainly crosses the triangle before the ray's range begins, and the bin of its direction
//! is free, the ray ends at once; else its range can begin at that distance from the crossing. No hit is lost, so no answer changes,
//! but traversals leave out all boxes that lie before the range: much of what a ray passes lies around its start. All of that is
//! proved from the ray and the triangle's corners, with bounds of all rounding errors: the caller's hint only says which triangle to
//! look at. Whatever is in doubt is traced as it is.
//!
//! Why the range must begin behind the crossing: the file speaks of points beyond the triangle, not of the triangle itself and what
//! lies before it. Since t is rounded to f32 before it is compared with the range, the crossing must lie before `tmin` by more than
//! that, and what is met must lie behind a later beginning by more than that.
//!
//! Only batches look directions up: for a single ray that takes as long as tracing it (docs/notes/free-directions.md).

#[cfg(test)]
mod crossing_tests;
mod crossings;
mod lanes;
mod single;
mod starts;

use crate::rays::Ray;
use crate::simd::{Isa, LANES};
use bth_format::layout::{Child, TrianglePlace};
use bth_format::object::ObjectView;
use lanes::FreeKernel;
use starts::Row;
use std::ops::Range;

/// Whether the file knows of free directions of an object.
#[inline(always)]
pub(crate) fn is_known(object: &ObjectView<'_>) -> bool {
    object.has_free_directions()
}

/// Rays that are decided before it is known whether to go on.
const PROBE: usize = 4 * LANES;
/// The least share of the rays, one in this many, that must end for the look-up to cost less than it saves.
const LEAST: usize = 6;
/// So many rays that begin later save as much as one that ends.
const LATER: usize = 3;

/// The rays of a batch that may meet something.
#[derive(Debug, Default)]
pub(crate) struct Rest {
    /// Their indices, ascending.
    pub(crate) order: Vec<u32>,
    /// Copies of all rays of the batch, whose ranges begin later where nothing is hit before. Those that have ended hit nothing, either.
    pub(crate) rays: Vec<Ray>,
}

/// Finds the rays in object space that may meet something, and from where on. `from` holds for each ray the triangle on which it starts,
/// or `NONE`. False if so little would be saved that all of them are to be traced as they are, unless the look-up is `forced`.
pub(crate) fn find_rest(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: &[u32],
    forced: bool,
    rest: &mut Rest,
) -> bool {
    rest.order.clear();
    // What was there before is overwritten.
    rest.rays.resize(rays.len(), Ray::new([0.0; 3], [0.0; 3]));
    let saves =
        |rays: usize, rest: usize, later: usize| (LATER * (rays - rest) + later) * LEAST >= LATER * rays;
    let (probe, mut later) = (if forced { 0 } else { PROBE.min(rays.len()) }, 0);
    if probe > 0 {
        later = decide(object, rays, from, 0..probe, rest);
        if !saves(probe, rest.order.len(), later) {
            return false;
        }
    }
    later += decide(object, rays, from, probe..rays.len(), rest);
    forced || saves(rays.len(), rest.order.len(), later)
}

/// Decides the rays of a range. Returns the number of those that may meet something, but only later than at `tmin`.
fn decide(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: &[u32],
    range: Range<usize>,
    rest: &mut Rest,
) -> usize {
    if object.free.is_empty() {
        decide_by(object, object.free_distances, (rays, from), range, rest)
    } else {
        decide_by(object, object.free, (rays, from), range, rest)
    }
}

/// As [`decide`], by the rows of a section.
fn decide_by<R: Row>(
    object: &ObjectView<'_>,
    rows: &[R],
    (rays, from): (&[Ray], &[u32]),
    range: Range<usize>,
    rest: &mut Rest,
) -> usize {
    let (later, rest) = (&mut rest.rays[..], &mut rest.order);
    // The last rays that are less than a group are copied as they are.
    let groups_end = range.start + range.len() / LANES * LANES;
    later[groups_end..range.end].copy_from_slice(&rays[groups_end..range.end]);
    let kernel = FreeKernel { object, rows, rays, from, range, rest, later };
    // `run_wide` returns the kernel in scalar code.
    match Isa::chosen().run_wide(kernel) {
        Ok(count) => count,
        Err(FreeKernel { range, rest, later, .. }) => one_by_one(object, (rays, from), range, rest, later),
    }
}

/// As [`decide`], one ray after the other.
fn one_by_one(
    object: &ObjectView<'_>,
    (rays, from): (&[Ray], &[u32]),
    range: Range<usize>,
    rest: &mut Vec<u32>,
    later: &mut [Ray],
) -> usize {
    let mut count = 0;
    for index in range {
        let ray = rays[index];
        let begin = single::begin(object, &ray, from[index]);
        let may_hit = !(begin == f32::INFINITY || ray.tmax < begin);
        if may_hit {
            rest.push(index as u32);
            count += usize::from(begin > ray.tmin);
        }
        later[index] = Ray { tmin: if begin == f32::INFINITY { ray.tmin } else { begin }, ..ray };
    }
    count
}

/// The corners of the triangle at the place with a code.
#[inline(always)]
fn corners_at(object: &ObjectView<'_>, place: u32) -> Option<[[f32; 3]; 3]> {
    let TrianglePlace { leaf, slot } = TrianglePlace::from_code(place)?;
    let slot = slot as usize;
    if object.grid.is_some() {
        return corners_on_grid(object, leaf, slot);
    }
    match leaf {
        Child::Indexed(index) => {
            let leaf = object.indexed_leaf(index);
            let corner = |k: usize| usize::from(leaf.corner[k][slot]) % LANES;
            let corners = [corner(0), corner(1), corner(2)];
            Some(corners.map(|vertex| [0, 1, 2].map(|axis| leaf.vertex[axis][vertex])))
        }
        Child::Raw(index) => {
            let leaf = object.raw_leaf(index);
            Some([0, 1, 2].map(|corner| [0, 1, 2].map(|axis| leaf.corner[corner][axis][slot])))
        }
        Child::Node(_) | Child::Packed(_) | Child::Tets(_) => None,
    }
}

/// As [`corners_at`], for an object on a grid.
#[cold]
#[inline(never)]
fn corners_on_grid(object: &ObjectView<'_>, leaf: Child, slot: usize) -> Option<[[f32; 3]; 3]> {
    let (mut indexed, mut raw) = (None, None);
    match leaf {
        Child::Indexed(index) => {
            let leaf = object.indexed(index, &mut indexed);
            Some([0, 1, 2].map(|corner| {
                let vertex = usize::from(leaf.corner[corner][slot]) % LANES;
                [0, 1, 2].map(|axis| leaf.vertex[axis][vertex])
            }))
        }
        Child::Raw(index) => {
            let leaf = object.raw(index, &mut raw);
            Some([0, 1, 2].map(|corner| [0, 1, 2].map(|axis| leaf.corner[corner][axis][slot])))
        }
        Child::Node(_) | Child::Packed(_) | Child::Tets(_) => None,
    }
}

#[cfg(test)]
mod tests;
