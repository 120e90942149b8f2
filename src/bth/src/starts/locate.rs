//! Where the triangle of a start lies in its object, and the start in f64.

use crate::intersect::start::{are_weights, place, rounded_start, start_corners};
use crate::intersect::start_point::StartPoint;
use crate::rays::{PrimitiveRef, Start};
use crate::simd::Simd;
use bth_format::exact::is_zero_area;
use bth_format::layout::TrianglePlace;
use bth_format::object::ObjectView;

/// Why a start is not a point of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum StartError {
    /// No leaf of the object holds the triangle: it does not exist, or it has no area and was
    /// dropped.
    NoTriangle,
    /// The triangle has no area.
    NoArea,
    /// The weights do not describe a point of the triangle.
    Weights,
}

/// Finds a start on a triangle of an object. The instance is not looked at.
#[inline(always)]
pub(crate) fn locate(object: &ObjectView<'_>, start: Start) -> Result<StartPoint, StartError> {
    let Start { primitive: PrimitiveRef { triangle, .. }, u, v } = start;
    let (leaf, slot) = place(object, triangle).ok_or(StartError::NoTriangle)?;
    let corners = start_corners(object, leaf, slot).ok_or(StartError::NoTriangle)?;
    if object.is_deformable() && is_zero_area(corners) {
        return Err(StartError::NoArea);
    }
    if !are_weights([u, v]) {
        return Err(StartError::Weights);
    }
    let corners = object.exact_corners(|| triangle, corners);
    let origin = rounded_start(corners, [u.into(), v.into()]);
    Ok(StartPoint { origin, leaf, slot, u, v })
}

/// Prefetches the lines of the leaf of a triangle that [`locate`] reads one after the other.
#[inline(always)]
pub(crate) fn prefetch_leaf<S: Simd>(s: S, object: &ObjectView<'_>, triangle: u32) {
    let Some(place) = object.places.get(triangle as usize) else { return };
    let leaf = object.lines.as_ptr().wrapping_add((place >> 4 & TrianglePlace::INDEX_LIMIT) as usize);
    for line in 0..4 {
        s.prefetch(leaf.wrapping_add(line));
    }
}
