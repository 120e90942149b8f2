//! Rays that meet nothing, by what the file knows of the triangle on which they start.
//!
//! For directions in bins, a file may say that rays that leave a triangle meet nothing else, at all or within a distance (specification,
//! "Free directions"). A ray ends at once if its line certainly crosses the triangle before the ray's range begins and the bin of its
//! direction is free. All of that is proved from the ray and the triangle's corners, with bounds of all rounding errors: the caller's
//! hint only says which triangle to look at. Whatever is in doubt is traced.
//!
//! Why the range must begin behind the crossing: the file speaks of points beyond the triangle, not of the triangle itself and what
//! lies before it. Since t is rounded to f32 before it is compared with the range, the crossing must lie before `tmin` by more than
//! that.
//!
//! Only batches look directions up: for a single ray that takes as long as tracing it (docs/notes/free-directions.md).

mod crossings;
mod lanes;
mod single;
mod starts;

use single::certainly_misses;

use crate::rays::Ray;
use crate::simd::{Isa, LANES};
use bth_format::layout::{Child, FreePlace};
use bth_format::object::ObjectView;
use lanes::FreeKernel;

/// Whether the file knows of free directions of an object.
#[inline(always)]
pub(crate) fn is_known(object: &ObjectView<'_>) -> bool {
    !object.free.is_empty()
}

/// Rays that are decided before it is known whether to go on.
const PROBE: usize = 4 * LANES;
/// The least share of the rays, one in this many, that must end for the look-up to cost less than it saves.
const LEAST: usize = 6;

/// Finds the rays in object space that may meet something, and stores their indices in `rest`. `from` holds for each ray the triangle
/// on which it starts, or `NONE`. False if so few rays would end that all of them are to be traced, unless the look-up is `forced`.
pub(crate) fn find_rest(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: &[u32],
    forced: bool,
    rest: &mut Vec<u32>,
) -> bool {
    rest.clear();
    if forced {
        decide(object, rays, from, 0..rays.len(), rest);
        return true;
    }
    let probe = PROBE.min(rays.len());
    decide(object, rays, from, 0..probe, rest);
    if (probe - rest.len()) * LEAST < probe {
        return false;
    }
    decide(object, rays, from, probe..rays.len(), rest);
    (rays.len() - rest.len()) * LEAST >= rays.len()
}

/// Appends to `rest` the indices of the rays of a range that may meet something.
fn decide(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: &[u32],
    range: std::ops::Range<usize>,
    rest: &mut Vec<u32>,
) {
    let kernel = FreeKernel { object, rays, from, range, rest };
    // `run_wide` returns the kernel in scalar code.
    if let Err(FreeKernel { range, rest, .. }) = Isa::chosen().run_wide(kernel) {
        let may_hit = |ray: &usize| !certainly_misses(object, &rays[*ray], from[*ray]);
        rest.extend(range.filter(may_hit).map(|ray| ray as u32));
    }
}

/// The corners of the triangle at a place.
#[inline(always)]
fn corners_at(object: &ObjectView<'_>, place: u32) -> Option<[[f32; 3]; 3]> {
    let FreePlace { leaf, slot } = FreePlace::from_code(place)?;
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
