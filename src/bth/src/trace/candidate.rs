//! A triangle that f32 says may be hit, and what f64 and exact arithmetic say of it later.

use crate::layout::{Child, NONE};
use crate::object::ObjectView;
use crate::rays::Ray;
use crate::trace::crossing::{Crossing, Estimate, estimate};
use crate::trace::line::Line;
use crate::trace::query::{Named, Query};
use crate::trace::sight::Block;

/// A triangle that a ray may hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Candidate {
    /// Code of its leaf, or `NONE`.
    pub(crate) leaf: u32,
    /// Place in the leaf.
    pub(crate) triangle: u32,
}

/// What became of a ray.
pub(crate) enum Settled {
    Nothing,
    /// The nearest hit so far lies between these t.
    Found([f64; 2]),
    /// The query has what it wants.
    Enough,
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

    /// What f64 left open.
    #[cold]
    #[inline(never)]
    fn open(&self, object: &ObjectView<'_>, ray: &Ray) -> Option<Crossing> {
        open(ray, self.read(object, AsStored)?.1)
    }
}

/// What reads a triangle of a leaf.
pub(crate) trait Reader {
    type Output;
    fn read<B: Block>(self, block: &B, triangle: usize) -> Self::Output;
}

/// Its corners, along these axes.
struct Along([u32; 3]);

impl Reader for Along {
    type Output = [[f64; 3]; 3];
    #[inline(always)]
    fn read<B: Block>(self, block: &B, triangle: usize) -> [[f64; 3]; 3] {
        block.corners_along(self.0, triangle)
    }
}

/// Its corners as they are.
struct AsStored;

impl Reader for AsStored {
    type Output = [[f32; 3]; 3];
    fn read<B: Block>(self, block: &B, triangle: usize) -> [[f32; 3]; 3] {
        block.corners(triangle)
    }
}

/// Origin and direction along these axes.
#[inline(always)]
fn along(ray: &Ray, axis: [u32; 3]) -> [[f64; 3]; 2] {
    let mut out = [[0.0; 3]; 2];
    for k in 0..3 {
        out[0][k] = ray.origin[axis[k] as usize % 3].into();
        out[1][k] = ray.direction[axis[k] as usize % 3].into();
    }
    out
}

/// Offers candidates of a ray to its query, and tells how far the nearest hit is now.
#[inline(never)]
pub(crate) fn settle<Q: Query>(
    object: &ObjectView<'_>,
    ray: &Ray,
    axis: [u32; 3],
    candidates: [Candidate; 2],
    query: &mut Q,
) -> Settled {
    let [origin, direction] = along(ray, axis);
    for candidate in candidates {
        let Some((place, corners)) = candidate.read(object, Along(axis)) else { continue };
        let crossing = match estimate(origin, direction, corners) {
            Estimate::Missed => None,
            Estimate::Crossed(crossing) => Some(crossing),
            Estimate::Open(_, _, t) if !query.cares(t) => None,
            Estimate::Open(..) => candidate.open(object, ray),
        };
        if crossing.is_some_and(|crossing| query.offer(Named::place(place, object.triangle_ids), crossing)) {
            return Settled::Enough;
        }
    }
    let limit = query.limit();
    // As far below as the limit lies above.
    query.found().map_or(Settled::Nothing, |t| Settled::Found([2.0 * t - limit, limit]))
}

/// What f64 leaves open.
#[cold]
#[inline(never)]
pub(crate) fn open(ray: &Ray, corners: [[f32; 3]; 3]) -> Option<Crossing> {
    Line::new(ray)?.crossing(corners)
}
