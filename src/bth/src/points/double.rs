//! Queries about points of f64 coordinates. Everything is decided about these and about the
//! triangles of instances as real numbers.

use super::order::in_order;
use super::searcher::Searcher;
use super::wide_search::Radius;
use super::{CHUNK, overlap, winding};
use crate::intersect::point_triangle::Feature;
use crate::rays::PrimitiveRef;
use crate::scene::Scene;

/// The closest point of a scene to a given point, in f64.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest64 {
    /// Distance in world space. It differs from the exact one by at most 2^-40 of the distance plus
    /// the longest edge of the triangle (maximum norm), and by at most 2^-28 of the distance.
    pub distance: f64,
    /// The closest point, in world space. Each coordinate is off by at most 2^-40 of the distance
    /// plus the longest edge, and by half a unit in its last place.
    pub point: [f64; 3],
    /// Barycentric weight of the triangle's second vertex, from 0 to 1, off by at most 2^-26.
    pub u: f64,
    /// Barycentric weight of the triangle's third vertex, like `u`.
    pub v: f64,
    /// The triangle.
    pub primitive: PrimitiveRef,
    /// The part of the triangle on which the closest point lies, exactly.
    pub feature: Feature,
}

/// Queries about points in world space, in f64. Numbers of f32 are taken as they are.
impl Scene {
    /// Like [`Scene::closest`], with two differences. Triangles are compared by their exact
    /// distances. `None` if the exact distance exceeds the radius.
    ///
    /// ```
    /// # const CUBE: &[u8] = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/doc/cube.bth"));
    /// let scene = bth::from_bytes(CUBE)?;
    /// let closest = scene.closest_f64([0.1, 0.5, 3.0], f64::INFINITY).expect("a triangle");
    /// assert_eq!((closest.distance, closest.point), (2.0, [0.1, 0.5, 1.0]));
    /// # Ok::<(), bth::Error>(())
    /// ```
    pub fn closest_f64(&self, point: [f64; 3], radius: f64) -> Option<Closest64> {
        Searcher::new(self).closest_f64(point, radius)
    }

    /// Stores for each point what [`Self::closest_f64`] returns. Many points in one call are
    /// faster.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn closest_batch_f64(&self, points: &[[f64; 3]], radius: f64, closest: &mut [Option<Closest64>]) {
        assert_eq!(points.len(), closest.len(), "as many results as points");
        let mut searcher = Searcher::new(self);
        in_order(points, |i| closest[i] = searcher.closest_f64(points[i], radius));
    }

    /// Like [`Scene::signed_distance`], by [`Self::closest_f64`] and [`Self::contains_f64`].
    pub fn signed_distance_f64(&self, point: [f64; 3]) -> f64 {
        let mut distance = 0.0;
        self.signed_distance_batch_f64(&[point], std::slice::from_mut(&mut distance));
        distance
    }

    /// Stores for each point what [`Self::signed_distance_f64`] returns.
    ///
    /// # Panics
    /// If there are not as many distances as points.
    pub fn signed_distance_batch_f64(&self, points: &[[f64; 3]], distances: &mut [f64]) {
        assert_eq!(points.len(), distances.len(), "as many distances as points");
        let mut searcher = Searcher::new(self);
        let distance = |closest: Option<Closest64>| closest.map_or(f64::INFINITY, |closest| closest.distance);
        in_order(points, |i| distances[i] = distance(searcher.closest_f64(points[i], f64::INFINITY)));
        let mut buffer = [0; CHUNK];
        for (points, distances) in points.chunks(CHUNK).zip(distances.chunks_mut(CHUNK)) {
            let numbers = &mut buffer[..points.len()];
            winding::windings(self, points, numbers);
            for i in 0..points.len() {
                if !points[i].iter().all(|x| x.is_finite()) {
                    distances[i] = f64::NAN;
                } else if numbers[i] != 0 && distances[i] > 0.0 {
                    distances[i] = -distances[i];
                }
            }
        }
    }

    /// Like [`Scene::overlaps_box`].
    pub fn overlaps_box_f64(&self, lower: [f64; 3], upper: [f64; 3]) -> bool {
        overlap::visit_box(self, [lower, upper], false, &mut |_| true)
    }

    /// Like [`Scene::triangles_in_box`].
    pub fn triangles_in_box_f64(&self, lower: [f64; 3], upper: [f64; 3], triangles: &mut Vec<PrimitiveRef>) {
        overlap::collect_sorted(triangles, |visit| overlap::visit_box(self, [lower, upper], false, visit));
    }

    /// Returns true if a triangle overlaps a closed ball in world space: if its exact distance from
    /// the centre does not exceed the radius. False if the centre is not finite, or the radius is
    /// negative or NaN.
    pub fn overlaps_sphere_f64(&self, center: [f64; 3], radius: f64) -> bool {
        overlap::visit_wide_ball(self, center, Radius::Exact(radius), &mut |_| true)
    }

    /// Replaces the contents of `triangles` by all triangles that overlap a ball as in
    /// [`Self::overlaps_sphere_f64`], by ascending instance and triangle.
    pub fn triangles_in_sphere_f64(&self, center: [f64; 3], radius: f64, triangles: &mut Vec<PrimitiveRef>) {
        let radius = Radius::Exact(radius);
        overlap::collect_sorted(triangles, |visit| overlap::visit_wide_ball(self, center, radius, visit));
    }

    /// Like [`Scene::winding`].
    pub fn winding_f64(&self, point: [f64; 3]) -> i32 {
        let mut winding = [0];
        winding::windings(self, &[point], &mut winding);
        winding[0]
    }

    /// Stores for each point what [`Self::winding_f64`] returns.
    ///
    /// # Panics
    /// If there are not as many numbers as points.
    pub fn winding_batch_f64(&self, points: &[[f64; 3]], winding: &mut [i32]) {
        assert_eq!(points.len(), winding.len(), "as many winding numbers as points");
        winding::windings(self, points, winding);
    }

    /// Like [`Scene::contains`].
    pub fn contains_f64(&self, point: [f64; 3]) -> bool {
        self.winding_f64(point) != 0
    }

    /// Stores for each point what [`Self::contains_f64`] returns.
    ///
    /// # Panics
    /// If there are not as many answers as points.
    pub fn contains_batch_f64(&self, points: &[[f64; 3]], inside: &mut [bool]) {
        assert_eq!(points.len(), inside.len(), "as many answers as points");
        let mut buffer = [0; CHUNK];
        for (points, inside) in points.chunks(CHUNK).zip(inside.chunks_mut(CHUNK)) {
            let winding = &mut buffer[..points.len()];
            winding::windings(self, points, winding);
            inside.iter_mut().zip(winding).for_each(|(inside, winding)| *inside = *winding != 0);
        }
    }
}
