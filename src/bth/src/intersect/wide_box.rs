//! Exact overlap test of a triangle in world space ([`WideTriangle`]) and a box of f64 coordinates,
//! by the signs of [`super::triangle_box`].

use super::triangle_box::{BoxSigns, decide};
use super::vector::{cross, dot, max_norm, minus};
use super::wide_triangle::{CROSS_ERROR, VOLUME_ERROR, WideTriangle, certain_sign, in_range};
use bth_format::exact::{Dyadic, DyadicVector, dyadic_cross, dyadic_difference, dyadic_dot};
use std::cell::OnceCell;
use std::cmp::Ordering;

/// Returns true if a closed triangle and a closed box of finite coordinates, with `lower <= upper`,
/// have a point in common.
pub(crate) fn overlaps(lower: [f64; 3], upper: [f64; 3], triangle: &WideTriangle) -> bool {
    let (corners, error) = triangle.in_world();
    decide(&Wide { bounds: [lower, upper], triangle, corners, error, exact: OnceCell::new() })
}

/// A box and a triangle.
struct Wide<'a> {
    bounds: [[f64; 3]; 2],
    triangle: &'a WideTriangle,
    /// The corners in world space, and a bound of the error of a coordinate.
    corners: [[f64; 3]; 3],
    error: f64,
    exact: OnceCell<[DyadicVector; 3]>,
}

/// 1 / 2u: a vector whose components are off by `error` before the rounding of a difference, has
/// the max |component| and this factor times `error` as its size ([`super::wide_triangle`]).
const SIZE_OF_ERROR: f64 = (1u64 << 52) as f64;

impl Wide<'_> {
    fn exact(&self) -> &[DyadicVector; 3] {
        self.exact.get_or_init(|| self.triangle.exact())
    }

    /// The size of a difference of two points.
    fn size(&self, difference: [f64; 3]) -> f64 {
        max_norm(difference) + SIZE_OF_ERROR * self.error
    }

    /// The exact sign, unless f64 is certain of it.
    fn sign(&self, value: f64, bound: f64, sizes: &[f64], exact: impl FnOnce() -> Dyadic) -> Ordering {
        match certain_sign(value, bound) {
            0 => exact().sign(),
            _ if !in_range(sizes) => exact().sign(),
            sign => sign.cmp(&0),
        }
    }
}

impl BoxSigns for Wide<'_> {
    fn compare(&self, corner: usize, axis: usize, end: usize) -> Ordering {
        let (x, bound) = (self.corners[corner][axis], self.bounds[end][axis]);
        // Only the difference of unequal numbers is rounded, and `error` has room for that.
        match certain_sign(x - bound, self.error) {
            0 if self.error == 0.0 => Ordering::Equal,
            0 => (&self.exact()[corner][axis] - &Dyadic::from(bound)).sign(),
            sign => sign.cmp(&0),
        }
    }

    fn cross(&self, [i, j]: [usize; 2], [p, q]: [usize; 2], from: usize, [x, y]: [usize; 2]) -> Ordering {
        let plane = |p: [f64; 3]| [p[i], p[j], 0.0];
        let end = [self.bounds[x][i], self.bounds[y][j], 0.0];
        let edge = minus(plane(self.corners[q]), plane(self.corners[p]));
        let to = minus(end, plane(self.corners[from]));
        let sizes = [self.size(edge), self.size(to)];
        self.sign(cross(edge, to)[2], CROSS_ERROR * sizes[0] * sizes[1], &sizes, || {
            let corner = self.exact();
            let edge = dyadic_difference(&corner[q], &corner[p]);
            let [x, y] = [end[0], end[1]].map(Dyadic::from);
            let (x, y) = (&x - &corner[from][i], &y - &corner[from][j]);
            &(&edge[i] * &y) - &(&edge[j] * &x)
        })
    }

    fn side(&self, [x, y, z]: [usize; 3]) -> Ordering {
        let end = [self.bounds[x][0], self.bounds[y][1], self.bounds[z][2]];
        let [a, b, c] = self.corners;
        let [ab, ac, to] = [minus(b, a), minus(c, a), minus(end, a)];
        let sizes = [ab, ac, to].map(|v| self.size(v));
        let volume = dot(cross(ab, ac), to);
        self.sign(volume, VOLUME_ERROR * sizes[0] * sizes[1] * sizes[2], &sizes, || {
            let [a, b, c] = self.exact();
            let to = dyadic_difference(&end.map(Dyadic::from), a);
            dyadic_dot(&dyadic_cross(&dyadic_difference(b, a), &dyadic_difference(c, a)), &to)
        })
    }
}
