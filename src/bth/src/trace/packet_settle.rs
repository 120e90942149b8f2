//! Candidates of a packet's rays, as f64 and exact arithmetic see them.

use super::crossing::{Crossing, Estimate, Weighed, estimate, weigh};
use super::flight::open;
use super::query::Query;
use super::sight::Block;
use crate::layout::{Child, NONE};
use crate::object::ObjectView;
use crate::rays::Ray;
use crate::simd::LANES;

/// A triangle that a ray may hit.
#[derive(Clone, Copy, Debug)]
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
    /// Its id, and its corners, through `corners`.
    #[inline(always)]
    fn read<C>(&self, object: &ObjectView<'_>, corners: impl Corners<Output = C>) -> Option<(u32, C)> {
        let at = self.triangle as usize;
        match Child::from_code(self.leaf)? {
            Child::Indexed(line) => {
                let leaf = object.indexed_leaf(line);
                Some((object.triangle_ids[leaf.first as usize + at], corners.of(leaf, at)))
            }
            Child::Raw(line) => {
                let leaf = object.raw_leaf(line);
                Some((object.triangle_ids[leaf.first as usize + at], corners.of(leaf, at)))
            }
            Child::Node(_) | Child::Tets(_) => None,
        }
    }

    /// What f64 left open.
    #[cold]
    #[inline(never)]
    fn open(&self, object: &ObjectView<'_>, ray: &Ray) -> Option<Crossing> {
        open(ray, self.read(object, AsStored)?.1)
    }
}

/// A way to read the corners of a triangle.
trait Corners {
    type Output;
    fn of<B: Block>(&self, block: &B, triangle: usize) -> Self::Output;
}

/// Along these axes.
struct Along([u32; 3]);

impl Corners for Along {
    type Output = [[f64; 3]; 3];
    #[inline(always)]
    fn of<B: Block>(&self, block: &B, triangle: usize) -> [[f64; 3]; 3] {
        block.corners_along(self.0, triangle)
    }
}

/// As they are.
struct AsStored;

impl Corners for AsStored {
    type Output = [[f32; 3]; 3];
    fn of<B: Block>(&self, block: &B, triangle: usize) -> [[f32; 3]; 3] {
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
        let Some((id, corners)) = candidate.read(object, Along(axis)) else { continue };
        let crossing = match estimate(origin, direction, corners) {
            Estimate::Missed => None,
            Estimate::Crossed(crossing) => Some(crossing),
            Estimate::Open(_, _, t) if !query.cares(t) => None,
            Estimate::Open(..) => candidate.open(object, ray),
        };
        if crossing.is_some_and(|crossing| query.offer(id, crossing)) {
            return Settled::Enough;
        }
    }
    let limit = query.limit();
    // As far below as the limit lies above.
    query.found().map_or(Settled::Nothing, |t| Settled::Found([2.0 * t - limit, limit]))
}

/// A group of sixteen rays, of which each has at most one candidate that is certainly its nearest hit.
pub(crate) struct Last<'a> {
    pub(crate) object: &'a ObjectView<'a>,
    pub(crate) rays: &'a [Ray],
    /// The axes of the projection, leaves and triangles of all lanes.
    pub(crate) axis: [[u32; LANES]; 3],
    pub(crate) leaf: [u32; LANES],
    pub(crate) triangle: [u32; LANES],
}

/// Sixteen of a number.
type Many = [f64; LANES];

impl Last<'_> {
    /// Computes the crossings, all at once, and hands on lane, id and crossing.
    #[inline(always)]
    pub(crate) fn compute(&self, mut found: impl FnMut(usize, u32, Crossing)) {
        let (mut id, mut origin, mut direction) = ([NONE; LANES], [[0.0; LANES]; 3], [[1.0; LANES]; 3]);
        let mut corner = [[[0.0; LANES]; 3]; 3];
        let mut lanes = 0u32;
        for lane in 0..self.rays.len().min(LANES) {
            let axis = [self.axis[0][lane], self.axis[1][lane], self.axis[2][lane]];
            let candidate = Candidate { leaf: self.leaf[lane], triangle: self.triangle[lane] };
            let Some((triangle, corners)) = candidate.read(self.object, Along(axis)) else { continue };
            let [o, d] = along(&self.rays[lane], axis);
            id[lane] = triangle;
            for k in 0..3 {
                (origin[k][lane], direction[k][lane]) = (o[k], d[k]);
                for c in 0..3 {
                    corner[c][k][lane] = corners[c][k];
                }
            }
            lanes |= 1 << lane;
        }
        if lanes == 0 {
            return;
        }
        let all = weigh_many(&origin, &direction, &corner);
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize % LANES;
            lanes &= lanes - 1;
            let weighed = Weighed {
                weight: [all[0][lane], all[1][lane], all[2][lane]],
                bound: all[3][lane],
                range: all[4][lane],
                depth: all[5][lane],
                inverse_depth: 1.0 / direction[2][lane],
                t: all[6][lane],
            };
            let crossing = match weighed.judge() {
                Estimate::Missed => None,
                Estimate::Crossed(crossing) => Some(crossing),
                Estimate::Open(..) => {
                    let candidate = Candidate { leaf: self.leaf[lane], triangle: self.triangle[lane] };
                    candidate.open(self.object, &self.rays[lane])
                }
            };
            if let Some(crossing) = crossing {
                found(lane, id[lane], crossing);
            }
        }
    }
}

/// [`weigh`] for sixteen: the fields of [`Weighed`] in their order.
#[inline(always)]
fn weigh_many(origin: &[Many; 3], direction: &[Many; 3], corner: &[[Many; 3]; 3]) -> [Many; 7] {
    let mut out = [[0.0; LANES]; 7];
    for i in 0..LANES {
        let (mut o, mut d, mut v) = ([0.0; 3], [0.0; 3], [[0.0; 3]; 3]);
        for k in 0..3 {
            (o[k], d[k]) = (origin[k][i], direction[k][i]);
            for c in 0..3 {
                v[c][k] = corner[c][k][i];
            }
        }
        let weighed = weigh(o, d, v);
        for c in 0..3 {
            out[c][i] = weighed.weight[c];
        }
        (out[3][i], out[4][i]) = (weighed.bound, weighed.range);
        (out[5][i], out[6][i]) = (weighed.depth, weighed.t);
    }
    out
}
