//! Candidates: triangles that the f32 filter does not exclude, and their decision in f64 or in
//! exact arithmetic.

use super::nodes;
use crate::intersect::exact::{Estimate, Intersection, estimate, in_pairs};
use crate::intersect::exact_ray::{ExactRay, LineSource, intersect_in_world};
use crate::intersect::line::Line;
use crate::intersect::start::{StartDecision, decide_start, decide_start_exactly, start_on};
use crate::intersect::vector::wide;
use crate::query::double::offer_in_world;
use crate::query::{Goal, RayQuery, TriangleRef};
use crate::rays::Ray;
use crate::simd::{Part, Simd};
use bth_format::layout::NONE;
use bth_format::object::ObjectView;

/// A triangle that a ray may hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Candidate {
    /// Child code of the triangle's leaf; `NONE` for no candidate.
    pub(crate) leaf: u32,
    /// Index of the triangle in its leaf.
    pub(crate) triangle: u32,
}

impl Candidate {
    /// No candidate.
    pub(crate) const NONE: Candidate = Candidate { leaf: NONE, triangle: 0 };

    /// The triangle's index in the object's leaf order, and its corners. `None` without a
    /// candidate.
    #[inline(always)]
    pub(crate) fn read(&self, object: &ObjectView<'_>) -> Option<(u32, [[f32; 3]; 3])> {
        nodes::triangle(object, self.leaf, self.triangle)
    }
}

/// Offers candidates of a ray to its query: the pending hit, then the triangles of the leaf with
/// child code `leaf` whose bit is set in `triangles`. Its output is whether the query is complete.
/// All traversals decide here, in f64 and where that is uncertain exactly, what the f32 filter
/// leaves open.
pub(crate) struct Settle<'a, G> {
    pub(crate) object: &'a ObjectView<'a>,
    pub(crate) ray: ExactRay<'a>,
    pub(crate) pending: Candidate,
    /// `leaf` and `triangles`.
    pub(crate) of_leaf: (u32, u32),
    pub(crate) query: &'a mut RayQuery<G>,
}

impl<S: Simd, G: Goal> Part<S> for Settle<'_, G> {
    type Output = bool;
    #[inline(always)]
    fn run(self, s: S) -> bool {
        let Settle { object, ray, pending, of_leaf: (leaf, mut triangles), query } = self;
        let mut candidate = pending;
        loop {
            if candidate.leaf != NONE {
                let is_complete = match ray.line {
                    LineSource::Ray => settle_one(s, object, ray.ray, candidate, query),
                    _ => settle_other(object, ray, candidate, query),
                };
                if is_complete {
                    return true;
                }
            }
            if triangles == 0 {
                return false;
            }
            candidate = Candidate { leaf, triangle: triangles.trailing_zeros() };
            triangles &= triangles - 1;
        }
    }
}

/// Offers a candidate of a ray to its query; returns whether the query is complete.
#[inline(always)]
fn settle_one<S: Simd, G: Goal>(
    s: S,
    object: &ObjectView<'_>,
    ray: &Ray,
    candidate: Candidate,
    query: &mut RayQuery<G>,
) -> bool {
    let Some((index, corners)) = candidate.read(object) else { return false };
    let mut wide_corners = [[0.0; 3]; 3];
    for c in 0..3 {
        for k in 0..3 {
            wide_corners[c][k] = f64::from(corners[c][k]);
        }
    }
    let intersection = match estimate(wide(ray.origin), wide(ray.direction), wide_corners) {
        Estimate::Missed => None,
        Estimate::Intersects(intersection) => Some(intersection),
        Estimate::Open(_, t) if !query.may_matter(t) => None,
        Estimate::Open(uncertain, _) => match in_pairs(s.doubles(), ray.origin, corners, &uncertain) {
            Some(intersection) => Some(intersection),
            None => intersect_candidate_exactly(object, ray, candidate),
        },
    };
    intersection
        .is_some_and(|intersection| query.offer(TriangleRef::index(index, object.triangle_ids), intersection))
}

/// Like [`settle_one`], for a ray whose line f32 does not hold.
#[inline(never)]
fn settle_other<G: Goal>(
    object: &ObjectView<'_>,
    ray: ExactRay<'_>,
    candidate: Candidate,
    query: &mut RayQuery<G>,
) -> bool {
    let Some((index, corners)) = candidate.read(object) else { return false };
    let triangle = TriangleRef::index(index, object.triangle_ids);
    let found = intersect(object, ray, (triangle, corners), |t| query.may_matter(t));
    let Some(found) = found else { return false };
    match ray.line {
        LineSource::World(lines, at) => {
            offer_in_world(object, (lines, at), (triangle, corners), found, query)
        }
        _ => query.offer(triangle, found),
    }
}

/// The intersection of a ray with a triangle of its object, if it counts. `may_matter` as for
/// [`intersect_in_world`].
pub(crate) fn intersect(
    object: &ObjectView<'_>,
    ExactRay { ray, line, .. }: ExactRay<'_>,
    (triangle, corners): (TriangleRef<'_>, [[f32; 3]; 3]),
    may_matter: impl FnOnce([f64; 2]) -> bool,
) -> Option<Intersection> {
    match line {
        LineSource::Ray => match estimate(wide(ray.origin), wide(ray.direction), corners.map(wide)) {
            Estimate::Missed => None,
            Estimate::Intersects(intersection) => Some(intersection),
            Estimate::Open(_, t) if !may_matter(t) => None,
            Estimate::Open(..) => intersect_exactly(ray, corners),
        },
        LineSource::Start(start) => {
            match decide_start(start.origin, wide(ray.direction), corners.map(wide)) {
                StartDecision::Certain(found) => found,
                StartDecision::Open(_, t) if !may_matter(t) => None,
                StartDecision::Open(uncertain, _) => start_on(object, start)
                    .and_then(|start| decide_start_exactly(&start, wide(ray.direction), corners, &uncertain)),
            }
        }
        LineSource::World(lines, ray) => {
            intersect_in_world((lines, ray), object.exact_corners(|| triangle.read(), corners), may_matter)
        }
    }
}

/// Decides exactly a candidate that f64 leaves open. Its corners are read again, so that the common
/// path keeps them in registers.
#[cold]
#[inline(never)]
fn intersect_candidate_exactly(
    object: &ObjectView<'_>,
    ray: &Ray,
    candidate: Candidate,
) -> Option<Intersection> {
    intersect_exactly(ray, candidate.read(object)?.1)
}

/// Decides exactly whether and where the ray's line hits a triangle.
#[cold]
#[inline(never)]
pub(crate) fn intersect_exactly(ray: &Ray, corners: [[f32; 3]; 3]) -> Option<Intersection> {
    Line::new(ray)?.intersection(corners)
}
