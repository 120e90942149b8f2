//! Triangulation of single polygons by clipping ears.

use crate::corner_grid::CornerGrid;
use crate::error::Result;
use crate::monitor::Monitor;
use crate::polygon::{area_vector, fan};
use robust::{Coord, orient2d};
use std::collections::VecDeque;

/// Corners that are tried between two looks at whether the user cancelled.
const CHECKED: u64 = 1024;

/// Returns triangles of numbers of a polygon's corners. They are turned as the polygon is, and none
/// is turned over: they cover each point as often as the outline runs around it, so a polygon that
/// does not cross itself is covered once. Returns `None` if there are no such triangles: the
/// outline runs around something the other way, or the polygon is so far from flat that its
/// projection does.
///
/// The polygon is projected along the axis that is nearest to its normal, which rounds nothing.
/// There an ear, a convex corner whose triangle holds no other corner, is clipped until three
/// corners are left (Meisters, "Polygons have ears", 1975). Predicates are exact. All corners stay,
/// also on straight lines, so no gaps open between neighbours. There are two triangles fewer than
/// corners, as in a fan: where corners come twice in a row, some have no area. An outline may run
/// along an edge and back, as it does to reach a hole. A polygon of n corners takes about n steps
/// where ears are small, and n² where they are as long as the polygon.
///
/// # Errors
/// Cancellation.
pub(super) fn clip_ears<T: Into<f64> + Copy>(
    corners: &[[T; 3]],
    monitor: &dyn Monitor,
) -> Result<Option<Vec<[u32; 3]>>> {
    let mut outline = Outline::new(corners);
    let mut triangles = Vec::with_capacity(corners.len() - 2);
    let mut next: VecDeque<u32> = outline.remaining().collect();
    let mut waiting = vec![1u32; corners.len()];
    let (mut tried, mut clipped) = (0u64, 0u64);
    while outline.count > 3 {
        let Some(corner) = next.pop_front() else {
            // What kept a corner from being an ear may be gone.
            if std::mem::take(&mut clipped) == 0 {
                break;
            }
            next = outline.remaining().collect();
            next.iter().for_each(|corner| waiting[*corner as usize] += 1);
            continue;
        };
        tried += 1;
        if tried % CHECKED == 0 {
            monitor.check()?;
        }
        // A corner next to an ear waits until the others have been tried, since triangles that
        // share a corner become thin.
        waiting[corner as usize] -= 1;
        if waiting[corner as usize] > 0 || outline.is_gone(corner) || !outline.is_ear(corner) {
            continue;
        }
        let [before, behind] = outline.neighbours(corner);
        triangles.push([before, corner, behind]);
        outline.clip(corner);
        clipped += 1;
        for corner in [before, behind] {
            waiting[corner as usize] += 1;
            next.push_back(corner);
        }
    }
    // Three corners, or more on a line, where the outline runs to another part and back.
    let rest: Vec<u32> = outline.remaining().collect();
    let ears = triangles.len();
    fan(&mut triangles, &rest);
    let covers = triangles[ears..].iter().all(|[a, b, c]| outline.turn(*a, *b, *c) >= 0.0);
    Ok(covers.then_some(triangles))
}

/// What is left of a polygon in the plane, counterclockwise as a whole.
struct Outline {
    points: Vec<[f64; 2]>,
    /// The corners before and behind each corner; of one that is gone, itself.
    neighbours: Vec<[u32; 2]>,
    /// Number of corners that are left.
    count: usize,
    /// Corners that are left and not convex.
    hollow: CornerGrid,
}

impl Outline {
    /// The projection of a polygon of three corners or more.
    fn new<T: Into<f64> + Copy>(corners: &[[T; 3]]) -> Self {
        let normal = area_vector(corners);
        let axis = normal.abs().max_position();
        let [x, y] = if normal[axis] > 0.0 { [1, 2] } else { [2, 1] }.map(|k| (axis + k) % 3);
        let points: Vec<_> = corners.iter().map(|p| [x, y].map(|k| p[k].into())).collect();
        let count = points.len() as u32;
        let around = |corner: u32| [(corner + count - 1) % count, (corner + 1) % count];
        let neighbours = (0..count).map(around).collect();
        let hollow = CornerGrid::new(&points);
        let mut outline = Self { points, neighbours, count: count as usize, hollow };
        (0..count).for_each(|corner| outline.note(corner));
        outline
    }

    fn point(&self, corner: u32) -> [f64; 2] {
        self.points[corner as usize]
    }

    fn neighbours(&self, corner: u32) -> [u32; 2] {
        self.neighbours[corner as usize]
    }

    fn is_gone(&self, corner: u32) -> bool {
        self.neighbours(corner)[0] == corner
    }

    /// The corners that are left, in order.
    fn remaining(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.points.len() as u32).filter(|corner| !self.is_gone(*corner))
    }

    fn clip(&mut self, corner: u32) {
        let [before, behind] = self.neighbours(corner);
        self.neighbours[before as usize][1] = behind;
        self.neighbours[behind as usize][0] = before;
        self.neighbours[corner as usize] = [corner; 2];
        self.count -= 1;
        [before, corner, behind].into_iter().for_each(|corner| self.note(corner));
    }

    /// Keeps the grid to corners that are left and not convex.
    fn note(&mut self, corner: u32) {
        let is_hollow = !self.is_gone(corner) && !self.is_convex(corner);
        self.hollow.set(corner, self.point(corner), is_hollow);
    }

    /// Positive where the corners are counterclockwise, 0 on a line; the sign is exact.
    fn turn(&self, a: u32, b: u32, c: u32) -> f64 {
        let [a, b, c] = [a, b, c].map(|corner| self.point(corner)).map(|[x, y]| Coord { x, y });
        orient2d(a, b, c)
    }

    fn is_convex(&self, corner: u32) -> bool {
        let [before, behind] = self.neighbours(corner);
        self.turn(before, corner, behind) > 0.0
    }

    /// Returns true if a corner is convex, and no other corner is in the triangle with its
    /// neighbours or on its border. Only corners that are not convex can be, and those at the same
    /// points do not count: there the outline touches itself. Two of the three at one point are an
    /// ear without area.
    fn is_ear(&self, corner: u32) -> bool {
        let [before, behind] = self.neighbours(corner);
        let triangle = [before, corner, behind].map(|corner| self.point(corner));
        let [a, b, c] = triangle;
        if a == b || b == c || c == a {
            return true;
        }
        if !self.is_convex(corner) {
            return false;
        }
        let blocks = |other: u32| {
            let inside = || {
                let sides = [(before, corner), (corner, behind), (behind, before)];
                sides.iter().all(|(from, to)| self.turn(*from, *to, other) >= 0.0)
            };
            !triangle.contains(&self.point(other)) && inside()
        };
        !self.hollow.near(&triangle).any(blocks)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monitor::Silent;
    use num_rational::BigRational;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    fn split(corners: &[[f32; 3]]) -> Option<Vec<[u32; 3]>> {
        clip_ears(corners, &Silent).unwrap()
    }

    /// Twice the area of a polygon of the plane, exactly.
    fn area(corners: &[[f32; 2]]) -> BigRational {
        let exact = |p: [f32; 2]| p.map(|x| BigRational::from_float(x).unwrap());
        let sides = corners.iter().zip(corners.iter().cycle().skip(1));
        sides.map(|(a, b)| (exact(*a), exact(*b))).map(|([ax, ay], [bx, by])| ax * by - bx * ay).sum()
    }

    /// Checks triangles by the definition: none is turned over, their areas add up to the
    /// polygon's, and each side of the polygon is the side of one triangle. Each other side is
    /// shared by two triangles that run along it in opposite directions. Then they cover the
    /// polygon, and nothing twice.
    #[track_caller]
    fn assert_covers(corners: &[[f32; 2]], triangles: &[[u32; 3]]) {
        assert_eq!(open_sides(corners.len(), triangles, |corner| corner), [[0; 2]; 0]);
        assert_covers_points(corners, triangles);
    }

    /// As above, where it does not matter which of the corners at a point a triangle has.
    #[track_caller]
    fn assert_covers_points(corners: &[[f32; 2]], triangles: &[[u32; 3]]) {
        assert_eq!(triangles.len(), corners.len() - 2);
        let sign = area(corners);
        let mut sum = BigRational::from_integer(0.into());
        for triangle in triangles {
            let part = area(&triangle.map(|corner| corners[corner as usize]));
            assert!(&part * &sign >= BigRational::from_integer(0.into()), "{triangle:?} is turned over");
            sum += part;
        }
        assert_eq!(sum, sign);
        let point = |corner: u32| corners.iter().position(|p| *p == corners[corner as usize]).unwrap() as u32;
        assert_eq!(open_sides(corners.len(), triangles, point), [[0; 2]; 0]);
    }

    /// Returns sides of triangles without a counterpart in another triangle or in the outline, and
    /// sides of the outline without one. Corners are equal if `name` gives them one name.
    fn open_sides(count: usize, triangles: &[[u32; 3]], name: impl Fn(u32) -> u32) -> Vec<[u32; 2]> {
        let mut sides = BTreeMap::new();
        let mut add = |from: u32, to: u32, times: i32| {
            let (from, to) = (name(from), name(to));
            *sides.entry([from, to]).or_insert(0) += times;
            *sides.entry([to, from]).or_insert(0) -= times;
        };
        for [a, b, c] in triangles {
            [(a, b), (b, c), (c, a)].into_iter().for_each(|(from, to)| add(*from, *to, 1));
        }
        (0..count).for_each(|k| add(k as u32, ((k + 1) % count) as u32, -1));
        sides
            .into_iter()
            .filter(|([from, to], times)| *times > 0 && from != to)
            .map(|(side, _)| side)
            .collect()
    }

    /// Polygons in several planes and at several scales, in either direction and from each corner.
    #[track_caller]
    fn assert_split(corners: &[[f32; 2]], assert_covers: fn(&[[f32; 2]], &[[u32; 3]])) {
        for scale in [0, -140, 100].map(|exponent: i32| f64::from(exponent).exp2()) {
            let corners: Vec<_> = corners.iter().map(|p| p.map(|x| (f64::from(x) * scale) as f32)).collect();
            for first in 0..corners.len() {
                let mut corners = corners.clone();
                corners.rotate_left(first);
                for _ in 0..2 {
                    corners.reverse();
                    for lift in [|_, _| 0.0, |x: f32, y: f32| 0.5 * x - 0.25 * y] {
                        for axes in [[0, 1, 2], [1, 2, 0], [2, 1, 0]] {
                            let place = |p: &[f32; 2]| {
                                let mut q = [0.0; 3];
                                (q[axes[0]], q[axes[1]], q[axes[2]]) = (p[0], p[1], lift(p[0], p[1]));
                                q
                            };
                            let placed: Vec<_> = corners.iter().map(place).collect();
                            assert_covers(&corners, &split(&placed).unwrap());
                        }
                    }
                }
            }
        }
    }

    /// Corners of a polygon, each as the digits of x and y.
    fn outline(digits: &str) -> Vec<[f32; 2]> {
        digits.split(' ').map(|pair| [0, 1].map(|k| f32::from(pair.as_bytes()[k] - b'0'))).collect()
    }

    #[test]
    fn concave_polygons_are_covered() {
        assert_split(&outline("01 20 11 22"), assert_covers);
        assert_split(&outline("00 30 31 11 12 32 33 03"), assert_covers);
    }

    #[test]
    fn corners_on_straight_lines_and_twice_in_a_row_are_kept() {
        assert_split(&outline("00 10 20 30 33 23 21 01"), assert_covers);
        assert_split(&outline("01 20 20 11 11 22"), assert_covers_points);
    }

    #[test]
    fn an_outline_may_reach_holes_and_run_back() {
        assert_split(&outline("00 40 44 04 00 11 13 33 31 11"), assert_covers);
        // Two squares that share a corner.
        assert_split(&outline("00 10 11 21 22 12 11 01"), assert_covers_points);
    }

    #[test]
    fn outlines_that_touch_themselves_are_covered() {
        // A corner on a side; then a square twice around, which is covered twice.
        assert_split(&outline("00 40 44 20 04"), assert_covers_points);
        assert_split(&outline("00 10 11 01 00 10 11 01"), assert_covers_points);
    }

    #[test]
    fn outlines_that_run_around_something_the_other_way_are_refused() {
        for bow_tie in ["00 33 30 02", "00 20 11 13 33 31 11 02"] {
            let corners: Vec<_> = outline(bow_tie).iter().map(|[x, y]| [*x, *y, 0.0]).collect();
            assert_eq!(split(&corners), None);
        }
    }

    #[test]
    fn large_polygons_can_be_cancelled() {
        struct Cancelled;
        impl Monitor for Cancelled {
            fn cancelled(&self) -> bool {
                true
            }
        }
        let comb = |k: u16| [f32::from(k), f32::from(k % 2), 0.0];
        let corners: Vec<_> =
            (0..4000).rev().map(comb).chain([[0.0, -1.0, 0.0], [4000.0, -1.0, 0.0]]).collect();
        assert!(split(&corners).is_some());
        assert!(matches!(clip_ears(&corners, &Cancelled), Err(crate::error::Error::Cancelled)));
    }

    /// Returns true if sides touch in common corners only.
    fn is_simple(corners: &[[i32; 2]]) -> bool {
        let turn = |a: [i32; 2], b: [i32; 2], c: [i32; 2]| {
            ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).signum()
        };
        let on = |a: [i32; 2], b: [i32; 2], c: [i32; 2]| {
            turn(a, b, c) == 0
                && [0, 1].iter().all(|k| a[*k].min(b[*k]) <= c[*k] && c[*k] <= a[*k].max(b[*k]))
        };
        let side = |k: usize| (corners[k], corners[(k + 1) % corners.len()]);
        let pairs = (0..corners.len()).flat_map(|k| (0..k).map(move |other| (other, k)));
        pairs.into_iter().all(|(other, k)| {
            let ((a, b), (c, d)) = (side(other), side(k));
            if b == c && k == other + 1 {
                return !on(a, b, d) && !on(c, d, a) && a != b;
            }
            if d == a && (k + 1) % corners.len() == other {
                return !on(a, b, c) && !on(c, d, b);
            }
            let touch = on(a, b, c) || on(a, b, d) || on(c, d, a) || on(c, d, b);
            !touch && (turn(a, b, c) == turn(a, b, d) || turn(c, d, a) == turn(c, d, b))
        })
    }

    proptest! {
        /// Corners around a point at any distances make a polygon that does not cross itself.
        #[test]
        fn stars_are_covered(radii in prop::collection::vec(1u8..20, 4..40), tilt in -3i8..=3) {
            let count = radii.len() as f32;
            let corner = |(k, r): (usize, &u8)| {
                let (y, x) = (std::f32::consts::TAU * k as f32 / count).sin_cos();
                [x * f32::from(*r), y * f32::from(*r)]
            };
            let corners: Vec<_> = radii.iter().enumerate().map(corner).collect();
            let placed: Vec<_> = corners.iter().map(|[x, y]| [*x, *y, f32::from(tilt) * 0.3 * x]).collect();
            assert_covers(&corners, &split(&placed).unwrap());
        }

        /// Any corners: triangles cover the polygon, or `None` is returned, only for outlines that
        /// touch or cross themselves.
        #[test]
        fn polygons_are_covered_or_refused(corners in prop::collection::vec([0u8..6, 0u8..6], 4..9)) {
            let simple = is_simple(&corners.iter().map(|p| p.map(i32::from)).collect::<Vec<_>>());
            let corners: Vec<_> = corners.iter().map(|p| p.map(f32::from)).collect();
            let placed: Vec<_> = corners.iter().map(|[x, y]| [*x, *y, 0.0]).collect();
            match split(&placed) {
                Some(triangles) if simple => assert_covers(&corners, &triangles),
                Some(triangles) => assert_covers_points(&corners, &triangles),
                None => prop_assert!(!simple),
            }
        }
    }
}
