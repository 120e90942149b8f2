//! What rays in f64 do to their queries: t is compared exactly where f32 or f64 cannot tell.

use super::{Goal, RayQuery, TriangleRef};
use crate::intersect::exact::Intersection;
use crate::intersect::exact_line::ExactT;
use crate::intersect::exact_ray::WorldLines;
use crate::intersect::line::RATIO_ERROR;
use crate::intersect::start::corners_by_id;
use crate::rays::Hit;
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
    let corners = || object.exact_corners(|| triangle.read(), corners);
    let exact_t = || Some(lines.exact(at).intersection(corners())?.t);
    let close = |a: f64, b: f64| b.is_finite() && (a - b).abs() <= 4.0 * RATIO_ERROR * a.abs().max(b.abs());
    // Where t is 0, it is so exactly.
    if found.t != 0.0 && (close(found.t, tmin) || close(found.t, tmax)) {
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

/// Bounds the difference of two t that are rounded to f32 and may be equal before, relative to
/// them: two roundings of half an epsilon each, twice.
const ROUNDED_T: f32 = 2.0 * f32::EPSILON;

/// Like [`super::better`], for a ray in f64. `exact_t` returns the t of a hit: hits whose t
/// may be equal before they are rounded are compared exactly.
#[cold]
pub(crate) fn better_wide(
    best: &Hit,
    hit: &Hit,
    t_scale: f32,
    exact_t: impl Fn(&Hit) -> Option<ExactT>,
) -> Option<Hit> {
    if !hit.is_hit() {
        return None;
    }
    let hit = Hit { t: hit.t * t_scale, ..*hit };
    let is_close = best.is_hit() && (hit.t - best.t).abs() <= ROUNDED_T * hit.t.abs();
    let exact = is_close.then(|| exact_t(&hit).zip(exact_t(best))).flatten();
    let order = exact.map_or(hit.t.total_cmp(&best.t), |(t, of_best)| t.cmp(&of_best));
    (order.then(hit.primitive.instance.cmp(&best.primitive.instance)) == Ordering::Less).then_some(hit)
}
