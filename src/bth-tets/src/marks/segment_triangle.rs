//! Exact test of a closed segment against a closed triangle.

use super::Point;
use super::coplanar::segment_meets_coplanar_triangle;
use robust::Coord3D;

/// Sign of the volume of `a`, `b`, `c`, `d`, exactly: positive when `d` lies below the plane of
/// `a`, `b`, `c` seen counter-clockwise (Shewchuk 1997). The value beyond the sign is approximate.
#[inline]
pub(super) fn orient3d(a: Point, b: Point, c: Point, d: Point) -> f64 {
    let coord = |p: Point| Coord3D { x: p[0], y: p[1], z: p[2] };
    robust::orient3d(coord(a), coord(b), coord(c), coord(d))
}

/// Returns true if both values are on the same side of zero, and neither is zero.
#[inline]
pub(super) fn same_strict_sign(x: f64, y: f64) -> bool {
    (x > 0.0 && y > 0.0) || (x < 0.0 && y < 0.0)
}

/// Returns true if the closed segment `p`, `q` touches the closed triangle, which has a non-zero
/// area. `side_p` and `side_q` are the signs of `orient3d(triangle, p)` and
/// `orient3d(triangle, q)`.
pub(super) fn segment_meets_triangle(
    p: Point,
    q: Point,
    side_p: f64,
    side_q: f64,
    triangle: [Point; 3],
) -> bool {
    if same_strict_sign(side_p, side_q) {
        return false;
    }
    if side_p == 0.0 && side_q == 0.0 {
        return segment_meets_coplanar_triangle(p, q, triangle);
    }
    // The line through p and q hits the plane in one point, which lies on the segment; that point
    // is in the triangle unless the line passes on different sides of two edges.
    let [a, b, c] = triangle;
    let u = orient3d(p, q, a, b);
    let v = orient3d(p, q, b, c);
    if (u > 0.0 && v < 0.0) || (u < 0.0 && v > 0.0) {
        return false;
    }
    let w = orient3d(p, q, c, a);
    (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0)
}
