//! A ray-triangle test in single precision, as most tracers have it. It loses rays at edges and
//! vertices, and its t has errors.

use bth::rays::Ray;

/// Where a ray hits a triangle: at `t`, and at `a + u (b - a) + v (c - a)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Intersection {
    /// Distance in lengths of the direction.
    pub(crate) t: f32,
    /// Weight of the second corner.
    pub(crate) u: f32,
    /// Weight of the third corner.
    pub(crate) v: f32,
}

/// a - b.
pub(crate) fn sub(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// The dot product.
pub(crate) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The cross product.
pub(crate) fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The test of Möller and Trumbore 1997 ("Fast, minimum storage ray/triangle intersection"), for t
/// from `tmin` to `tmax`.
#[inline(always)]
pub(crate) fn moller_trumbore(ray: &Ray, [a, b, c]: [[f32; 3]; 3], tmax: f32) -> Option<Intersection> {
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
