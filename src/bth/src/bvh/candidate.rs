//! A triangle that f32 says may be hit, and what f64 and exact arithmetic say of it later.

use crate::intersect::exact::{Estimate, Intersection, estimate, wide};
use crate::intersect::filter::TriangleBlock;
use crate::intersect::line::Line;
use crate::query::{Query, TriangleRef};
use crate::rays::Ray;
use bth_format::layout::{Child, NONE};
use bth_format::object::ObjectView;

/// A triangle that a ray may hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Candidate {
    /// Code of its leaf, or `NONE`.
    pub(crate) leaf: u32,
    /// StackPosition in the leaf.
    pub(crate) triangle: u32,
}

impl Candidate {
    /// None at all.
    pub(crate) const NONE: Candidate = Candidate { leaf: NONE, triangle: 0 };

    /// Its place, and what a reader makes of it.
    #[inline(always)]
    pub(crate) fn read<C>(
        &self,
        object: &ObjectView<'_>,
        reader: impl Reader<Output = C>,
    ) -> Option<(u32, C)> {
        let at = self.triangle as usize;
        let (mut indexed, mut raw) = (None, None);
        match Child::from_code(self.leaf)? {
            Child::Indexed(line) => {
                let leaf = object.indexed(line, &mut indexed);
                Some((leaf.first + at as u32, reader.read(leaf, at)))
            }
            Child::Raw(line) => {
                let leaf = object.raw(line, &mut raw);
                Some((leaf.first + at as u32, reader.read(leaf, at)))
            }
            Child::Node(_) | Child::Packed(_) | Child::Tets(_) => None,
        }
    }
}

/// What reads a triangle of a leaf.
pub(crate) trait Reader {
    type Output;
    fn read<B: TriangleBlock>(self, block: &B, triangle: usize) -> Self::Output;
}

/// Its corners.
struct ReadCorners;

impl Reader for ReadCorners {
    type Output = [[f32; 3]; 3];
    #[inline(always)]
    fn read<B: TriangleBlock>(self, block: &B, triangle: usize) -> [[f32; 3]; 3] {
        block.corners(triangle)
    }
}

/// Offers candidates of a ray to its query: the pending hit, then these triangles of a leaf, a bit each. True if the query has
/// what it wants. What f32 leaves open is decided here for all kinds of traversal, by f64 and where need be exactly.
#[inline(never)]
pub(crate) fn settle<Q: Query>(
    object: &ObjectView<'_>,
    ray: &Ray,
    pending: Candidate,
    (leaf, mut triangles): (u32, u32),
    query: &mut Q,
) -> bool {
    let mut candidate = pending;
    loop {
        if candidate.leaf != NONE && settle_one(object, ray, candidate, query) {
            return true;
        }
        if triangles == 0 {
            return false;
        }
        candidate = Candidate { leaf, triangle: triangles.trailing_zeros() };
        triangles &= triangles - 1;
    }
}

/// Offers a candidate of a ray to its query; true if it has what it wants then.
#[inline(always)]
pub(crate) fn settle_one<Q: Query>(
    object: &ObjectView<'_>,
    ray: &Ray,
    candidate: Candidate,
    query: &mut Q,
) -> bool {
    let Some((place, corners)) = candidate.read(object, ReadCorners) else { return false };
    let intersection = match estimate(wide(ray.origin), wide(ray.direction), corners.map(wide)) {
        Estimate::Missed => None,
        Estimate::Intersects(intersection) => Some(intersection),
        Estimate::Open(_, t) if !query.may_matter(t) => None,
        Estimate::Open(..) => open_candidate(object, ray, candidate),
    };
    intersection
        .is_some_and(|intersection| query.offer(TriangleRef::index(place, object.triangle_ids), intersection))
}

/// What f64 leaves open of a candidate. It is read again, so that what is common needs no corners in memory.
#[cold]
#[inline(never)]
fn open_candidate(object: &ObjectView<'_>, ray: &Ray, candidate: Candidate) -> Option<Intersection> {
    open(ray, candidate.read(object, ReadCorners)?.1)
}

/// What f64 leaves open.
#[cold]
#[inline(never)]
pub(crate) fn open(ray: &Ray, corners: [[f32; 3]; 3]) -> Option<Intersection> {
    Line::new(ray)?.intersection(corners)
}
