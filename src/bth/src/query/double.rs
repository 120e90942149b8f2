//! What rays in f64 do to their queries: t is compared exactly where f32 or f64 cannot tell.

use super::{Goal, RayQuery, TriangleRef};
use crate::intersect::exact::Intersection;
use crate::intersect::exact_ray::WorldLines;
use crate::intersect::line::RATIO_ERROR;
use crate::intersect::start::corners_by_id;
use bth_format::object::ObjectView;
use std::cmp::Ordering;

/// Offers an intersection of a line in world space to the query of its ray. Returns true if the
/// query is complete.
pub(crate) fn offer_in_world<G: Goal>(
    object: &ObjectView<'_>,
    (lines, at): (&dyn WorldLines, usize),
    (triangle, corners): (TriangleRef<'_>, [[f32; 3]; 3]),
    found: Intersection,
    query: &mut RayQuery<G>,
) -> bool {
    match lines.range(at) {
        Some(range) => offer_wide(object, (lines, at), range, (triangle, corners), found, query),
        None => query.offer(triangle, found),
    }
}

/// Offers an intersection of a ray in f64. Its t is exact before it is compared with an end of the
/// range or with another t that is close to it; among equal t, the smaller id wins.
fn offer_wide<G: Goal>(
    object: &ObjectView<'_>,
    (lines, at): (&dyn WorldLines, usize),
    [tmin, tmax]: [f64; 2],
    (triangle, corners): (TriangleRef<'_>, [[f32; 3]; 3]),
    mut found: Intersection,
    query: &mut RayQuery<G>,
) -> bool {
    let corners = || object.exact_corners(triangle.read(), corners);
    let exact_t = || Some(lines.exact(at).intersection(corners())?.t);
    let close = |a: f64, b: f64| b.is_finite() && (a - b).abs() <= 4.0 * RATIO_ERROR * a.abs().max(b.abs());
    if close(found.t, tmin) || close(found.t, tmax) {
        found.t = exact_t().unwrap_or(found.t);
    }
    if !(tmin <= found.t && found.t <= tmax) {
        return false;
    }
    if let Some((best, t)) = query.best(object.triangle_ids)
        && close(t, found.t)
        && let Some(of_best) = corners_by_id(object, best)
    {
        let line = lines.exact(at);
        let order = line.exact_t(corners()).zip(line.exact_t(of_best));
        let order = order.map_or(Ordering::Equal, |(t, of_best)| t.cmp(&of_best));
        if order.then(triangle.read().cmp(&best)) == Ordering::Less {
            query.replace(triangle, found);
        }
        return false;
    }
    query.offer(triangle, found)
}
