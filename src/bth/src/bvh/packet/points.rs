//! Points of a leaf, projected for a group of sixteen rays or relative to the rays' common origin.

use super::bounds::FrustumView;
use super::projection::Projection;
use crate::intersect::exact_lanes::F32Lanes;
use crate::simd::{LANES, Simd};
use bth_format::layout::WIDTH;

/// Greatest number of points of a leaf.
pub(crate) const POINTS: usize = 3 * WIDTH;

/// Points of a leaf, projected along sixteen rays: `[point][x, y, depth]`, one ray in a lane.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct ProjectedPoints([[F32Lanes; 3]; POINTS]);

impl ProjectedPoints {
    pub(crate) const NONE: ProjectedPoints = ProjectedPoints([[[0.0; LANES]; 3]; POINTS]);

    #[inline(always)]
    pub(crate) fn store<S: Simd>(&mut self, s: S, i: usize, point: [S::F; 3]) {
        for k in 0..3 {
            s.store(point[k], &mut self.0[i][k]);
        }
    }

    #[inline(always)]
    fn load<S: Simd>(&self, s: S, i: usize) -> [S::F; 3] {
        let [x, y, depth] = &self.0[i];
        [s.load(x), s.load(y), s.load(depth)]
    }
}

/// Points of a leaf relative to the common origin of all rays, in vectors of sixteen points: `[axis][vector]`.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct RelativePoints([[F32Lanes; 3]; 3]);

impl RelativePoints {
    pub(crate) const NONE: RelativePoints = RelativePoints([[[0.0; LANES]; 3]; 3]);

    /// Stores sixteen points, given as rows of x, y and z in object space.
    #[inline(always)]
    pub(crate) fn store<S: Simd>(&mut self, s: S, vector: usize, rows: [S::F; 3], origin: [f32; 3]) {
        for k in 0..3 {
            s.store(s.sub(rows[k], s.splat(origin[k])), &mut self.0[k][vector]);
        }
    }

    /// The coordinates of all points along an axis.
    #[inline(always)]
    pub(crate) fn row(&self, axis: usize) -> &[f32; POINTS] {
        self.0[axis].as_flattened().first_chunk().expect("a row holds all points")
    }

    /// Bounds of the projections of those points of the first `vectors` vectors whose bit is set in `used`, for all rays: the
    /// greatest |x| or |y|, and the greatest |depth|.
    #[inline(always)]
    pub(crate) fn projected_bounds<S: Simd>(
        &self,
        s: S,
        view: &FrustumView,
        vectors: usize,
        used: u64,
    ) -> [f32; 2] {
        let (mut coordinate, mut depth) = (s.splat(0.0), s.splat(0.0));
        for i in 0..vectors {
            let m = s.mask((used >> (i * LANES)) as u32 & 0xffff);
            let [x, y, z] = &self.0;
            let [size, far] = view.projected_bounds(s, [s.load(&x[i]), s.load(&y[i]), s.load(&z[i])]);
            coordinate = s.select(m, s.max(size, coordinate), coordinate);
            depth = s.select(m, s.max(far, depth), depth);
        }
        let zero = s.splat(0.0);
        [-s.least(s.sub(zero, coordinate)), -s.least(s.sub(zero, depth))]
    }
}

/// Source of the projected corners of triangles.
pub(crate) trait CornerSource<S: Simd> {
    /// A point of the leaf as x, y and depth, projected along sixteen rays.
    fn corner(&self, s: S, point: usize) -> [S::F; 3];
}

impl<S: Simd> CornerSource<S> for ProjectedPoints {
    #[inline(always)]
    fn corner(&self, s: S, point: usize) -> [S::F; 3] {
        self.load(s, point)
    }
}

/// Points relative to the rays' common origin, each projected when it is read: without the subtraction of origins, this is faster than
/// to store and load projected points.
pub(crate) struct ProjectedOnDemand<'a, S: Simd> {
    /// Coordinates of the points, in the axes of the projection.
    pub(crate) rows: [&'a [f32; POINTS]; 3],
    /// As [`Projection::to_relative`] returns it.
    pub(crate) projection: Projection<S>,
}

impl<S: Simd> CornerSource<S> for ProjectedOnDemand<'_, S> {
    #[inline(always)]
    fn corner(&self, s: S, point: usize) -> [S::F; 3] {
        let [x, y, z] = self.rows;
        self.projection.project_relative(s, [s.splat(x[point]), s.splat(y[point]), s.splat(z[point])])
    }
}

/// Greatest coordinates of projected points, one ray in a lane.
pub(crate) struct ProjectedMaxima<S: Simd> {
    /// Greatest |x| or |y|.
    pub(crate) coordinate: S::F,
    /// Greatest |depth|.
    pub(crate) depth: S::F,
}

impl<S: Simd> ProjectedMaxima<S> {
    /// Includes a projected point.
    #[inline(always)]
    pub(crate) fn include(&mut self, s: S, point: [S::F; 3]) {
        self.coordinate = s.max_abs(s.max_abs(point[0], self.coordinate), point[1]);
        self.depth = s.max_abs(point[2], self.depth);
    }
}
