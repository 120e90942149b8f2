//! Decides exactly if two triangles are in bad contact.

use super::Point;
use super::coplanar::on_same_side;
use super::segment_triangle::{orient3d, same_strict_sign, segment_meets_triangle};
use super::separation::fans_are_apart;

/// A triangle of non-zero area, by corners and by welded vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// Positions of the corners.
    pub corners: [[f32; 3]; 3],
    /// Welded vertex of each corner: equal exactly where the positions are.
    pub vertices: [u32; 3],
}

/// Returns true if two triangles of non-zero area touch beyond the vertices that they share (see
/// the module's definition). Exact for all finite coordinates: products of three differences of f32
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
            // The triangles are rotated so that the corner that is not shared comes first.
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

/// Triangles without a common vertex: if they touch, an edge of one touches the other.
fn disjoint_meet(a: [Point; 3], b: [Point; 3]) -> bool {
    let side_of = |t: [Point; 3], p: Point| orient3d(t[0], t[1], t[2], p);
    let b_sides = [side_of(a, b[0]), side_of(a, b[1]), side_of(a, b[2])];
    if all_strictly_on_one_side(b_sides) {
        return false;
    }
    let a_sides = [side_of(b, a[0]), side_of(b, a[1]), side_of(b, a[2])];
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
    let side_of = |t: [Point; 3], p: Point| orient3d(t[0], t[1], t[2], p);
    let b_sides = [side_of(a, b[1]), side_of(a, b[2])];
    if same_strict_sign(b_sides[0], b_sides[1]) {
        return false;
    }
    let a_sides = [side_of(b, a[1]), side_of(b, a[2])];
    if same_strict_sign(a_sides[0], a_sides[1]) {
        return false;
    }
    segment_meets_triangle(b[1], b[2], b_sides[0], b_sides[1], a)
        || segment_meets_triangle(a[1], a[2], a_sides[0], a_sides[1], b)
}

#[cfg(test)]
mod tests {
    use super::super::coplanar::Projection;
    use super::super::oracle::oracle;
    use super::super::testing::planted;
    use super::*;
    use bth_random::Rng;

    /// Two random triangles of non-zero area on a grid of `side`³ points that share the given
    /// number of vertices; `flat` puts them into one plane.
    fn pair(random: &mut Rng, side: u64, shared: usize, flat: bool) -> [Triangle; 2] {
        loop {
            let slope = [random.below(3) as f32 - 1.0, random.below(3) as f32 - 1.0];
            let p: Vec<Point> = (0..6)
                .map(|_| {
                    let [x, y, z] = [0; 3].map(|_: i32| random.below(side) as f32);
                    [x, y, if flat { slope[0] * x + slope[1] * y } else { z }]
                })
                .collect();
            let mut b = [p[3], p[4], p[5]];
            b[..shared].copy_from_slice(&p[..shared]);
            b.rotate_left(random.below(3) as usize);
            let corners = [[p[0], p[1], p[2]], b];
            if corners.iter().any(|&c| Projection::of(c).is_none()) {
                continue;
            }
            let mut seen: Vec<Point> = Vec::new();
            return corners.map(|corners| Triangle {
                corners,
                vertices: corners.map(|p| match seen.iter().position(|&q| q == p) {
                    Some(row) => row as u32,
                    None => {
                        seen.push(p);
                        seen.len() as u32 - 1
                    }
                }),
            });
        }
    }

    #[test]
    fn agrees_with_rational_clipping_for_every_number_of_shared_vertices() {
        let mut random = Rng::new(7);
        for shared in 0..=3 {
            for flat in [false, true] {
                let mut verdicts = [0; 2];
                for k in 0..20_000 {
                    let [a, b] = pair(&mut random, [3, 4, 8][k % 3], shared, flat);
                    let expected = oracle(&a, &b);
                    assert_eq!(in_bad_contact(&a, &b), expected, "{a:?} {b:?}");
                    assert_eq!(in_bad_contact(&b, &a), expected, "swapped: {a:?} {b:?}");
                    verdicts[usize::from(expected)] += 1;
                }
                // Both answers occur, except that duplicates are always in bad contact.
                let always_bad = shared == 3;
                assert!(
                    verdicts[1] > 500 && (always_bad || verdicts[0] > 500),
                    "{shared} {flat} {verdicts:?}"
                );
            }
        }
    }

    #[test]
    fn the_verdict_survives_powers_of_two_and_turns_of_the_axes() {
        let mut random = Rng::new(11);
        for k in 0..4000 {
            let [a, b] = pair(&mut random, 4, k % 3, k % 2 == 0);
            let verdict = in_bad_contact(&a, &b);
            for exponent in [-149, -60, 60, 120] {
                let scale = 2f64.powi(exponent);
                let turn = |t: &Triangle| Triangle {
                    corners: t.corners.map(|[x, y, z]| [y, -z, x].map(|c| (f64::from(c) * scale) as f32)),
                    ..*t
                };
                assert_eq!(in_bad_contact(&turn(&a), &turn(&b)), verdict, "2^{exponent} {a:?} {b:?}");
            }
        }
    }

    #[test]
    fn one_ulp_decides_between_contact_and_gap() {
        // Vertices of the second triangle lie on the plane of the first or one ulp above it; no
        // coordinate plane is parallel to that plane.
        let mut random = Rng::new(13);
        for _ in 0..2000 {
            let [x, y] = [0; 2].map(|_: i32| 1.0 + random.below(1000) as f32 / 1024.0);
            let a = [[0.0, 0.0, 0.0], [8.0, 0.0, 8.0], [0.0, 8.0, 8.0]];
            let on = x + y; // Exact: both are multiples of 2^-10 below 2.
            let b = |z: f32| [[x, y, z], [x, y, 20.0], [x + 1.0, y, 20.0]];
            let test = |b| {
                in_bad_contact(
                    &Triangle { corners: a, vertices: [0, 1, 2] },
                    &Triangle { corners: b, vertices: [3, 4, 5] },
                )
            };
            assert!(test(b(on)) && test(b(on.next_down())) && !test(b(on.next_up())));
        }
    }

    #[test]
    fn rational_clipping_agrees_with_the_planted_list_where_coordinates_are_integers() {
        let mut checked = 0;
        for case in planted() {
            let mesh = &case.mesh;
            let integers = mesh.positions.iter().flatten().all(|x| x.fract() == 0.0 && x.abs() < 1e4);
            if !integers || case.mesh.triangles.iter().any(|t| t[0] == t[1]) {
                continue;
            }
            let t: Vec<Triangle> = (0..mesh.triangles.len() as u32)
                .map(|id| Triangle { corners: mesh.corners(id), vertices: mesh.triangles[id as usize] })
                .filter(|t| Projection::of(t.corners).is_some())
                .collect();
            let pairs = (0..t.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
            assert_eq!(
                pairs.filter(|&(i, j)| oracle(&t[i], &t[j])).count() as u64,
                case.pairs,
                "{}",
                case.name
            );
            checked += 1;
        }
        assert!(checked > 30);
    }
}
