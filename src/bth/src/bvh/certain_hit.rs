//! The answer of a single ray whose nearest hit is certain: t, u and v in f64, as
//! [`super::deferred`] computes them for sixteen rays.

use super::candidate::{Candidate, Settle};
use crate::intersect::exact::{reported, reported_barycentric};
use crate::intersect::exact_quad::rounded_intersection;
use crate::intersect::exact_ray::{ExactRay, LineSource};
use crate::intersect::filter::TriangleBlock;
use crate::intersect::vector::max_norm;
use crate::query::{Goal, RayQuery};
use crate::rays::{Hit, PrimitiveRef};
use crate::simd::Simd;
use bth_format::layout::NONE;
use bth_format::object::ObjectView;

/// The nearest hit of a ray, whose t, u and v are not yet computed: the filter is sure that it lies
/// in the range and before all others.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CertainHit {
    pub(crate) candidate: Candidate,
    /// The largest |component| of the ray's direction.
    pub(crate) norm: f32,
}

/// Stores the answer of a ray with a certain hit. `instance` is reported with it.
#[inline(always)]
pub(crate) fn store_certain_hit<S: Simd, G: Goal>(
    s: S,
    object: &ObjectView<'_>,
    exact_ray: ExactRay<'_>,
    CertainHit { candidate, norm }: CertainHit,
    goal: G,
    instance: u32,
    hit: &mut Hit,
) {
    if let Some(leaf) = object.node_base().indexed_leaf(candidate.leaf) {
        let (corners, ExactRay { ray, line, .. }) = (leaf.corners(candidate.triangle as usize), exact_ray);
        let rounded = match line {
            LineSource::Ray => rounded_intersection(s.doubles(), (ray.origin, ray.direction), corners, norm),
            LineSource::Start(start) => {
                rounded_intersection(s.doubles(), (start.origin, ray.direction), corners, norm)
            }
            LineSource::World(lines, ray) => {
                let line = lines.line(ray);
                let of_line = (line, line.direction);
                let exact = if object.exact.is_empty() {
                    None
                } else {
                    let place = leaf.first.wrapping_add(candidate.triangle);
                    object.exact.corners(object.triangle_ids[place as usize])
                };
                match exact {
                    None => rounded_intersection(s.doubles(), of_line, corners, max_norm(line.direction)),
                    Some(corners) => {
                        rounded_intersection(s.doubles(), of_line, corners, max_norm(line.direction))
                    }
                }
            }
        };
        if rounded.is_accurate {
            let index = leaf.first.wrapping_add(candidate.triangle);
            let primitive = PrimitiveRef { instance, triangle: object.triangle_ids[index as usize] };
            let [second, third, _] = rounded.weight;
            let [u, v] = [second, third].map(|w| reported_barycentric(w * rounded.inverse));
            *hit = Hit { t: reported(rounded.t), u, v, primitive };
            return;
        }
    }
    // Leaves of other formats, and where f64 leaves t, u or v inaccurate.
    let mut query = RayQuery::new(goal, exact_ray.ray);
    let (pending, of_leaf) = (candidate, (NONE, 0));
    s.call(Settle { object, ray: exact_ray, pending, of_leaf, query: &mut query });
    *hit = query.answer(object.triangle_ids, instance);
}
