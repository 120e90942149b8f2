//! Crossings of surfaces: how often a ray passes through the triangles of a scene, and whether points lie inside of closed meshes.
//!
//! [`crate::intersect::crossing`] is the rule that decides, [`walk`] the fast way for points. Rays in any direction use the
//! enumeration of the triangles that a ray may hit.

mod walk;

use crate::bvh::enumerate::{Receiver, enumerate};
use crate::intersect::crossing::{crossing, crossing_from_start};
use crate::intersect::start::ExactStart;
use crate::intersect::start::start_on;
use crate::intersect::start_point::StartPoint;
use crate::query::TriangleRef;
use crate::rays::Ray;
use crate::scene::Scene;
use crate::start_queries::TraceRay;
use crate::starts::world_ray::WorldRay;
use std::cmp::Ordering;

/// Passages of a ray through triangles, counted by the crossing rule of [`Scene::crossings`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub struct Crossings {
    /// Number of crossings in the ray's range.
    pub count: u32,
    /// Crossings from the back of a triangle to its front minus those from the front to the back. The front is the side
    /// from which the vertices are seen counterclockwise, in the space of the object.
    pub winding: i32,
}

/// Counts the crossings of a ray in object space.
struct CrossingCounter<'a> {
    ray: Ray,
    /// Where it starts, if that is on a triangle of the object.
    start: Option<(&'a StartPoint, &'a ExactStart)>,
    found: Crossings,
}

impl Receiver for CrossingCounter<'_> {
    fn receive(&mut self, _triangle: TriangleRef<'_>, corners: [[f32; 3]; 3]) -> bool {
        let sign = match self.start {
            None => crossing(&self.ray, corners),
            Some((point, start)) => crossing_from_start(&self.ray, point, start, corners),
        };
        self.found.count += sign.unsigned_abs();
        self.found.winding += sign;
        false
    }
    fn limit(&self) -> f64 {
        f64::INFINITY
    }
}

impl Scene {
    /// The crossings of triangles by a ray in world space, each passage of a closed surface counted once.
    ///
    /// Hits are not suited for this, because a ray through an edge or a vertex hits all triangles at it, and a ray in the plane of a
    /// triangle does not hit it. Crossings are those of the ray with its origin moved by (ε, ε², ε³) for an
    /// infinitely small ε > 0 in the space of the object: an exact rule that never meets an edge, a vertex or a plane. So a surface
    /// without boundary is crossed as often in as out by a line, and of two ranges of t that share an end, `[a, b]` and `[b, c]`,
    /// each crossing is in exactly one: t is compared with the ends exactly, without rounding. A ray without a line (see
    /// [`Scene`]) has no crossings, nor has one of a range that is empty or a single t.
    ///
    /// A [`StartRay`](crate::rays::StartRay) counts the crossings of the moved line whose t, as that of the line through the start
    /// itself, is above 0: none of a triangle through the start.
    ///
    /// Each instance is counted in its own space, into which the ray is rounded as for other queries. A mirrored instance keeps
    /// its front and back.
    ///
    /// ```no_run
    /// use bth::rays::Ray;
    ///
    /// let scene = bth::open("bunny.bth")?;
    /// let ray = Ray::new([0.0, 0.1, 1.0], [0.0, 0.0, -1.0]);
    /// // An even number for a closed model and a ray from outside.
    /// println!("{} crossings", scene.crossings(&ray).count);
    /// # Ok::<(), bth::Error>(())
    /// ```
    pub fn crossings<R: TraceRay>(&self, ray: &R) -> Crossings {
        let mut total = Crossings::default();
        let Some(placed) = ray.placed(self) else { return total };
        let world_ray = placed.world_ray();
        self.enumerate_instances(world_ray.ray, &mut |entered| {
            let ray = entered.object_ray(world_ray).with_exact_range(world_ray.ray);
            let start = world_ray.start_in(entered.instance);
            let exact_start = start.and_then(|start| start_on(entered.object, start));
            let start_pair = start.zip(exact_start.as_ref());
            let mut counter = CrossingCounter { ray, start: start_pair, found: Crossings::default() };
            enumerate(entered.object, (&ray, start), &mut counter);
            total.count += counter.found.count;
            total.winding += counter.found.winding;
            Some(f32::INFINITY)
        });
        total
    }

    /// As [`Self::crossings`], for each of the rays.
    ///
    /// # Panics
    /// If there are not as many results as rays.
    pub fn crossings_batch<R: TraceRay>(&self, rays: &[R], crossings: &mut [Crossings]) {
        assert_eq!(rays.len(), crossings.len(), "as many results as rays");
        for (ray, crossings) in rays.iter().zip(crossings) {
            *crossings = self.crossings(ray);
        }
    }

    /// The winding number of the scene's surfaces around a point in world space: for a closed mesh whose triangles are
    /// counterclockwise as seen from outside, how many times it encloses the point. 0 outside, 1 inside, 2 where
    /// two solids overlap; negative where the triangles are seen counterclockwise from inside.
    ///
    /// It is exact for closed meshes, also if they intersect themselves. A point on the surface counts as if it were moved
    /// by (ε, ε², ε³) for an infinitely small ε > 0, so of solids that fill space without gaps exactly one contains it. Where a mesh is
    /// not closed, or its triangles are not consistently oriented, the number is that of the crossings of a ray from the point to
    /// the nearest side of the object's bounds, along an axis. Outside of the bounds of an instance, and for a point
    /// that is not finite, it is 0.
    ///
    /// The numbers of all instances are added up, each counted in the space of its object, into which the point is rounded.
    pub fn winding(&self, point: [f32; 3]) -> i32 {
        let mut winding = [0];
        self.windings(&[point], &mut winding);
        winding[0]
    }

    /// As [`Self::winding`], for each of the points.
    ///
    /// # Panics
    /// If there are not as many numbers as points.
    pub fn winding_batch(&self, points: &[[f32; 3]], winding: &mut [i32]) {
        assert_eq!(points.len(), winding.len(), "as many winding numbers as points");
        self.windings(points, winding);
    }

    /// Whether a point in world space lies inside: whether [`Self::winding`] is not 0. For a closed mesh that neither intersects nor
    /// contains itself this is as good as an odd number of crossings. Where shells overlap, points in both are inside; a
    /// cavity is outside if its triangles are seen counterclockwise from within it, as they are in models of solids.
    ///
    /// ```no_run
    /// let scene = bth::open("bunny.bth")?;
    /// if scene.contains([0.0, 0.1, 0.0]) {
    ///     println!("inside");
    /// }
    /// # Ok::<(), bth::Error>(())
    /// ```
    pub fn contains(&self, point: [f32; 3]) -> bool {
        self.winding(point) != 0
    }

    /// As [`Self::contains`], for each of the points.
    ///
    /// # Panics
    /// If there are not as many answers as points.
    pub fn contains_batch(&self, points: &[[f32; 3]], inside: &mut [bool]) {
        /// Points whose winding numbers are held at a time.
        const CHUNK: usize = 256;
        assert_eq!(points.len(), inside.len(), "as many answers as points");
        let mut buffer = [0; CHUNK];
        for (points, inside) in points.chunks(CHUNK).zip(inside.chunks_mut(CHUNK)) {
            let winding = &mut buffer[..points.len()];
            self.windings(points, winding);
            for (inside, winding) in inside.iter_mut().zip(winding) {
                *inside = *winding != 0;
            }
        }
    }

    /// Whether the triangles of an object form a surface without boundary: whether every edge has as many triangles in one direction
    /// as in the other, so that winding numbers are exact and do not depend on the direction of a ray. `None` if the file was
    /// compiled without the triangles of its source. Vertices at one place are one, also where a deformable object keeps several. The
    /// time is that of sorting the edges.
    ///
    /// # Panics
    /// If `object` is not less than [`Self::object_count`].
    pub fn is_closed(&self, object: u32) -> Option<bool> {
        let view = self.object(object);
        if view.triangles.len() != view.header.triangles as usize {
            return None;
        }
        // Positions are distinct in other objects.
        let vertices = view.is_deformable().then(|| vertices_by_place(view.positions));
        // The edges from lower to higher vertices, and the others, turned round.
        let (mut up, mut down) = (Vec::new(), Vec::new());
        for rows in view.triangles {
            let [a, b, c] =
                vertices.as_ref().map_or(*rows, |vertices| rows.map(|row| vertices[row as usize]));
            for (p, q) in [(a, b), (b, c), (c, a)] {
                let edge = |low: u32, high: u32| u64::from(low) << 32 | u64::from(high);
                match p.cmp(&q) {
                    Ordering::Less => up.push(edge(p, q)),
                    Ordering::Greater => down.push(edge(q, p)),
                    Ordering::Equal => {}
                }
            }
        }
        if up.len() != down.len() {
            return Some(false);
        }
        up.sort_unstable();
        down.sort_unstable();
        Some(up == down)
    }

    /// Stores the winding number of each point.
    fn windings(&self, points: &[[f32; 3]], winding: &mut [i32]) {
        winding.fill(0);
        if self.world().is_none() {
            for object in 0..self.object_count() {
                walk::add_windings(self.view(object), points, winding);
            }
            return;
        }
        for (point, winding) in points.iter().zip(winding) {
            // The boxes at t = 0 are those that contain the point.
            let ray = Ray { origin: *point, tmin: 0.0, direction: [1.0, 0.0, 0.0], tmax: 0.0 };
            self.enumerate_instances(&ray, &mut |entered| {
                let point = entered.object_ray(WorldRay::plain(&ray)).ray.origin;
                walk::add_windings(entered.object, &[point], std::slice::from_mut(winding));
                Some(0.0)
            });
        }
    }
}

/// For each position a number that it shares with those that are equal to it, and with no others.
fn vertices_by_place(positions: &[[f32; 3]]) -> Vec<u32> {
    // The sum has the same bits for zeros of either sign.
    let place = |row: &u32| positions[*row as usize].map(|x| (x + 0.0).to_bits());
    let mut rows: Vec<u32> = (0..positions.len() as u32).collect();
    rows.sort_unstable_by_key(place);
    let mut vertices = vec![0; rows.len()];
    for equal in rows.chunk_by(|a, b| place(a) == place(b)) {
        equal.iter().for_each(|row| vertices[*row as usize] = equal[0]);
    }
    vertices
}
