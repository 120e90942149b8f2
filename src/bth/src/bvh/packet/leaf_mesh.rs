//! Leaves of both record formats as points and triangles between them.

use super::bounds::PacketBounds;
use super::points::{POINTS, RelativePoints};
use crate::intersect::filter::TriangleBlock;
use crate::intersect::vector::load3;
use crate::simd::{Part, Simd};
use bth_format::layout::{IndexedLeaf, RawLeaf, WIDTH};
use std::slice;

/// The corners of the triangles of a [`RawLeaf`], where triangles share no points.
static OWN_POINTS: [[u8; WIDTH]; 3] = {
    let mut corner = [[0; WIDTH]; 3];
    let mut point = 0;
    while point < 3 * WIDTH {
        corner[point / WIDTH][point % WIDTH] = point as u8;
        point += 1;
    }
    corner
};

/// A leaf as points and triangles between them, so that what tests triangles is compiled once for
/// both formats.
#[derive(Clone, Copy)]
pub(crate) struct LeafPoints<'a> {
    /// For sixteen points a row of x, y and z each, then for the next sixteen.
    pub(crate) parts: &'a [[[f32; WIDTH]; 3]],
    /// Indices of the points of each triangle: `[corner][triangle]`.
    corner: &'a [[u8; WIDTH]; 3],
    /// Index of the leaf's first triangle in the object's leaf order.
    pub(crate) first: u32,
    /// The leaf's child code.
    pub(crate) code: u32,
}

impl LeafPoints<'_> {
    /// Indices of a triangle's points, below [`POINTS`].
    #[inline(always)]
    pub(crate) fn points_of(&self, triangle: usize) -> [usize; 3] {
        let at = triangle % WIDTH;
        let [a, b, c] = self.corner;
        [usize::from(a[at]) % POINTS, usize::from(b[at]) % POINTS, usize::from(c[at]) % POINTS]
    }

    /// A point, object space.
    #[inline(always)]
    pub(crate) fn point(&self, point: usize) -> [f32; 3] {
        self.parts[point / WIDTH].each_ref().map(|row| row[point % WIDTH])
    }

    /// Computes all points relative to an origin.
    #[inline(always)]
    pub(crate) fn relative<S: Simd>(&self, s: S, origin: [f32; 3], points: &mut RelativePoints) {
        for (part, rows) in self.parts.iter().enumerate() {
            points.put(s, part, load3(s, rows), origin);
        }
    }
}

/// A leaf's record.
pub(crate) trait LeafMesh: TriangleBlock {
    /// The leaf as points and triangles; `code` is its child code.
    fn points(&self, code: u32) -> LeafPoints<'_>;
    /// The triangles whose corners all lie beyond the same side of the bounds, one bit per
    /// triangle: all rays miss them.
    fn outside<S: Simd, H: PacketBounds<S>>(&self, s: S, bounds: &H) -> u32;
}

/// [`LeafMesh::outside`] as a part of kernels.
pub(crate) struct FindOutside<'a, H, B> {
    pub(crate) bounds: &'a H,
    pub(crate) block: &'a B,
}

impl<S: Simd, H: PacketBounds<S>, B: LeafMesh> Part<S> for FindOutside<'_, H, B> {
    type Output = u32;
    #[inline(always)]
    fn run(self, s: S) -> u32 {
        self.block.outside(s, self.bounds)
    }
}

/// The lanes in which the three words have a bit in common.
#[inline(always)]
fn common<S: Simd>(s: S, [a, b, c]: [S::U; 3]) -> u32 {
    s.mask_bits(s.lt_u(s.splat_u(0), s.and_u(a, s.and_u(b, c))))
}

impl LeafMesh for IndexedLeaf {
    #[inline(always)]
    fn points(&self, code: u32) -> LeafPoints<'_> {
        let IndexedLeaf { vertex, corner, first, .. } = self;
        LeafPoints { parts: slice::from_ref(vertex), corner, first: *first, code }
    }
    #[inline(always)]
    fn outside<S: Simd, H: PacketBounds<S>>(&self, s: S, bounds: &H) -> u32 {
        let sides = bounds.sides(s, load3(s, &self.vertex));
        let [a, b, c] = &self.corner;
        let of = [s.load_bytes(a), s.load_bytes(b), s.load_bytes(c)];
        common(s, [s.lookup_u(sides, of[0]), s.lookup_u(sides, of[1]), s.lookup_u(sides, of[2])])
    }
}

impl LeafMesh for RawLeaf {
    #[inline(always)]
    fn points(&self, code: u32) -> LeafPoints<'_> {
        LeafPoints { parts: &self.corner, corner: &OWN_POINTS, first: self.first, code }
    }
    #[inline(always)]
    fn outside<S: Simd, H: PacketBounds<S>>(&self, s: S, bounds: &H) -> u32 {
        let [a, b, c] = &self.corner;
        let sides =
            [bounds.sides(s, load3(s, a)), bounds.sides(s, load3(s, b)), bounds.sides(s, load3(s, c))];
        common(s, sides)
    }
}
