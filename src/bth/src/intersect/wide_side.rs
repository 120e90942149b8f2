//! The crossing rule ([`super::crossing`]) for rays along an axis of an object from a point of
//! world space, decided about real numbers.
//!
//! Let the transform of the instance be p ↦ Lp + T, D = det L and A the adjugate of L. The point w
//! of world space is q = A(w - T) / D in the space of the object, and moving w by (ε, ε², ε³) moves
//! q by the columns of A / D, times ε, ε² and ε³. So Dq and the columns have exact numbers, and the
//! rule is the one for points of world space, whatever the instance: where instances touch, a
//! point is counted in exactly one of them.
//!
//! A ray along the axis k passes the edge from a to b on the side that (a - q) × (b - q) gives
//! along k, and the plane of the triangle after q if (a - q)·n has the sign of the normal n along
//! the ray.

use super::vector::{cross, dot, max_norm, minus};
use super::wide_triangle::{CROSS_ERROR, VOLUME_ERROR, certain_sign, in_range};
use bth_format::exact::{Dyadic, DyadicVector, dyadic_cross, dyadic_difference, dyadic_dot, dyadic_vector};
use std::cell::OnceCell;
use std::cmp::Ordering;

/// A point of world space in the space of an object.
#[derive(Debug)]
pub(crate) struct PointInObject<'a> {
    /// The point, and a bound of the error of each coordinate.
    pub(crate) point: [f64; 3],
    pub(crate) error: f64,
    world: [f64; 3],
    /// The rows of the transform to world space; `None` for the identity.
    rows: Option<&'a [[f64; 4]; 3]>,
    exact: OnceCell<ExactPoint>,
}

#[derive(Debug)]
struct ExactPoint {
    /// The determinant D, and Dq.
    whole: Dyadic,
    point: DyadicVector,
    /// The columns of A.
    moves: [DyadicVector; 3],
}

impl ExactPoint {
    fn new(world: [f64; 3], rows: Option<&[[f64; 4]; 3]>) -> ExactPoint {
        const IDENTITY: [[f64; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
        let rows = *rows.unwrap_or(&IDENTITY);
        let [a, b, c] = rows.map(|[x, y, z, _]| dyadic_vector([x, y, z]));
        let moves = [dyadic_cross(&b, &c), dyadic_cross(&c, &a), dyadic_cross(&a, &b)];
        let relative = dyadic_difference(&dyadic_vector(world), &rows.map(|[.., t]| Dyadic::from(t)));
        let along = |k: usize| dyadic_dot(&[0, 1, 2].map(|j: usize| moves[j][k].clone()), &relative);
        ExactPoint { whole: dyadic_dot(&a, &moves[0]), point: [0, 1, 2].map(along), moves }
    }

    /// D(p - q).
    fn relative(&self, p: &DyadicVector) -> DyadicVector {
        [0, 1, 2].map(|k| &(&p[k] * &self.whole) - &self.point[k])
    }

    /// The sign of `value`, or where it is 0 the sign of the first of its changes along the moves
    /// of q that is not 0, given its changes along the axes.
    fn first_sign(&self, value: &Dyadic, slopes: &DyadicVector) -> i32 {
        let moved = |k: usize| dyadic_dot(slopes, &self.moves[k]).sign() as i32 * self.whole.sign() as i32;
        let signs = std::iter::once(value.sign() as i32).chain((0..3).map(moved));
        signs.into_iter().find(|sign| *sign != 0).unwrap_or(0)
    }
}

impl<'a> PointInObject<'a> {
    pub(crate) fn new(
        world: [f64; 3],
        rows: Option<&'a [[f64; 4]; 3]>,
        point: [f64; 3],
        error: f64,
    ) -> PointInObject<'a> {
        PointInObject { point, error, world, rows, exact: OnceCell::new() }
    }

    fn exact(&self) -> &ExactPoint {
        self.exact.get_or_init(|| ExactPoint::new(self.world, self.rows))
    }

    /// The direction in which a ray from the moved point along an axis crosses a triangle, as
    /// [`super::crossing::crossing`] returns it. `forward` is 1 or -1, the direction of the ray.
    #[inline(never)]
    pub(crate) fn crossing(&self, axis: usize, forward: i32, corners: [[f64; 3]; 3]) -> i32 {
        let axes = [(axis + 1) % 3, (axis + 2) % 3];
        let relative = corners.map(|p| minus(p, self.point));
        // 1 / 4u: components are off by the rounding of the difference and by this part of a size.
        let sizes = relative.map(|p| max_norm(p) + self.error * (1u64 << 51) as f64);
        let is_in_range = in_range(&sizes);
        let side = |p: usize, q: usize| {
            let bound = if is_in_range { CROSS_ERROR * sizes[p] * sizes[q] } else { f64::INFINITY };
            match certain_sign(cross(relative[p], relative[q])[axis], bound) {
                0 => self.exact_side(axes, corners[p], corners[q]),
                sign => sign,
            }
        };
        let passed = side(1, 2);
        if passed == 0 || side(2, 0) != passed || side(0, 1) != passed {
            return 0;
        }
        let [a, b, c] = relative;
        let volume = dot(a, cross(b, c));
        let bound = VOLUME_ERROR * sizes[0] * sizes[1] * sizes[2];
        let ahead = match certain_sign(volume, if is_in_range { bound } else { f64::INFINITY }) {
            0 => self.exact_height(corners),
            sign => sign,
        };
        if ahead == passed * forward { passed * forward } else { 0 }
    }

    /// The sign of (p - q) × (r - q) for the moved point q.
    #[cold]
    fn exact_side(&self, [i, j]: [usize; 2], p: [f64; 3], r: [f64; 3]) -> i32 {
        let (exact, p, r) = (self.exact(), dyadic_vector(p), dyadic_vector(r));
        let mut slopes = [0.0; 3].map(Dyadic::from);
        (slopes[i], slopes[j]) = (&p[j] - &r[j], &r[i] - &p[i]);
        let (p, r) = (exact.relative(&p), exact.relative(&r));
        exact.first_sign(&(&(&p[i] * &r[j]) - &(&p[j] * &r[i])), &slopes)
    }

    /// The sign of (a - q)·n for the moved point q.
    #[cold]
    fn exact_height(&self, corners: [[f64; 3]; 3]) -> i32 {
        let (exact, [a, b, c]) = (self.exact(), corners.map(dyadic_vector));
        let normal = dyadic_cross(&dyadic_difference(&b, &a), &dyadic_difference(&c, &a));
        let height = dyadic_dot(&exact.relative(&a), &normal);
        let height = if exact.whole.sign() == Ordering::Less { -&height } else { height };
        exact.first_sign(&height, &normal.map(|x| -&x))
    }
}
