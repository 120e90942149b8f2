//! The crossing rule: whether, and in which direction, a ray crosses a triangle, decided so that
//! each passage of a closed surface counts once.
//!
//! Triangles of a hit ([`super::exact`]) are closed: a ray through an edge hits both triangles at
//! it, and a ray in the plane of a triangle hits none, so numbers of hits say nothing about inside
//! and outside. Here the origin o of the ray is moved by δ = (ε, ε², ε³) for an infinitely small
//! positive ε, which moves the whole line. All answers are given for the moved ray. This is
//! simulation of simplicity (Edelsbrunner and Mücke, "Simulation of Simplicity", ACM Transactions
//! on Graphics 1990) with one moved point: where a function is 0 for o, its sign is the sign of the
//! first coefficient, in the order ε, ε², ε³, that is not 0. All the functions of o below are
//! linear, so these are their partial derivatives along x, y and z.
//!
//! **Sides.** The line passes an edge p→q on the side that the sign of E(p, q) = det[d, p-o, q-o]
//! gives. Its gradient along o is d × (q-p). All of it is exactly antisymmetric in p and q, so two
//! triangles that have an edge in common, in opposite directions, get opposite signs whatever the
//! rounding. E remains 0 only for an edge that is parallel to d, or whose ends are equal. The line
//! crosses the triangle abc if E(b, c), E(c, a) and E(a, b) have the same sign.
//!
//! **Why each passage counts once.** Project along d: a triangle becomes a plane triangle, possibly
//! of no area, an edge a segment or a point, and the moved line a point P that lies on none of the
//! finitely many segments, since for a small enough ε > 0 it avoids the lines through them. A
//! triangle of no projected area has two edges of opposite sides, or an edge with E = 0: its
//! weights sum to its area, 0, so they cannot all have one sign. Hence it is not crossed, which is
//! right, because P does not lie on it. Every other triangle is crossed exactly if P lies in its
//! interior. So the moved line touches no edge and no vertex, and it lies in no plane: it is a line
//! in general position. On a surface in which every edge has as many triangles in one direction as
//! in the other, the signed number of crossings beyond the moved origin is therefore the surface's
//! winding number around it (degree theory), whatever the direction of the ray; its parity is the
//! parity of the number of crossings. Triangles of no area, which files do not hold, would add
//! nothing.
//!
//! **Along the ray.** With n = (b-a)×(c-a), the line crosses the plane at t = V/W for the volume V
//! = (a-o)·n and W = d·n, whose sign equals the sign of the three sides. t is before or after a
//! number s as the sign of V - sW says; its gradient along o is -n, which is not 0 because W is
//! not. So t never equals an end of the ray's range: of two ranges with a common end, each crossing
//! lies in exactly one. For s = 0 this decides on which side of the plane the origin lies.
//!
//! **Exactness.** Signs come from f64 where its error bound allows, else from exact sums
//! ([`bth_format::exact`]). Products have at most four factors of f32, so they lie between 2^-596
//! and 2^520.

use crate::intersect::exact::{Estimate, RATIO_ERROR, estimate};
use crate::intersect::exact_ray::WorldLines;
use crate::intersect::start::ExactStart;
use crate::intersect::start_point::StartPoint;
use crate::intersect::vector::wide;
use crate::rays::Ray;
use bth_format::exact::{EDGE_PARTS, Expansion, VOLUME_PARTS};

/// Bounds the error of a sum of products relative to the sum of their sizes: each product below has
/// at most 10 roundings of half an epsilon.
const ERROR: f64 = 16.0 * f64::EPSILON;

/// Pairs of the axes that follow x, y and z.
const NEXT: [[usize; 2]; 3] = [[1, 2], [2, 0], [0, 1]];

/// The direction in which a ray crosses a triangle: 1 if it enters through the back and leaves
/// through the front, from which the corners are seen counterclockwise, -1 for the reverse, and 0
/// if it does not cross it in the ray's range. Coordinates and direction must be finite; numbers in
/// the range of NaN or in wrong order contain no crossing.
pub(crate) fn crossing(ray: &Ray, corners: [[f32; 3]; 3]) -> i32 {
    let (origin, direction, wide_corners) = (wide(ray.origin), wide(ray.direction), corners.map(wide));
    match estimate(origin, direction, wide_corners) {
        Estimate::Missed => return 0,
        Estimate::Intersects(found) => {
            // The bound of the error of t, and the roundings of these products.
            let error = 2.0 * RATIO_ERROR * found.t.abs();
            let (after, before) =
                (found.t - f64::from(ray.tmin) > error, f64::from(ray.tmax) - found.t > error);
            if after && before {
                return sign(found.weight[2]);
            }
        }
        Estimate::Open(..) => {}
    }
    crossing_by_signs(ray, wide_corners)
}

/// [`crossing`] by the signs of its definition.
#[cold]
#[inline(never)]
fn crossing_by_signs(ray: &Ray, [a, b, c]: [[f64; 3]; 3]) -> i32 {
    let (origin, direction) = (wide(ray.origin), wide(ray.direction));
    let passed = side(origin, direction, b, c);
    if passed == 0 || side(origin, direction, c, a) != passed || side(origin, direction, a, b) != passed {
        return 0;
    }
    let position = |s: f32| order(ray, [a, b, c], s, passed);
    if position(ray.tmin) > 0 && position(ray.tmax) < 0 { passed } else { 0 }
}

/// Like [`crossing`], for a ray that starts on a triangle: crossings at t > 0 of the line through
/// the start itself, up to `tmax`.
pub(crate) fn crossing_from_start(
    ray: &Ray,
    point: &StartPoint,
    start: &ExactStart,
    corners: [[f32; 3]; 3],
) -> i32 {
    let (direction, wide_corners) = (wide(ray.direction), corners.map(wide));
    match estimate(point.origin, direction, wide_corners) {
        Estimate::Missed => 0,
        Estimate::Intersects(found) => {
            let error = 2.0 * RATIO_ERROR * found.t.abs();
            if found.t <= 0.0 || found.t - f64::from(ray.tmax) > error {
                0
            } else if f64::from(ray.tmax) - found.t > error {
                sign(found.weight[2])
            } else {
                start_crossing_by_signs(ray, start, wide_corners)
            }
        }
        Estimate::Open(_, [_, last]) if last <= 0.0 => 0,
        Estimate::Open(..) => start_crossing_by_signs(ray, start, wide_corners),
    }
}

/// [`crossing_from_start`] by the signs of its definition. The gradients along the origin are those
/// of [`side`] and [`order`], since all functions are affine.
#[cold]
#[inline(never)]
fn start_crossing_by_signs(ray: &Ray, start: &ExactStart, corners: [[f64; 3]; 3]) -> i32 {
    let ([a, b, c], d) = (corners, wide(ray.direction));
    let side = |p, q| first_sign(start.edge(d, p, q).value(), side_gradient(d, p, q));
    let passed = side(b, c);
    if passed == 0 || side(c, a) != passed || side(a, b) != passed {
        return 0;
    }
    let volume = start.volume(corners);
    if passed * sign(volume.value()) <= 0 {
        return 0;
    }
    let tmax = f64::from(ray.tmax);
    if !tmax.is_finite() {
        return if tmax > 0.0 { passed } else { 0 };
    }
    let mut determinant = Expansion::<EDGE_PARTS>::new();
    determinant.add_edge(a, d, b, c);
    let beyond = first_sign(start.minus_product(&volume, &determinant, tmax), order_gradient(corners));
    if passed * beyond < 0 { passed } else { 0 }
}

/// Like [`crossing`], for a line in world space and a range of t in the units of its line.
pub(crate) fn crossing_in_world(
    (lines, ray): (&dyn WorldLines, usize),
    [tmin, tmax]: [f64; 2],
    corners: [[f64; 3]; 3],
) -> i32 {
    let (line, from_start) = (lines.line(ray), lines.are_from_starts());
    match estimate(line, line.direction, corners) {
        Estimate::Missed => return 0,
        Estimate::Intersects(found) => {
            let error = 2.0 * RATIO_ERROR * found.t.abs();
            let after = if from_start { found.t > 0.0 } else { found.t - tmin > error };
            if after && tmax - found.t > error {
                return sign(found.weight[2]);
            }
        }
        Estimate::Open(_, [_, last]) if from_start && last <= 0.0 => return 0,
        Estimate::Open(..) => {}
    }
    lines.exact(ray).crossing(corners, [tmin, tmax], from_start)
}

/// The sign of a number that is not NaN.
fn sign(x: f64) -> i32 {
    i32::from(x > 0.0) - i32::from(x < 0.0)
}

/// The side on which the moved line passes the edge p→q: the sign of E(p, q); 0 only where it is 0
/// for all origins.
fn side(o: [f64; 3], d: [f64; 3], p: [f64; 3], q: [f64; 3]) -> i32 {
    let (mut value, mut size) = (0.0, 0.0);
    for (k, [i, j]) in NEXT.into_iter().enumerate() {
        let products = [(p[i] - o[i]) * (q[j] - o[j]), (p[j] - o[j]) * (q[i] - o[i])];
        value += d[k] * (products[0] - products[1]);
        size += d[k].abs() * (products[0].abs() + products[1].abs());
    }
    if value.abs() > ERROR * size {
        return sign(value);
    }
    let mut exact = Expansion::<EDGE_PARTS>::new();
    exact.add_edge(o, d, p, q);
    first_sign(exact.value(), side_gradient(d, p, q))
}

/// The partial derivatives of E(p, q) along the origin.
fn side_gradient(d: [f64; 3], p: [f64; 3], q: [f64; 3]) -> [impl Fn() -> f64; 3] {
    NEXT.map(|[i, j]| {
        move || {
            let mut sum = Expansion::<4>::new();
            for (x, y) in [(d[i], q[j]), (-d[i], p[j]), (-d[j], q[i]), (d[j], p[i])] {
                sum.add(x * y);
            }
            sum.value()
        }
    })
}

/// Returns true if the moved line crosses the plane of a triangle after `s` (1) or before it (-1),
/// given the sign of W, which is not 0. 0 for an `s` of NaN.
fn order(ray: &Ray, corners: [[f64; 3]; 3], s: f32, passed: i32) -> i32 {
    if !s.is_finite() {
        return -sign(s.into());
    }
    let ([a, b, c], s) = (corners, f64::from(s));
    let (o, d) = (wide(ray.origin), wide(ray.direction));
    let (mut value, mut size) = (0.0, 0.0);
    for (k, [i, j]) in NEXT.into_iter().enumerate() {
        let products = [(b[i] - a[i]) * (c[j] - a[j]), (b[j] - a[j]) * (c[i] - a[i])];
        let (offset, moved) = (a[k] - o[k], s * d[k]);
        value += (offset - moved) * (products[0] - products[1]);
        size += (offset.abs() + moved.abs()) * (products[0].abs() + products[1].abs());
    }
    if value.abs() > ERROR * size {
        return passed * sign(value);
    }
    let mut determinant = Expansion::<EDGE_PARTS>::new();
    determinant.add_edge(a, d, b, c);
    let mut exact = Expansion::<{ VOLUME_PARTS + 2 * EDGE_PARTS }>::new();
    exact.add_volume(o, a, b, c);
    exact.add_scaled(&determinant, -s);
    passed * first_sign(exact.value(), order_gradient(corners))
}

/// The partial derivatives of V - sW along the origin.
fn order_gradient([a, b, c]: [[f64; 3]; 3]) -> [impl Fn() -> f64; 3] {
    NEXT.map(|[i, j]| {
        move || {
            // The component of the normal is the sum of the same components of a×b, b×c and c×a.
            let mut sum = Expansion::<6>::new();
            for (p, q) in [(a, b), (b, c), (c, a)] {
                sum.add(p[j] * q[i]);
                sum.add(-p[i] * q[j]);
            }
            sum.value()
        }
    })
}

/// The sign of `value`, or if it is 0 the sign of the first of `gradient` that is not 0.
fn first_sign(value: f64, gradient: [impl Fn() -> f64; 3]) -> i32 {
    let signs = std::iter::once(sign(value)).chain(gradient.iter().map(|slope| sign(slope())));
    signs.into_iter().find(|sign| *sign != 0).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bth_random::Rng;

    /// Fewer rounds under Miri, which takes a thousand times as long.
    const ROUNDS: usize = if cfg!(miri) { 100 } else { 20_000 };

    type Point = [i64; 3];

    /// A number with its coefficients of ε, ε² and ε³.
    type Series = [i128; 4];

    fn lexicographic(series: Series) -> i32 {
        series.into_iter().map(|x| x.signum() as i32).find(|sign| *sign != 0).unwrap_or(0)
    }

    fn minus(p: Point, q: Point) -> Point {
        [0, 1, 2].map(|k| p[k] - q[k])
    }

    fn determinant([a, b, c]: [Point; 3]) -> i128 {
        let [a, b, c] = [a, b, c].map(|p| p.map(i128::from));
        NEXT.into_iter().enumerate().map(|(k, [i, j])| a[k] * (b[i] * c[j] - b[j] * c[i])).sum()
    }

    /// The value of a function that is linear in a point, at `point`, and its changes along the
    /// axes.
    fn series(point: Point, value: impl Fn(Point) -> i128) -> Series {
        let at = value(point);
        let slope = |k: usize| {
            let mut moved = point;
            moved[k] += 1;
            value(moved) - at
        };
        [at, slope(0), slope(1), slope(2)]
    }

    /// The rule in integers, by differences of values instead of the formulas of gradients. The
    /// range is in units of 1/4.
    fn expected(o: Point, d: Point, [a, b, c]: [Point; 3], range: [i64; 2]) -> i32 {
        let side = |p, q| lexicographic(series(o, |o| determinant([d, minus(p, o), minus(q, o)])));
        let sides = [side(b, c), side(c, a), side(a, b)];
        if sides[0] == 0 || sides != [sides[0]; 3] {
            return 0;
        }
        let whole = determinant([d, minus(b, a), minus(c, a)]);
        assert_eq!(whole.signum() as i32, sides[0]);
        let after = |quarters: i64| {
            let value =
                |o| 4 * determinant([minus(a, o), minus(b, o), minus(c, o)]) - i128::from(quarters) * whole;
            lexicographic(series(o, value)) * sides[0]
        };
        if after(range[0]) > 0 && after(range[1]) < 0 { sides[0] } else { 0 }
    }

    #[test]
    fn small_integers_agree_with_the_rule_in_integers() {
        let mut rng = Rng::new(23);
        let (mut crossed, mut degenerate) = (0, 0);
        for round in 0..ROUNDS {
            let range = [2, 4, 40, 1 << 20][round % 4];
            let mut draw = || [(); 3].map(|()| rng.below(2 * range + 1) as i64 - range as i64);
            let (o, corners) = (draw(), [draw(), draw(), draw()]);
            let target = draw();
            let d = if round % 8 < 4 { target } else { minus(corners[round % 3], o) };
            if d == [0; 3] {
                continue;
            }
            let ends = if round % 3 == 0 { [0, 8] } else { [-(round as i64 % 9), round as i64 % 7] };
            // A power of two, which changes no sign.
            let scale = [0, -100, 90, -149][round / 4 % 4];
            let scaled = |p: Point| p.map(|x| (x as f64 * 2f64.powi(scale)) as f32);
            let ray = Ray::new(scaled(o), scaled(d)).with_range(ends[0] as f32 / 4.0, ends[1] as f32 / 4.0);
            let found = crossing(&ray, corners.map(scaled));
            assert_eq!(found, expected(o, d, corners, ends), "round {round}: {ray:?}, {corners:?}");
            let [a, b, c] = corners;
            assert_eq!(found, crossing(&ray, [b, c, a].map(scaled)));
            assert_eq!(found, -crossing(&ray, [b, a, c].map(scaled)));
            crossed += usize::from(found != 0);
            let [a, b, c] = [a, b, c].map(|p| minus(p, o));
            degenerate += usize::from(
                [[d, a, b], [d, b, c], [d, c, a], [a, b, c]].into_iter().any(|m| determinant(m) == 0),
            );
        }
        assert!(
            crossed > ROUNDS / 50 && degenerate > ROUNDS / 4,
            "{crossed} crossed, {degenerate} degenerate"
        );
    }

    /// The faces of a tetrahedron, counterclockwise from outside if it is positive.
    fn faces([a, b, c, d]: [[f32; 3]; 4]) -> [[[f32; 3]; 3]; 4] {
        [[a, c, b], [a, b, d], [b, c, d], [c, a, d]]
    }

    #[test]
    fn a_closed_surface_is_crossed_as_often_in_as_out_and_ranges_add_up() {
        let mut rng = Rng::new(29);
        let (mut passed, mut on) = (0, 0);
        for round in 0..ROUNDS / 4 {
            let range = [1, 2, 5][round % 3];
            let scale = [1.0, 1e-40, 3e37, 1e-20][round / 3 % 4];
            let mut draw = || [(); 3].map(|()| (rng.below(2 * range + 1) as f32 - range as f32) * scale);
            let corners = [draw(), draw(), draw(), draw()];
            let (origin, direction) = (draw(), draw());
            if direction == [0.0; 3] {
                continue;
            }
            let sum = |from: f32, to: f32| {
                let ray = Ray::new(origin, direction).with_range(from, to);
                faces(corners).map(|face| crossing(&ray, face)).iter().sum::<i32>()
            };
            assert_eq!(sum(f32::NEG_INFINITY, f32::INFINITY), 0, "round {round}");
            let ahead = sum(0.0, f32::INFINITY);
            assert_eq!(sum(0.0, 1.0) + sum(1.0, f32::INFINITY), ahead, "round {round}");
            for direction in [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [1.0, 1.0, 1.0], [2.0, -1.0, 3.0]] {
                let ray = Ray::new(origin, direction);
                let winding: i32 = faces(corners).iter().map(|&face| crossing(&ray, face)).sum();
                assert_eq!(winding, ahead, "round {round}: the winding number depends on the direction");
            }
            passed += usize::from(ahead != 0);
            on += usize::from(corners.contains(&origin));
        }
        assert!(passed >= ROUNDS / 1000 && on >= ROUNDS / 100, "{passed} inside, {on} at a corner");
    }

    #[test]
    fn ranges_of_nan_and_empty_ranges_hold_no_crossing() {
        let triangle = [[0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
        let ray = Ray::new([1.0, 1.0, -1.0], [0.0, 0.0, 1.0]);
        assert_eq!(crossing(&ray, triangle), 1);
        for (from, to) in
            [(f32::NAN, 2.0), (0.0, f32::NAN), (1.0, 1.0), (2.0, 0.0), (f32::INFINITY, f32::INFINITY)]
        {
            assert_eq!(crossing(&ray.with_range(from, to), triangle), 0, "{from} to {to}");
        }
        assert_eq!(crossing(&ray.with_range(f32::NEG_INFINITY, f32::INFINITY), triangle), 1);
    }
}
