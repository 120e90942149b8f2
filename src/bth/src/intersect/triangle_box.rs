//! Exact overlap test of a closed triangle and a closed axis-aligned box.
//!
//! Two convex polyhedra are disjoint if and only if a plane separates them that is parallel to a
//! face of one of them or to an edge of each (Akenine-Möller, "Fast 3D Triangle-Box Overlap
//! Testing", JGT 2001): here to a face of the box, to the triangle, or to an edge of the triangle
//! and an axis. In the last case the projections along the axis are a triangle and a rectangle,
//! which a line parallel to an edge of the triangle separates.

use bth_format::exact::{Expansion, side};
use std::cmp::Ordering;

/// Returns true if a closed triangle and a closed box of finite coordinates, with `lower <= upper`,
/// have a point in common.
pub(crate) fn overlaps(lower: [f32; 3], upper: [f32; 3], corners: [[f32; 3]; 3]) -> bool {
    for k in 0..3 {
        if corners.iter().all(|p| p[k] < lower[k]) || corners.iter().all(|p| p[k] > upper[k]) {
            return false;
        }
    }
    if corners.iter().any(|p| (0..3).all(|k| lower[k] <= p[k] && p[k] <= upper[k])) {
        return true;
    }
    let bounds = [lower, upper];
    !(0..3).any(|k| is_separated_along(k, bounds, corners)) && !plane_separates(bounds, corners)
}

/// Returns true if all corners of a box lie on the same side of the triangle's plane.
fn plane_separates(bounds: [[f32; 3]; 2], [a, b, c]: [[f32; 3]; 3]) -> bool {
    let corner = |i: usize| [bounds[i & 1][0], bounds[i >> 1 & 1][1], bounds[i >> 2][2]];
    let first = side(a, b, c, corner(0));
    first != Ordering::Equal && (1..8).all(|i| side(a, b, c, corner(i)) == first)
}

/// Returns true if a line parallel to an edge of the triangle separates the projections along an
/// axis.
fn is_separated_along(axis: usize, bounds: [[f32; 3]; 2], corners: [[f32; 3]; 3]) -> bool {
    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
    let project = |p: [f32; 3]| [p[i], p[j]];
    let rectangle = [0, 1, 2, 3].map(|n| [bounds[n & 1][i], bounds[n >> 1][j]]);
    let triangle = corners.map(project);
    (0..3).any(|n| {
        let (p, q, opposite) = (triangle[n], triangle[(n + 1) % 3], triangle[(n + 2) % 3]);
        // The rectangle must lie beyond the edge and beyond the opposite corner.
        let side = |from: [f32; 2], x: [f32; 2]| cross_sign([p, q], [from, x]);
        [Ordering::Less, Ordering::Greater]
            .into_iter()
            .any(|sign| rectangle.iter().all(|x| side(p, *x) == sign && side(opposite, *x) == sign))
    })
}

/// Bounds the error of a difference of two products relative to their sizes: each product has three
/// relative errors of 2^-53, the difference one more.
const ERROR: f64 = 4.0 * f64::EPSILON;

/// The sign of the vector product of two differences, `(u[1] - u[0]) × (v[1] - v[0])`; exact.
fn cross_sign(u: [[f32; 2]; 2], v: [[f32; 2]; 2]) -> Ordering {
    let wide = |p: [[f32; 2]; 2]| p.map(|x| x.map(f64::from));
    let ([p, q], [r, s]) = (wide(u), wide(v));
    let left = (q[0] - p[0]) * (s[1] - r[1]);
    let right = (q[1] - p[1]) * (s[0] - r[0]);
    let difference = left - right;
    if difference.abs() > ERROR * (left.abs() + right.abs()) {
        return difference.total_cmp(&0.0);
    }
    let mut sum = Expansion::<8>::new();
    for (x, y, sign) in [(q, s, 1.0), (q, r, -1.0), (p, s, -1.0), (p, r, 1.0)] {
        sum.add(sign * (x[0] * y[1]));
        sum.add(-sign * (x[1] * y[0]));
    }
    sum.value().partial_cmp(&0.0).unwrap_or(Ordering::Equal)
}
