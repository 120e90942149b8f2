//! Triangles in world space as real numbers: the images of corners of f64 under an f64 transform.
//!
//! Vectors relative to a point are computed in f64, each with a *size*: the max |component|, and
//! for transformed ones the max sum of the |terms| of a component. With u = 2^-53, a component is
//! off by at most 4.01 u times the size: products and differences have one rounding each, and three
//! additions another one each. The bounds below add this for each factor of each product to the
//! roundings of the products and sums themselves.
//!
//! Sizes outside of [`RANGE`] would let products over- or underflow, so nothing is concluded from
//! them: exact arithmetic decides. It has no limits.

use super::vector::{cross, dot, max_norm};
use bth_format::exact::{Dyadic, DyadicVector, dyadic_vector};

/// 32 u: bounds the error of a component of p × q relative to the sizes of p and q: 8.1 u for the
/// roundings of two products, and 2 · 2 · 4.01 u.
pub(crate) const CROSS_ERROR: f64 = 1.0 / (1u64 << 48) as f64;
/// 64 u: the same for p · q, 15 u and 3 · 2 · 4.01 u.
const DOT_ERROR: f64 = 1.0 / (1u64 << 47) as f64;
/// 128 u: the same for (p × q)·r, 50 u and 6 · 3 · 4.01 u.
pub(crate) const VOLUME_ERROR: f64 = 1.0 / (1u64 << 46) as f64;
/// 512 u: the same for (p × q)·(r × s), 150 u and 12 · 4 · 4.01 u.
pub(crate) const WEIGHT_ERROR: f64 = 1.0 / (1u64 << 44) as f64;
/// Products of six sizes in this range are normal numbers.
const RANGE: std::ops::RangeInclusive<f64> =
    1.0 / (1u128 << 127) as f64 / (1u64 << 33) as f64..=(1u128 << 127) as f64 * (1u64 << 33) as f64;

/// Returns true if products of vectors of these sizes have the error bounds of this module.
pub(crate) fn in_range(sizes: &[f64]) -> bool {
    sizes.iter().all(|size| RANGE.contains(size))
}

/// A triangle in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct WideTriangle {
    /// The corners before the transform.
    pub(crate) corners: [[f64; 3]; 3],
    /// The rows of the transform; `None` for the identity.
    pub(crate) rows: Option<[[f64; 4]; 3]>,
}

/// A triangle relative to a point, in f64.
pub(crate) struct WideRelative {
    /// The corners minus the point, and their sizes.
    pub(crate) corner: [[f64; 3]; 3],
    pub(crate) far: [f64; 3],
    /// The edge from each corner to the next, and their sizes.
    pub(crate) edge: [[f64; 3]; 3],
    pub(crate) long: [f64; 3],
}

impl WideTriangle {
    /// The triangle relative to a point. Opposite edges of two triangles that share them are
    /// exactly opposite.
    pub(crate) fn relative(&self, point: [f64; 3]) -> WideRelative {
        let mut relative =
            WideRelative { corner: [[0.0; 3]; 3], far: [0.0; 3], edge: [[0.0; 3]; 3], long: [0.0; 3] };
        for i in 0..3 {
            let (p, q) = (self.corners[i], self.corners[(i + 1) % 3]);
            let edge = [q[0] - p[0], q[1] - p[1], q[2] - p[2]];
            (relative.corner[i], relative.far[i]) = self.transformed(p, point);
            (relative.edge[i], relative.long[i]) = match &self.rows {
                None => (edge, max_norm(edge)),
                Some(rows) => sums(rows.map(|[a, b, c, _]| [a * edge[0], b * edge[1], c * edge[2], 0.0])),
            };
        }
        relative
    }

    /// A corner in world space relative to a point, and its size.
    fn transformed(&self, corner: [f64; 3], point: [f64; 3]) -> ([f64; 3], f64) {
        match &self.rows {
            None => {
                let difference = [0, 1, 2].map(|k| corner[k] - point[k]);
                (difference, max_norm(difference))
            }
            Some(rows) => sums([0, 1, 2].map(|k| {
                let [a, b, c, t] = rows[k];
                [a * corner[0], b * corner[1], c * corner[2], t - point[k]]
            })),
        }
    }

    /// The corners in world space, in f64, and a bound of the error of a coordinate.
    pub(crate) fn in_world(&self) -> ([[f64; 3]; 3], f64) {
        let corners = self.corners.map(|p| self.transformed(p, [0.0; 3]));
        let size = corners.iter().fold(0.0f64, |most, (_, size)| most.max(*size));
        // A coordinate minus 0 is exact; denormal products are off by 2^-1075.
        let error = if self.rows.is_some() { size * CORNER_ERROR + f64::MIN_POSITIVE } else { 0.0 };
        (corners.map(|(corner, _)| corner), error)
    }

    /// The exact corners in world space.
    pub(crate) fn exact(&self) -> [DyadicVector; 3] {
        let Some(rows) = &self.rows else { return self.corners.map(dyadic_vector) };
        self.corners.map(|corner| {
            let p = dyadic_vector(corner);
            rows.map(|row| {
                let [a, b, c, t] = row.map(Dyadic::from);
                &(&(&(&a * &p[0]) + &(&b * &p[1])) + &(&c * &p[2])) + &t
            })
        })
    }
}

/// 5 u: bounds the error of a component relative to its size.
const CORNER_ERROR: f64 = 5.0 / (1u64 << 53) as f64;

/// The sums of terms, and the max sum of their sizes.
#[inline(always)]
fn sums(terms: [[f64; 4]; 3]) -> ([f64; 3], f64) {
    let size = terms.map(|[a, b, c, d]| a.abs() + b.abs() + c.abs() + d.abs());
    (terms.map(|[a, b, c, d]| a + b + c + d), max_norm(size))
}

impl WideRelative {
    /// The normal (b - a) × (c - a), and the product of the sizes of the edges that span it.
    #[inline(always)]
    pub(crate) fn normal(&self) -> ([f64; 3], f64) {
        (cross(self.edge[2], self.edge[0]), self.long[2] * self.long[0])
    }

    /// The sign of normal · (q × r) for the corners q and r opposite of corner i: 1 if the
    /// projection of the point lies on the inner side of their edge, 0 where it is not certain.
    #[inline(always)]
    pub(crate) fn side(&self, i: usize, (normal, size): ([f64; 3], f64)) -> i32 {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let weight = dot(normal, cross(self.corner[j], self.corner[k]));
        certain_sign(weight, WEIGHT_ERROR * size * self.far[j] * self.far[k])
    }

    /// The signs of how far the foot of the perpendicular on the line of an edge lies from its
    /// ends, into the edge; 0 where one is not certain.
    #[inline(always)]
    pub(crate) fn foot(&self, i: usize) -> [i32; 2] {
        let (j, edge, bound) = ((i + 1) % 3, self.edge[i], DOT_ERROR * self.long[i]);
        [
            certain_sign(-dot(edge, self.corner[i]), bound * self.far[i]),
            certain_sign(dot(edge, self.corner[j]), bound * self.far[j]),
        ]
    }
}

/// The sign of a number that is off by at most `bound`; 0 where it is not certain.
#[inline(always)]
pub(crate) fn certain_sign(x: f64, bound: f64) -> i32 {
    i32::from(x > bound) - i32::from(x < -bound)
}
