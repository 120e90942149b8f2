//! Points of a leaf as sixteen rays of a packet see them.

use super::bounds::FrustumView;
use super::projection::Projection;
use crate::intersect::exact_lanes::F32Lanes;
use crate::simd::{LANES, Simd};
use bth_format::layout::WIDTH;

/// Points of a leaf at most.
pub(crate) const POINTS: usize = 3 * WIDTH;

/// Projected points of a leaf, x, y and depth of each as sixteen rays see it.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Points([[F32Lanes; 3]; POINTS]);

impl Points {
    pub(crate) const NONE: Points = Points([[[0.0; LANES]; 3]; POINTS]);

    #[inline(always)]
    pub(crate) fn put<S: Simd>(&mut self, s: S, i: usize, point: [S::F; 3]) {
        for k in 0..3 {
            s.store(point[k], &mut self.0[i][k]);
        }
    }

    #[inline(always)]
    fn get<S: Simd>(&self, s: S, i: usize) -> [S::F; 3] {
        let [x, y, depth] = &self.0[i];
        [s.load(x), s.load(y), s.load(depth)]
    }
}

/// Points of a leaf relative to the point at which all rays start, a row for each axis.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Relative([[F32Lanes; 3]; 3]);

impl Relative {
    pub(crate) const NONE: Relative = Relative([[[0.0; LANES]; 3]; 3]);

    /// Sixteen of them.
    #[inline(always)]
    pub(crate) fn put<S: Simd>(&mut self, s: S, part: usize, rows: [S::F; 3], from: [f32; 3]) {
        for k in 0..3 {
            s.store(s.sub(rows[k], s.splat(from[k])), &mut self.0[k][part]);
        }
    }

    #[inline(always)]
    pub(crate) fn row(&self, axis: usize) -> &[f32; POINTS] {
        self.0[axis].as_flattened().first_chunk().expect("as many")
    }

    /// ObjectBounds of the size and the depth of these points, a bit each, as any ray sees them.
    #[inline(always)]
    pub(crate) fn spread<S: Simd>(&self, s: S, view: &FrustumView, parts: usize, used: u64) -> [f32; 2] {
        let (mut size, mut depth) = (s.splat(0.0), s.splat(0.0));
        for part in 0..parts {
            let m = s.mask((used >> (part * LANES)) as u32 & 0xffff);
            let [x, y, z] = &self.0;
            let [own, far] = view.spread(s, [s.load(&x[part]), s.load(&y[part]), s.load(&z[part])]);
            size = s.select(m, s.max(own, size), size);
            depth = s.select(m, s.max(far, depth), depth);
        }
        let zero = s.splat(0.0);
        [-s.least(s.sub(zero, size)), -s.least(s.sub(zero, depth))]
    }
}

/// Where the corners of triangles come from, as sixteen rays see them.
pub(crate) trait CornerSource<S: Simd> {
    fn corner(&self, s: S, point: usize) -> [S::F; 3];
}

impl<S: Simd> CornerSource<S> for Points {
    #[inline(always)]
    fn corner(&self, s: S, point: usize) -> [S::F; 3] {
        self.get(s, point)
    }
}

/// Projected where they are asked for: with origins left out of it that takes less than to store and load them.
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
}

/// Of projected points: |x| or |y|, and |depth|.
pub(crate) struct Greatest<S: Simd> {
    pub(crate) coordinate: S::F,
    pub(crate) depth: S::F,
}

impl<S: Simd> Greatest<S> {
    /// Takes in a point, and hands it back.
    #[inline(always)]
    pub(crate) fn including(&mut self, s: S, point: [S::F; 3]) -> [S::F; 3] {
        self.coordinate = s.max_abs(s.max_abs(point[0], self.coordinate), point[1]);
        self.depth = s.max_abs(point[2], self.depth);
        point
    }
}
