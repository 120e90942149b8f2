//! Terms of the distance of a point to a triangle as exact sums of products of f32 coordinates, for
//! the few points and triangles for which f64 loses too many digits ([`super::point_triangle`]).

use super::vector::{dot, wide};
use bth_format::exact::{Expansion, VOLUME_PARTS};

/// Parts of a component of a vector product: six products of two numbers, each exact in f64.
const AREA_PARTS: usize = 6;
/// Parts of a scalar product of two vector products.
const WEIGHT_PARTS: usize = 3 * 2 * AREA_PARTS * AREA_PARTS;

/// (q - p) × (r - p).
fn area(p: [f64; 3], q: [f64; 3], r: [f64; 3]) -> [Expansion<AREA_PARTS>; 3] {
    [[1, 2], [2, 0], [0, 1]].map(|[i, j]| {
        let mut sum = Expansion::new();
        for [a, b] in [[p, q], [q, r], [r, p]] {
            sum.add(a[i] * b[j]);
            sum.add(-a[j] * b[i]);
        }
        sum
    })
}

/// The squared length of (q - point) × (r - point); the same bits if q and r are exchanged.
#[cold]
#[inline(never)]
pub(super) fn exact_edge_cross(point: [f32; 3], q: [f32; 3], r: [f32; 3]) -> f64 {
    let (q, r) = if q < r { (q, r) } else { (r, q) };
    let area = area(wide(point), wide(q), wide(r)).map(|sum| sum.value());
    dot(area, area)
}

/// Six times the signed volume of a point and a triangle: det[a - p, b - p, c - p].
#[cold]
#[inline(never)]
pub(super) fn volume(point: [f32; 3], corners: [[f32; 3]; 3]) -> f64 {
    let [a, b, c] = corners.map(wide);
    let mut sum = Expansion::<VOLUME_PARTS>::new();
    sum.add_volume(wide(point), a, b, c);
    sum.value()
}

/// A triangle with its exact normal.
pub(super) struct ExactTriangle {
    corners: [[f64; 3]; 3],
    /// (b - a) × (c - a).
    normal: [Expansion<AREA_PARTS>; 3],
}

impl ExactTriangle {
    #[cold]
    #[inline(never)]
    pub(super) fn new(corners: [[f32; 3]; 3]) -> ExactTriangle {
        let corners = corners.map(wide);
        let [a, b, c] = corners;
        ExactTriangle { corners, normal: area(a, b, c) }
    }

    /// (b - a) × (c - a), each component rounded.
    pub(super) fn normal(&self) -> [f64; 3] {
        let [x, y, z] = &self.normal;
        [x.value(), y.value(), z.value()]
    }

    /// Returns true if the projection of a point to the plane lies in the interior of the triangle:
    /// whether all three barycentric weights are positive.
    #[cold]
    #[inline(never)]
    pub(super) fn projects_inside(&self, point: [f32; 3]) -> bool {
        let [a, b, c] = self.corners;
        [[b, c], [c, a], [a, b]].into_iter().all(|[q, r]| {
            let opposite = area(wide(point), q, r);
            let mut weight = Expansion::<WEIGHT_PARTS>::new();
            for k in 0..3 {
                weight.add_product_of(&self.normal[k], &opposite[k]);
            }
            weight.value() > 0.0
        })
    }
}
