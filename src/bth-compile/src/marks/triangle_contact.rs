//! Whether two triangles are in bad contact, decided exactly.

use super::coplanar::on_same_side;
use super::segment_triangle::{orient3d, same_strict_sign, segment_meets_triangle};
use super::separation::fans_are_apart;

type Point = [f32; 3];

/// A triangle of non-zero area, by corners and by welded vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// Positions of the corners.
    pub corners: [[f32; 3]; 3],
    /// Welded vertex of each corner: equal exactly where the positions are.
    pub vertices: [u32; 3],
}

/// Whether two triangles of non-zero area touch beyond the vertices that they share (see the
/// module's definition). Exact for all finite coordinates: products of three differences of f32
/// neither overflow nor underflow f64.
pub fn in_bad_contact(a: &Triangle, b: &Triangle) -> bool {
    let (mut shared_a, mut shared_b) = (0u32, 0u32);
    for i in 0..3 {
        for j in 0..3 {
            if a.vertices[i] == b.vertices[j] {
                shared_a |= 1 << i;
                shared_b |= 1 << j;
            }
        }
    }
    match shared_a.count_ones() {
        0 => disjoint_meet(a.corners, b.corners),
        1 => {
            let a = from_corner(a.corners, shared_a.trailing_zeros());
            let b = from_corner(b.corners, shared_b.trailing_zeros());
            vertex_neighbours_meet(a, b)
        }
        2 => {
            // Rotated so that the corner that is not shared comes first.
            let a = from_corner(a.corners, (!shared_a).trailing_zeros());
            let b = from_corner(b.corners, (!shared_b).trailing_zeros());
            orient3d(a[1], a[2], a[0], b[0]) == 0.0 && on_same_side(a[1], a[2], a[0], b[0])
        }
        _ => true,
    }
}

#[inline]
fn from_corner(c: [Point; 3], first: u32) -> [Point; 3] {
    let i = first as usize;
    [c[i], c[(i + 1) % 3], c[(i + 2) % 3]]
}

/// Triangles without a common vertex: if they meet, an edge of one meets the other.
fn disjoint_meet(a: [Point; 3], b: [Point; 3]) -> bool {
    let b_sides = b.map(|p| orient3d(a[0], a[1], a[2], p));
    if all_strictly_on_one_side(b_sides) {
        return false;
    }
    let a_sides = a.map(|p| orient3d(b[0], b[1], b[2], p));
    if all_strictly_on_one_side(a_sides) {
        return false;
    }
    [(0, 1), (1, 2), (2, 0)].into_iter().any(|(i, j)| {
        segment_meets_triangle(b[i], b[j], b_sides[i], b_sides[j], a)
            || segment_meets_triangle(a[i], a[j], a_sides[i], a_sides[j], b)
    })
}

fn all_strictly_on_one_side(s: [f64; 3]) -> bool {
    same_strict_sign(s[0], s[1]) && same_strict_sign(s[0], s[2])
}

/// Triangles that share their first corner: a second common point lies on a ray from that corner
/// within both, which leaves one of them through the opposite edge while still in the other.
fn vertex_neighbours_meet(a: [Point; 3], b: [Point; 3]) -> bool {
    if fans_are_apart(a[0], [a[1], a[2]], [b[1], b[2]]) {
        return false;
    }
    let b_sides = [b[1], b[2]].map(|p| orient3d(a[0], a[1], a[2], p));
    if same_strict_sign(b_sides[0], b_sides[1]) {
        return false;
    }
    let a_sides = [a[1], a[2]].map(|p| orient3d(b[0], b[1], b[2], p));
    if same_strict_sign(a_sides[0], a_sides[1]) {
        return false;
    }
    segment_meets_triangle(b[1], b[2], b_sides[0], b_sides[1], a)
        || segment_meets_triangle(a[1], a[2], a_sides[0], a_sides[1], b)
}
