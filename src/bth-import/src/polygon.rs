//! How polygons become triangles: fans and their areas.

use glam::DVec3;
use serde::Serialize;

/// How polygons of more than three corners become triangles. There are two triangles fewer than
/// corners either way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Polygons {
    /// Fans from the first corner, which cover more than the polygon where it is concave.
    #[default]
    Fans,
    /// Fans where these cover nothing twice, and otherwise ears that are clipped one after the
    /// other, which cover the polygon exactly.
    Ears,
}

/// The vector of a polygon's area, times two.
pub(super) fn area_vector<T: Into<f64> + Copy>(corners: &[[T; 3]]) -> DVec3 {
    fan_areas(corners.iter().map(|p| DVec3::from_array(p.map(T::into)))).sum()
}

/// The vectors of the areas of the triangles of a fan from the first corner, times two.
pub(super) fn fan_areas(mut corners: impl Iterator<Item = DVec3>) -> impl Iterator<Item = DVec3> {
    let first = corners.next().unwrap_or_default();
    let mut before = corners.next().unwrap_or_default() - first;
    corners.map(move |corner| {
        let side = std::mem::replace(&mut before, corner - first);
        side.cross(before)
    })
}

/// Appends the fan of a polygon around its first corner: the triangles (0, k-1, k) for k from 2.
#[inline]
pub(super) fn fan(triangles: &mut Vec<[u32; 3]>, face: &[u32]) {
    if let [first, rest @ ..] = face {
        triangles.extend(rest.windows(2).map(|pair| [*first, pair[0], pair[1]]));
    }
}
