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
    decide(&Narrow { bounds: [lower, upper], corners })
}

/// The exact signs that decide about a triangle and a box.
pub(super) trait BoxSigns {
    /// Compares a coordinate of a corner with the lower (0) or upper (1) end of the box.
    fn compare(&self, corner: usize, axis: usize, end: usize) -> Ordering;
    /// The sign of the vector product of an edge and the vector from a corner to a corner of the
    /// box, along two axes. The edge is given by its ends, the corner of the box by its two ends.
    fn cross(&self, axes: [usize; 2], edge: [usize; 2], from: usize, ends: [usize; 2]) -> Ordering;
    /// On which side of the triangle's plane a corner of the box lies.
    fn side(&self, ends: [usize; 3]) -> Ordering;
}

/// Returns true if they have a point in common.
#[inline(always)]
pub(super) fn decide(signs: &impl BoxSigns) -> bool {
    for k in 0..3 {
        if (0..3).all(|c| signs.compare(c, k, 0).is_lt()) || (0..3).all(|c| signs.compare(c, k, 1).is_gt()) {
            return false;
        }
    }
    if (0..3).any(|c| (0..3).all(|k| signs.compare(c, k, 0).is_ge() && signs.compare(c, k, 1).is_le())) {
        return true;
    }
    !(0..3).any(|k| is_separated_along(k, signs)) && !plane_separates(signs)
}

/// Returns true if all corners of a box lie on the same side of the triangle's plane.
fn plane_separates(signs: &impl BoxSigns) -> bool {
    let side = |i: usize| signs.side([i & 1, i >> 1 & 1, i >> 2]);
    let first = side(0);
    first != Ordering::Equal && (1..8).all(|i| side(i) == first)
}

/// Returns true if a line parallel to an edge of the triangle separates the projections along an
/// axis.
fn is_separated_along(axis: usize, signs: &impl BoxSigns) -> bool {
    let axes = [(axis + 1) % 3, (axis + 2) % 3];
    (0..3).any(|n| {
        let (p, q, opposite) = (n, (n + 1) % 3, (n + 2) % 3);
        // The rectangle must lie beyond the edge and beyond the opposite corner.
        let side = |from: usize, x: usize| signs.cross(axes, [p, q], from, [x & 1, x >> 1]);
        [Ordering::Less, Ordering::Greater]
            .into_iter()
            .any(|sign| (0..4).all(|x| side(p, x) == sign && side(opposite, x) == sign))
    })
}

/// A box and a triangle of f32 coordinates.
struct Narrow {
    bounds: [[f32; 3]; 2],
    corners: [[f32; 3]; 3],
}

impl BoxSigns for Narrow {
    #[inline(always)]
    fn compare(&self, corner: usize, axis: usize, end: usize) -> Ordering {
        let (x, bound) = (self.corners[corner][axis], self.bounds[end][axis]);
        if x < bound {
            Ordering::Less
        } else if x > bound {
            Ordering::Greater
        } else {
            Ordering::Equal
        }
    }
    #[inline(always)]
    fn cross(&self, [i, j]: [usize; 2], edge: [usize; 2], from: usize, [x, y]: [usize; 2]) -> Ordering {
        let project = |corner: usize| [self.corners[corner][i], self.corners[corner][j]];
        cross_sign(edge.map(project), [project(from), [self.bounds[x][i], self.bounds[y][j]]])
    }
    #[inline(always)]
    fn side(&self, [x, y, z]: [usize; 3]) -> Ordering {
        let [a, b, c] = self.corners;
        side(a, b, c, [self.bounds[x][0], self.bounds[y][1], self.bounds[z][2]])
    }
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
