//! Ray-triangle tests in single precision, as most tracers have them: the rivals of exact decisions. They lose rays at edges
//! and vertices, and their t has errors.

use bth::rays::Ray;

/// Where a ray meets a triangle: the hit is at `t`, and at `a + u (b - a) + v (c - a)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intersection {
    /// Distance in lengths of the direction.
    pub t: f32,
    /// Weight of the second corner.
    pub u: f32,
    /// Weight of the third corner.
    pub v: f32,
}

/// a - b.
pub fn sub(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// The dot product.
pub fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The cross product.
pub fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The test of Möller and Trumbore 1997 ("Fast, minimum storage ray/triangle intersection"), for t from `tmin` to `tmax`.
#[inline(always)]
pub fn moller_trumbore(ray: &Ray, [a, b, c]: [[f32; 3]; 3], tmax: f32) -> Option<Intersection> {
    let (e1, e2) = (sub(b, a), sub(c, a));
    let p = cross(ray.direction, e2);
    let determinant = dot(e1, p);
    if determinant == 0.0 {
        return None;
    }
    let inverse = 1.0 / determinant;
    let from = sub(ray.origin, a);
    let u = dot(from, p) * inverse;
    if !(0.0..=1.0).contains(&u) {
        return None;
    }
    let q = cross(from, e1);
    let v = dot(ray.direction, q) * inverse;
    if v < 0.0 || u + v > 1.0 {
        return None;
    }
    let t = dot(e2, q) * inverse;
    (t >= ray.tmin && t <= tmax).then_some(Intersection { t, u, v })
}

/// The part of the watertight test that depends on the ray only.
#[derive(Clone, Copy, Debug)]
pub struct Watertight {
    origin: [f32; 3],
    tmin: f32,
    /// The axes x, y and z of the sheared space; z is the axis of the largest component of the direction.
    axes: [usize; 3],
    shear: [f32; 3],
}

impl Watertight {
    /// Prepares a ray.
    pub fn new(ray: &Ray) -> Watertight {
        let size = ray.direction.map(f32::abs);
        let z = (0..3).max_by(|i, j| size[*i].total_cmp(&size[*j])).unwrap_or(0);
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        // Keeps the winding of triangles.
        if ray.direction[z] < 0.0 {
            (x, y) = (y, x);
        }
        let direction = ray.direction;
        let shear = [direction[x] / direction[z], direction[y] / direction[z], 1.0 / direction[z]];
        Watertight { origin: ray.origin, tmin: ray.tmin, axes: [x, y, z], shear }
    }

    /// The test of Woop, Benthin and Wald 2013 ("Watertight ray/triangle intersection"), for t from `tmin` to `tmax`.
    #[inline(always)]
    pub fn intersect(&self, corners: [[f32; 3]; 3], tmax: f32) -> Option<Intersection> {
        let ([x, y, z], [shear_x, shear_y, shear_z]) = (self.axes, self.shear);
        let corners = corners.map(|corner| sub(corner, self.origin));
        let [a, b, c] = corners.map(|p| [p[x] - shear_x * p[z], p[y] - shear_y * p[z]]);
        let side = |p: [f32; 2], q: [f32; 2]| p[0] * q[1] - p[1] * q[0];
        let mut edges = [side(c, b), side(a, c), side(b, a)];
        if edges.contains(&0.0) {
            let [a, b, c] = [a, b, c].map(|p| p.map(f64::from));
            let side = |p: [f64; 2], q: [f64; 2]| (p[0] * q[1] - p[1] * q[0]) as f32;
            edges = [side(c, b), side(a, c), side(b, a)];
        }
        if edges.iter().any(|e| *e < 0.0) && edges.iter().any(|e| *e > 0.0) {
            return None;
        }
        let determinant = edges[0] + edges[1] + edges[2];
        if determinant == 0.0 {
            return None;
        }
        let depths = corners.map(|p| shear_z * p[z]);
        let t = dot(edges, depths) / determinant;
        let intersection = Intersection { t, u: edges[1] / determinant, v: edges[2] / determinant };
        (t >= self.tmin && t <= tmax).then_some(intersection)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::on_sphere;
    use bth_random::Rng;

    #[test]
    fn both_tests_agree_with_exact_arithmetic_away_from_edges() {
        let mut rng = Rng::new(5);
        let mut hits = 0;
        for _ in 0..20_000 {
            let corners: [[f32; 3]; 3] = [(); 3].map(|()| [(); 3].map(|()| rng.unit_f32() - 0.5));
            let origin = on_sphere(&mut rng).to_array().map(|x| x as f32);
            let target = [(); 3].map(|()| 0.5 * (rng.unit_f32() - 0.5));
            let ray = Ray::new(origin, sub(target, origin));
            let exact = bth_oracle::intersection(&ray, corners).map(|at| bth_oracle::to_f64(&at.t));
            let exact = exact.filter(|t| *t >= 0.0);
            let found = [
                moller_trumbore(&ray, corners, ray.tmax),
                Watertight::new(&ray).intersect(corners, ray.tmax),
            ];
            for found in found {
                let near_edge = found.is_some_and(|h| h.u < 1e-3 || h.v < 1e-3 || h.u + h.v > 0.999);
                if near_edge || exact.is_some() != found.is_some() && exact.is_some() {
                    continue;
                }
                assert_eq!(found.is_some(), exact.is_some(), "{ray:?} {corners:?}");
                if let (Some(found), Some(exact)) = (found, exact) {
                    hits += 1;
                    let normal = cross(sub(corners[1], corners[0]), sub(corners[2], corners[0]));
                    let grazing = dot(normal, ray.direction).abs() < 1e-2 * dot(normal, normal).sqrt();
                    assert!(grazing || (f64::from(found.t) - exact).abs() < 1e-4, "{found:?} for {exact}");
                }
            }
        }
        assert!(hits > 1000, "{hits}");
    }

    #[test]
    fn weights_are_those_of_the_second_and_third_corner() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let ray = Ray { origin: [0.25, 0.5, 2.0], tmin: 0.0, direction: [0.0, 0.0, -1.0], tmax: 9.0 };
        let expected = Some(Intersection { t: 2.0, u: 0.25, v: 0.5 });
        assert_eq!(moller_trumbore(&ray, corners, 9.0), expected);
        assert_eq!(Watertight::new(&ray).intersect(corners, 9.0), expected);
        assert_eq!(moller_trumbore(&ray, corners, 1.5), None);
        assert_eq!(Watertight::new(&ray).intersect(corners, 1.5), None);
    }

    #[test]
    fn a_ray_through_a_shared_edge_hits_one_of_two_triangles_with_the_watertight_test() {
        let mut rng = Rng::new(6);
        for _ in 0..20_000 {
            let [a, b, c, d] = [(); 4].map(|()| [(); 3].map(|()| rng.unit_f32()));
            let share = rng.unit_f32();
            let target: [f32; 3] = std::array::from_fn(|k| a[k] + share * (b[k] - a[k]));
            let origin = on_sphere(&mut rng).to_array().map(|x| 4.0 * x as f32);
            let ray = Ray::new(origin, sub(target, origin));
            let prepared = Watertight::new(&ray);
            let inside = |corners| prepared.intersect(corners, f32::INFINITY).is_some();
            // c and d on either side of the edge as the ray sees it: then the ray crosses one of the triangles.
            let side = |p: [f32; 3]| dot(cross(sub(a, origin), sub(b, origin)), sub(p, origin));
            if (side(c) > 1e-2 && side(d) < -1e-2) || (side(c) < -1e-2 && side(d) > 1e-2) {
                let middle = (0.05..0.95).contains(&share);
                assert!(!middle || inside([a, b, c]) || inside([b, a, d]), "{ray:?}");
            }
        }
    }
}
