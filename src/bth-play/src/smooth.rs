//! Smooth normals of models that have none: at each corner of a triangle the mean of the normals of
//! the triangles around its vertex that are turned from it by at most a crease angle, weighted by
//! their angles there.

use bth_format::object::ObjectView;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Triangles of an object beyond which it stays as it is: facets are smaller than pixels then.
const MOST: usize = 4_000_000;

/// Length of a sum of normals, relative to one of them, below which they cancel out.
const CANCELLED: f64 = 1e-6;

/// For each corner of each triangle its normal; empty for objects that stay as they are.
#[derive(Clone, Debug, Default)]
pub(crate) struct SmoothNormals(Vec<[Packed; 3]>);

/// A direction as the coordinates of a point of an octahedron, unfolded.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Packed([i16; 2]);

impl Packed {
    /// The direction of a vector; z for zero.
    fn new(direction: DVec3) -> Self {
        let direction = if direction == DVec3::ZERO { DVec3::Z } else { direction };
        let p = direction / direction.abs().element_sum();
        let fold = |a: f64, b: f64| if p.z < 0.0 { (1.0 - b.abs()).copysign(a) } else { a };
        Self([fold(p.x, p.y), fold(p.y, p.x)].map(|x| (x * f64::from(i16::MAX)).round() as i16))
    }

    fn direction(self) -> DVec3 {
        let [a, b] = self.0.map(|x| f64::from(x) / f64::from(i16::MAX));
        let z = 1.0 - a.abs() - b.abs();
        let fold = |a: f64, b: f64| if z < 0.0 { (1.0 - b.abs()).copysign(a) } else { a };
        DVec3::new(fold(a, b), fold(b, a), z).normalize()
    }
}

fn to_f64(p: [f32; 3]) -> DVec3 {
    Vec3::from_array(p).as_dvec3()
}

impl SmoothNormals {
    /// The normals of an object for a crease angle in degrees; none at 0, and for an object that
    /// has normals.
    pub(crate) fn new(view: &ObjectView<'_>, crease: f64) -> Self {
        let (triangles, positions) = (view.triangles, view.positions);
        if crease <= 0.0 || !view.normals.is_empty() || triangles.len() > MOST {
            return Self::default();
        }
        let corners_of = |triangle: [u32; 3]| triangle.map(|v| to_f64(positions[v as usize]));
        let face = |triangle: &[u32; 3]| {
            let [a, b, c] = corners_of(*triangle);
            let (e, f) = (b - a, c - a);
            // Scaled first: squares of tiny lengths underflow.
            let scale = e.abs().max_element().max(f.abs().max_element()).max(f64::MIN_POSITIVE);
            (e / scale).cross(f / scale).normalize_or_zero().as_vec3()
        };
        let faces: Vec<Vec3> = triangles.par_iter().map(face).collect();
        // For each vertex the range of its triangles in `around`.
        let mut ends = vec![0u32; positions.len() + 1];
        triangles.as_flattened().iter().for_each(|v| ends[*v as usize + 1] += 1);
        (1..ends.len()).for_each(|v| ends[v] += ends[v - 1]);
        let mut around = vec![0u32; 3 * triangles.len()];
        let mut next = ends.clone();
        for (row, v) in triangles.as_flattened().iter().enumerate() {
            around[next[*v as usize] as usize] = row as u32;
            next[*v as usize] += 1;
        }
        let cosine = crease.to_radians().cos() as f32;
        let normal = |triangle: usize, v: u32| {
            let own = faces[triangle];
            let mut sum = DVec3::ZERO;
            for row in &around[ends[v as usize] as usize..ends[v as usize + 1] as usize] {
                let (other, corner) = ((row / 3) as usize, (row % 3) as usize);
                if faces[other].dot(own) >= cosine {
                    let points = corners_of(triangles[other]);
                    let [e, f] = [1, 2].map(|k| points[(corner + k) % 3] - points[corner]);
                    sum += faces[other].as_dvec3() * e.angle_between(f);
                }
            }
            Packed::new(if sum.is_finite() && sum.length() > CANCELLED { sum } else { own.as_dvec3() })
        };
        let rows = triangles.par_iter().enumerate();
        Self(rows.map(|(row, triangle)| triangle.map(|v| normal(row, v))).collect())
    }

    /// The interpolated normal in the space of the object, not unit; `None` where the object stays
    /// as it is.
    pub(crate) fn at(&self, triangle: u32, u: f32, v: f32) -> Option<DVec3> {
        let [a, b, c] = self.0.get(triangle as usize)?.map(Packed::direction);
        let (u, v) = (f64::from(u), f64::from(v));
        Some(a * (1.0 - u - v) + b * u + c * v)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_survive_packing() {
        for direction in crate::sampling::fibonacci_sphere(5000) {
            assert!(Packed::new(direction).direction().angle_between(direction) < 1e-4, "{direction}");
        }
    }
}
