//! Rays and hits whose components are separate arrays, as other tracers and array languages keep
//! them.

use crate::rays::{Hit, Ray};

/// Rays in world space, each component an array with one element for each ray.
#[derive(Clone, Copy, Debug)]
pub struct RayStreams<'a> {
    /// x, y and z of the origins.
    pub origin: [&'a [f32]; 3],
    /// x, y and z of the directions.
    pub direction: [&'a [f32]; 3],
    /// Smallest t of each ray's hits; 0 for all rays if it is empty.
    pub tmin: &'a [f32],
    /// Largest t of each ray's hits; infinite for all rays if it is empty.
    pub tmax: &'a [f32],
}

/// Hits, each component an array with one element for each ray. A ray that hits nothing has the
/// values of [`Hit::MISS`].
#[derive(Debug)]
pub struct HitStreams<'a> {
    /// t of each hit, infinite for a miss.
    pub t: &'a mut [f32],
    /// Barycentric weight of the triangle's second vertex.
    pub u: &'a mut [f32],
    /// Barycentric weight of the triangle's third vertex.
    pub v: &'a mut [f32],
    /// Index of the instance, `u32::MAX` for a miss.
    pub instance: &'a mut [u32],
    /// Index of the triangle, `u32::MAX` for a miss.
    pub triangle: &'a mut [u32],
}

/// Rays that are converted at a time: they stay in the first levels of the cache.
const BLOCK: usize = 1024;

impl RayStreams<'_> {
    /// Number of rays.
    ///
    /// # Panics
    /// If the arrays differ in length.
    pub(crate) fn len(&self) -> usize {
        let len = self.origin[0].len();
        assert!(self.origin.iter().chain(&self.direction).all(|c| c.len() == len), "arrays of one length");
        assert!([self.tmin, self.tmax].iter().all(|c| c.is_empty() || c.len() == len), "one range a ray");
        len
    }

    fn ray(&self, i: usize) -> Ray {
        let (origin, direction) = (self.origin.map(|c| c[i]), self.direction.map(|c| c[i]));
        let tmin = if self.tmin.is_empty() { 0.0 } else { self.tmin[i] };
        let tmax = if self.tmax.is_empty() { f32::INFINITY } else { self.tmax[i] };
        Ray { origin, tmin, direction, tmax }
    }

    /// Calls `trace` with the rays of each block and the index of the first.
    pub(crate) fn in_blocks(&self, mut trace: impl FnMut(usize, &[Ray])) {
        let mut rays = Vec::with_capacity(BLOCK);
        let len = self.len();
        for first in (0..len).step_by(BLOCK) {
            rays.clear();
            rays.extend((first..(first + BLOCK).min(len)).map(|i| self.ray(i)));
            trace(first, &rays);
        }
    }
}

impl HitStreams<'_> {
    /// # Panics
    /// If the arrays do not all have this length.
    pub(crate) fn check_lengths(&self, rays: usize) {
        let HitStreams { t, u, v, instance, triangle } = self;
        let lengths = [t.len(), u.len(), v.len(), instance.len(), triangle.len()];
        assert_eq!(lengths, [rays; 5], "as many results as rays");
    }

    /// Stores the hits of the rays from `first` on.
    pub(crate) fn store(&mut self, first: usize, hits: &[Hit]) {
        for (i, &Hit { t, u, v, primitive }) in (first..).zip(hits) {
            (self.t[i], self.u[i], self.v[i]) = (t, u, v);
            (self.instance[i], self.triangle[i]) = (primitive.instance, primitive.triangle);
        }
    }
}
