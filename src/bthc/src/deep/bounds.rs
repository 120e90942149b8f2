//! What a file knows of the direction of a ray that starts at a corner of a triangle.

use super::rays::Start;
use bth_format::layout::{KnownFree, free_axes, free_bin};
use bth_format::object::ObjectView;

/// Distance up to which nothing is hit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bound {
    /// Distance, in units of the object; infinite in a free direction.
    pub(super) distance: f64,
    /// Length of the ray's direction.
    length: f64,
}

/// Bounds the relative roundings of a file's distance and of a length, a hundredfold.
const ROUNDING: f64 = 1e-9;

impl Bound {
    /// Returns true if a hit contradicts it. The distance of a file and the length are rounded, by
    /// far less than this.
    pub(super) fn is_broken(&self, t: f64) -> bool {
        t * self.length < self.distance * (1.0 - ROUNDING)
    }
}

/// What is known of a ray's direction, if it starts exactly at a corner.
pub(super) fn known(view: &ObjectView<'_>, start: &Start) -> Option<Bound> {
    if !start.is_at_corner || !view.has_free_directions() {
        return None;
    }
    let known = view.known_free(start.triangle.id as usize)?;
    let axes = free_axes(start.triangle.corners)?;
    let direction = start.ray.direction.map(f64::from);
    let (bin, is_back) = free_bin(&axes, direction)?;
    let KnownFree { sectors, bins, .. } = known;
    let levels = view.free_levels.first().copied().unwrap_or_default();
    let distance = if bins.is_free(bin) && bins.is_back() == is_back {
        f64::INFINITY
    } else {
        f64::from(levels.within(sectors[usize::from(is_back)].level_of_bin(bin)))
    };
    let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
    (distance > 0.0).then_some(Bound { distance, length })
}
