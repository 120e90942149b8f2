//! Queries about points, boxes and balls: closest points, overlapping triangles, winding numbers.
//!
//! [`searcher`] goes through the instances of a scene, [`nearest`] through the triangles of one.
//! [`search`] holds the best triangle so far where all is f32 in world space, [`wide_search`] for
//! instances and points of f64 ([`double`]). [`overlap`] finds the triangles in a box or a ball,
//! [`winding`] counts the surfaces around a point. [`crate::nodes::placed`] bounds distances in the
//! space of an instance's object.

mod double;
mod nearest;
mod order;
mod overlap;
mod search;
mod searcher;
mod wide_search;
mod winding;

pub use self::double::Closest64;
pub use crate::intersect::point_triangle::Feature;

use self::order::in_order;
use self::searcher::Searcher;
use crate::intersect::vector::wide;
use crate::rays::PrimitiveRef;
use crate::scene::Scene;

/// The closest point of a scene to a given point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// Distance in world space. It differs from the exact distance to the reported triangle by at
    /// most 0.55 units in the last place; infinite where it exceeds the range of f32.
    pub distance: f32,
    /// The closest point, in world space. On a corner it is the corner.
    pub point: [f32; 3],
    /// Barycentric weight of the triangle's second vertex, from 0 to 1.
    pub u: f32,
    /// Barycentric weight of the triangle's third vertex, from 0 to 1.
    pub v: f32,
    /// The triangle.
    pub primitive: PrimitiveRef,
    /// The part of the triangle on which the closest point lies.
    pub feature: Feature,
}

/// Points that are handled at a time where numbers are held for each.
const CHUNK: usize = 256;

/// Queries about points in world space.
impl Scene {
    /// The closest point of the scene's triangles to a point in world space. `None` if its
    /// distance, rounded to f32 as reported, exceeds `radius`, if the point is not finite, or if
    /// the radius is negative or NaN.
    ///
    /// Distances are exact to 0.55 units in the last place. Triangles of instances are their images
    /// under the f64 transform, as real numbers, and are compared by their exact distances. Where
    /// all triangles are f32 in world space, squared distances are compared, computed in f64 from
    /// the point and the triangle alone with a relative error below 2^-27. Distances to a shared
    /// edge or vertex are equal for all triangles that share it. Among equal ones the min instance
    /// wins, then the min id. So the result does not depend on the acceleration structures in the
    /// file, the instruction set or the batch. Triangles without area do not count, as for rays.
    ///
    /// ```
    /// # const CUBE: &[u8] = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/doc/cube.bth"));
    /// let scene = bth::from_bytes(CUBE)?;
    /// let closest = scene.closest([0.25, 0.5, 3.0], f32::INFINITY).expect("a triangle");
    /// assert_eq!((closest.distance, closest.point), (2.0, [0.25, 0.5, 1.0]));
    /// # Ok::<(), bth::Error>(())
    /// ```
    pub fn closest(&self, point: [f32; 3], radius: f32) -> Option<Closest> {
        let mut closest = None;
        self.closest_batch(&[point], radius, std::slice::from_mut(&mut closest));
        closest
    }

    /// Stores for each point what [`Self::closest`] returns. Many points in one call are faster:
    /// they are searched in an order in which each is close to the one before.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn closest_batch(&self, points: &[[f32; 3]], radius: f32, closest: &mut [Option<Closest>]) {
        assert_eq!(points.len(), closest.len(), "as many results as points");
        let mut searcher = Searcher::new(self);
        in_order(points, |i| closest[i] = searcher.closest(points[i], radius));
    }

    /// The distance of a point in world space to the closest triangle, as [`Self::closest`] reports
    /// it, negative if the scene contains the point ([`Self::contains`]). Infinite in an empty
    /// scene; NaN if the point is not finite. The sign is reliable where the meshes are closed.
    pub fn signed_distance(&self, point: [f32; 3]) -> f32 {
        let mut distance = 0.0;
        self.signed_distance_batch(&[point], std::slice::from_mut(&mut distance));
        distance
    }

    /// Stores for each point what [`Self::signed_distance`] returns.
    ///
    /// # Panics
    /// If there are not as many distances as points.
    pub fn signed_distance_batch(&self, points: &[[f32; 3]], distances: &mut [f32]) {
        assert_eq!(points.len(), distances.len(), "as many distances as points");
        const CHUNK: usize = 1024;
        let (mut closest, mut inside) = (vec![None; CHUNK.min(points.len())], [false; CHUNK]);
        for (points, distances) in points.chunks(CHUNK).zip(distances.chunks_mut(CHUNK)) {
            let (closest, inside) = (&mut closest[..points.len()], &mut inside[..points.len()]);
            self.closest_batch(points, f32::INFINITY, closest);
            self.contains_batch(points, inside);
            for i in 0..points.len() {
                let is_finite = points[i].iter().all(|x| x.is_finite());
                let distance = closest[i].map_or(f32::INFINITY, |closest| closest.distance);
                distances[i] = match (is_finite, inside[i] && distance > 0.0) {
                    (false, _) => f32::NAN,
                    (true, true) => -distance,
                    (true, false) => distance,
                };
            }
        }
    }

    /// Returns true if a triangle and an axis-aligned box in world space have a point in common.
    /// Both are closed, so touching counts; the answer is exact. A box may be infinite. A box with
    /// a `lower` above its `upper` or a NaN is empty. Triangles of instances are their images under
    /// the f64 transform, as real numbers.
    pub fn overlaps_box(&self, lower: [f32; 3], upper: [f32; 3]) -> bool {
        overlap::visit_box(self, [lower, upper].map(wide), true, &mut |_| true)
    }

    /// Replaces the contents of `triangles` by all triangles that overlap a box as in
    /// [`Self::overlaps_box`], by ascending instance and triangle.
    pub fn triangles_in_box(&self, lower: [f32; 3], upper: [f32; 3], triangles: &mut Vec<PrimitiveRef>) {
        let region = [lower, upper].map(wide);
        overlap::collect_sorted(triangles, |visit| overlap::visit_box(self, region, true, visit));
    }

    /// Returns true if a triangle overlaps a ball in world space: if its distance from the centre,
    /// rounded to f32 as [`Self::closest`] reports it, does not exceed the radius. False if the
    /// centre is not finite, or the radius is negative or NaN.
    pub fn overlaps_sphere(&self, center: [f32; 3], radius: f32) -> bool {
        overlap::visit_ball(self, center, radius, &mut |_| true)
    }

    /// Replaces the contents of `triangles` by all triangles that overlap a ball as in
    /// [`Self::overlaps_sphere`], by ascending instance and triangle.
    pub fn triangles_in_sphere(&self, center: [f32; 3], radius: f32, triangles: &mut Vec<PrimitiveRef>) {
        overlap::collect_sorted(triangles, |visit| overlap::visit_ball(self, center, radius, visit));
    }

    /// The winding number of the scene's surfaces around a point in world space: how often a closed
    /// mesh encloses the point if its triangles are counterclockwise as seen from outside. 0
    /// outside, 1 inside, 2 where two solids overlap; negative where the triangles are
    /// counterclockwise as seen from inside.
    ///
    /// It is exact for closed meshes, even if they intersect themselves. A point on the surface
    /// counts as if it were moved by (ε, ε², ε³) for an infinitely small ε > 0, so of solids that
    /// fill space without gaps exactly one contains it. For other meshes it is the number of
    /// crossings of a ray from the point along an axis of its object to the nearest side of the
    /// object's bounds. Outside of the bounds of an instance, and for a point that is not finite,
    /// it is 0.
    ///
    /// The numbers of all instances are added. Their triangles are images under the f64 transform,
    /// as real numbers, counterclockwise where the object's are. Of instances that fill space
    /// without gaps exactly one contains each point.
    pub fn winding(&self, point: [f32; 3]) -> i32 {
        self.winding_f64(wide(point))
    }

    /// Stores for each point what [`Self::winding`] returns.
    ///
    /// # Panics
    /// If there are not as many numbers as points.
    pub fn winding_batch(&self, points: &[[f32; 3]], winding: &mut [i32]) {
        assert_eq!(points.len(), winding.len(), "as many winding numbers as points");
        let mut buffer = [[0.0; 3]; CHUNK];
        for (points, winding) in points.chunks(CHUNK).zip(winding.chunks_mut(CHUNK)) {
            let buffer = &mut buffer[..points.len()];
            buffer.iter_mut().zip(points).for_each(|(wide_point, point)| *wide_point = wide(*point));
            winding::windings(self, buffer, winding);
        }
    }

    /// Returns true if a point in world space lies inside: if [`Self::winding`] is not 0. Where
    /// shells overlap, points in both are inside. A cavity is outside if its triangles are
    /// counterclockwise as seen from within it, as they are in models of solids.
    ///
    /// ```
    /// # const CUBE: &[u8] = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/doc/cube.bth"));
    /// let scene = bth::from_bytes(CUBE)?;
    /// assert!(scene.contains([0.5, 0.5, 0.5]) && !scene.contains([0.5, 0.5, 1.5]));
    /// # Ok::<(), bth::Error>(())
    /// ```
    pub fn contains(&self, point: [f32; 3]) -> bool {
        self.winding(point) != 0
    }

    /// Stores for each point what [`Self::contains`] returns.
    ///
    /// # Panics
    /// If there are not as many answers as points.
    pub fn contains_batch(&self, points: &[[f32; 3]], inside: &mut [bool]) {
        assert_eq!(points.len(), inside.len(), "as many answers as points");
        let mut buffer = [0; CHUNK];
        for (points, inside) in points.chunks(CHUNK).zip(inside.chunks_mut(CHUNK)) {
            let winding = &mut buffer[..points.len()];
            self.winding_batch(points, winding);
            for (inside, winding) in inside.iter_mut().zip(winding) {
                *inside = *winding != 0;
            }
        }
    }

    /// Returns true if the triangles of an object form a surface without boundary: if every edge
    /// has as many triangles in one direction as in the other. Winding numbers are then exact.
    /// `None` if the file was compiled without the triangles of its source. Vertices with equal
    /// positions count as one. Takes as long as sorting the edges.
    ///
    /// # Panics
    /// If `object` is not less than [`Self::object_count`].
    pub fn is_closed(&self, object: u32) -> Option<bool> {
        let view = self.object(object);
        let is_known = view.triangles.len() == view.header.triangles as usize;
        is_known.then(|| winding::is_closed(&view))
    }
}
