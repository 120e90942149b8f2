//! Points of a leaf, projected along sixteen rays of a packet.

use super::bounds::FrustumView;
use super::projection::Projection;
use crate::intersect::exact_lanes::F32Lanes;
use crate::simd::{LANES, Lanewise, Simd};
use bth_format::layout::WIDTH;

/// Upper bound on the number of points of a leaf, three for each triangle: a power of two, to which
/// indices are easily limited.
pub(crate) const POINTS: usize = 4 * WIDTH;

/// Projected points of a leaf: for each point x, y and depth in the projections along sixteen rays.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct ProjectedPoints([[F32Lanes; 3]; POINTS]);

impl ProjectedPoints {
    pub(crate) const NONE: ProjectedPoints = ProjectedPoints([[[0.0; LANES]; 3]; POINTS]);

    /// Stores the projections of point i.
    #[inline(always)]
    pub(crate) fn put<S: Simd>(&mut self, s: S, i: usize, point: [S::F; 3]) {
        for k in 0..3 {
            s.store(point[k], &mut self.0[i][k]);
        }
    }

    #[inline(always)]
    fn get<S: Lanewise>(&self, s: S, i: usize) -> [S::F; 3] {
        let [x, y, depth] = &self.0[i];
        [s.load(x), s.load(y), s.load(depth)]
    }
}

/// Points of a leaf relative to the common origin of the rays: for each axis rows of sixteen
/// coordinates.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct RelativePoints([[F32Lanes; POINTS / LANES]; 3]);

impl RelativePoints {
    pub(crate) const NONE: RelativePoints = RelativePoints([[[0.0; LANES]; POINTS / LANES]; 3]);

    /// Stores sixteen points, given as rows of x, y and z, relative to `origin`.
    #[inline(always)]
    pub(crate) fn put<S: Simd>(&mut self, s: S, part: usize, rows: [S::F; 3], origin: [f32; 3]) {
        for k in 0..3 {
            s.store(s.sub(rows[k], s.splat(origin[k])), &mut self.0[k][part]);
        }
    }

    /// The coordinates of all points along an axis.
    #[inline(always)]
    pub(crate) fn row(&self, axis: usize) -> &[f32; POINTS] {
        self.0[axis].as_flattened().first_chunk().expect("a row holds all points")
    }

    /// Upper bounds of |x| or |y| and of |depth| in the projection along any ray, over the points
    /// whose bit is set in `used`, which lie in the first `parts` rows.
    #[inline(always)]
    pub(crate) fn spread<S: Simd>(&self, s: S, view: &FrustumView, parts: usize, used: u64) -> [f32; 2] {
        let (mut size, mut depth) = (s.splat(0.0), s.splat(0.0));
        for part in 0..parts {
            let m = s.mask((used >> (part * LANES)) as u32 & 0xffff);
            let [x, y, z] = &self.0;
            let [part_size, far] = view.spread(s, [s.load(&x[part]), s.load(&y[part]), s.load(&z[part])]);
            size = s.select(m, s.max(part_size, size), size);
            depth = s.select(m, s.max(far, depth), depth);
        }
        let zero = s.splat(0.0);
        [-s.least(s.sub(zero, size)), -s.least(s.sub(zero, depth))]
    }
}

/// Source of the projected corners of triangles.
pub(crate) trait CornerSource<S: Simd> {
    /// x, y and depth of a point in the projections along sixteen rays.
    fn corner(&self, s: S, point: usize) -> [S::F; 3];
    /// Like [`Self::corner`], along the rays of a piece.
    fn corner_of_piece(&self, piece: S::Piece, point: usize) -> [<S::Piece as Lanewise>::F; 3];
}

impl<S: Simd> CornerSource<S> for ProjectedPoints {
    #[inline(always)]
    fn corner(&self, s: S, point: usize) -> [S::F; 3] {
        self.get(s, point)
    }
    #[inline(always)]
    fn corner_of_piece(&self, piece: S::Piece, point: usize) -> [<S::Piece as Lanewise>::F; 3] {
        self.get(piece, point)
    }
}

/// Projects corners at each use. For points relative to the rays' origin this takes less time than
/// storing and loading them.
pub(crate) struct ProjectedOnDemand<'a, S: Simd> {
    pub(crate) rows: [&'a [f32; POINTS]; 3],
    pub(crate) projection: Projection<S>,
}

impl<S: Simd> CornerSource<S> for ProjectedOnDemand<'_, S> {
    #[inline(always)]
    fn corner(&self, s: S, point: usize) -> [S::F; 3] {
        let [x, y, z] = self.rows;
        self.projection.of_relative(s, [s.splat(x[point]), s.splat(y[point]), s.splat(z[point])])
    }
    #[inline(always)]
    fn corner_of_piece(&self, p: S::Piece, point: usize) -> [<S::Piece as Lanewise>::F; 3] {
        let [x, y, z] = self.rows;
        self.projection.pick(p).of_relative(p, [p.splat(x[point]), p.splat(y[point]), p.splat(z[point])])
    }
}

/// Largest |x| or |y| and largest |depth| of projected points.
pub(crate) struct ProjectedMaxima<S: Simd> {
    pub(crate) coordinate: S::F,
    pub(crate) depth: S::F,
}

impl<S: Simd> ProjectedMaxima<S> {
    /// Includes a point, and returns it.
    #[inline(always)]
    pub(crate) fn including(&mut self, s: S, point: [S::F; 3]) -> [S::F; 3] {
        self.coordinate = s.max_abs(s.max_abs(point[0], self.coordinate), point[1]);
        self.depth = s.max_abs(point[2], self.depth);
        point
    }
}
