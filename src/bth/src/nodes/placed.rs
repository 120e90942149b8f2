//! An instance for queries about points: its triangles in world space, and points and bounds of
//! distances in the space of its object, in which the BVH is walked.
//!
//! An affine transform does not preserve distances, so triangles are measured in world space, as
//! real numbers ([`WideTriangle`]). Let L and T be the linear part and the translation of the
//! transform and |M| the spectral norm of a matrix. What lies within the distance d of a point in
//! world space lies within |L⁻¹| d of its image in object space, plus a slack for the rounding of
//! that image.
//!
//! Let A be the inverse that f64 has computed. With R = 1 - AL, L⁻¹ is (1 - R)⁻¹ A. For any norm
//! with |R| < 1 it differs from A by at most |R| / (1 - |R|) |A|, and is at most |A| / (1 - |R|).
//! The max sum of |elements| of a row of R is computed; the spectral norm is at most √3 times that.

use crate::intersect::region_box::RegionBox;
use crate::intersect::vector::{max_norm, minus};
use crate::intersect::wide_side::PointInObject;
use crate::intersect::wide_triangle::WideTriangle;
use crate::nodes::affine::Affine;
use bth_format::object::ObjectView;

/// 16 u: bounds the roundings of a point in object space and of elements of R, relative to the
/// product of the norms of the factors.
const PRODUCT_ERROR: f64 = 1.0 / (1u64 << 49) as f64;
/// 1 + 2^-40: covers roundings of bounds.
const SLACK: f64 = 1.0 + 1.0 / (1u64 << 40) as f64;
/// √3, rounded up.
const ROOT_OF_3: f64 = 1.7321;
/// Max norm of R. Beyond it, all triangles of the instance are tried.
const MAX_RESIDUAL: f64 = 0.25;

/// An instance for a search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedObject {
    /// The transform from object space to world space: rows of four. `None` for the identity.
    rows: Option<[[f64; 4]; 3]>,
    /// A.
    inverse: [[f64; 3]; 3],
    /// Upper bounds of the spectral norm of L⁻¹, and of the rounding of a point in object space
    /// relative to its distance from T (maximum norm).
    norm: f64,
    error: f64,
}

/// A point in object space, for walks through the BVH.
pub(crate) struct NarrowPoint {
    pub(crate) point: [f32; 3],
    /// Upper bound of how far a coordinate is off.
    pub(crate) off: f64,
}

impl NarrowPoint {
    /// Rounds a point whose coordinates are off by at most `error`.
    pub(crate) fn new(point: [f64; 3], error: f64) -> NarrowPoint {
        let narrow = point.map(|x| (x as f32).clamp(f32::MIN, f32::MAX));
        let off = (max_norm(minus(point, narrow.map(f64::from))) + error) * SLACK;
        // Neither are NaN, which an overflow may give.
        let off = if off < f64::INFINITY { off } else { f64::INFINITY };
        NarrowPoint { point: narrow.map(|x| if x.is_nan() { 0.0 } else { x }), off }
    }
}

fn row_norm(rows: &[[f64; 3]; 3]) -> f64 {
    rows.iter().map(|row| row.iter().map(|x| x.abs()).sum()).fold(0.0, f64::max)
}

impl PlacedObject {
    /// An instance in world space.
    pub(crate) fn untransformed() -> PlacedObject {
        PlacedObject { rows: None, inverse: [[0.0; 3]; 3], norm: 1.0, error: 0.0 }
    }

    /// An instance with a transform and the rows of its inverse's linear part.
    pub(crate) fn new(to_world: &Affine, inverse: [[f64; 3]; 3]) -> PlacedObject {
        if *to_world == Affine::IDENTITY {
            return PlacedObject::untransformed();
        }
        let (linear, identity) = (to_world.linear, Affine::IDENTITY.linear);
        let residual = [0, 1, 2].map(|i| {
            [0, 1, 2].map(|k| {
                let product = (0..3).map(|j| inverse[i][j] * linear[j][k]).sum::<f64>();
                identity[i][k] - product
            })
        });
        let size = row_norm(&inverse);
        let residual = row_norm(&residual) + PRODUCT_ERROR * size * row_norm(&linear);
        let (mut norm, mut error) = (f64::INFINITY, f64::INFINITY);
        if residual < MAX_RESIDUAL {
            norm = spectral_norm(&inverse) / (1.0 - ROOT_OF_3 * residual) * (1.0 + PRODUCT_ERROR);
            error = size * (residual / (1.0 - residual) + PRODUCT_ERROR);
        }
        PlacedObject { rows: Some(to_world.rows()), inverse, norm, error }
    }

    /// A point of world space in the space of the object's source.
    pub(crate) fn point(&self, world: [f64; 3]) -> PointInObject<'_> {
        let (mut point, mut error) = (world, 0.0);
        if let Some(rows) = &self.rows {
            let relative = minus(world, rows.map(|[.., t]| t));
            point = self.inverse.map(|[x, y, z]| x * relative[0] + y * relative[1] + z * relative[2]);
            error = self.error * max_norm(relative) + f64::MIN_POSITIVE;
        }
        PointInObject::new(world, self.rows.as_ref(), point, error)
    }

    /// A point in object space, rounded to f32, for walks through the BVH of rounded vertices.
    /// Coordinates beyond the range of f32 are limited to it.
    pub(crate) fn narrow(&self, point: &PointInObject<'_>, object: &ObjectView<'_>) -> NarrowPoint {
        NarrowPoint::new(minus(point.point, object.anchor), point.error + rounding(object, point.point))
    }

    /// A box of world space for tests of an object's boxes.
    pub(crate) fn region(&self, [lower, upper]: [[f64; 3]; 2], object: &ObjectView<'_>) -> RegionBox {
        let identity = Affine::IDENTITY.rows();
        let rows = self.rows.as_ref().unwrap_or(&identity);
        let anchor = object.anchor;
        // The origin of object space in world space.
        let origin = rows.map(|[x, y, z, t]| x * anchor[0] + y * anchor[1] + z * anchor[2] + t);
        let size = max_norm(rows.map(|[x, y, z, t]| {
            (x * anchor[0]).abs() + (y * anchor[1]).abs() + (z * anchor[2]).abs() + t.abs()
        }));
        let off = if object.exact.is_empty() { 0.0 } else { PRODUCT_ERROR * size };
        let linear = rows.map(|[x, y, z, _]| [x, y, z]);
        RegionBox::new([minus(lower, origin), minus(upper, origin)], &linear, object.bounds.greatest, off)
    }

    /// Upper bound of the squared distance in object space, from a point that is off, of what lies
    /// within a distance in world space.
    pub(crate) fn squared_in_object(&self, distance: f64, off: f64) -> f64 {
        let distance = distance * self.norm + ROOT_OF_3 * off;
        // Not NaN, where an infinite norm bounds a distance of 0.
        if distance < f64::INFINITY { distance * distance } else { f64::INFINITY }
    }

    /// A triangle in world space, given its corners in object space and its id.
    pub(crate) fn triangle(&self, object: &ObjectView<'_>, corners: [[f32; 3]; 3], id: u32) -> WideTriangle {
        let corners = object.exact_corners(|| id, corners);
        WideTriangle { corners, rows: self.rows }
    }
}

/// Upper bound of how far the vertices of an object's leaves are off where they are rounded, and
/// the difference of a point and the anchor: half a unit in the last place of f32, and one in f64.
fn rounding(object: &ObjectView<'_>, point: [f64; 3]) -> f64 {
    if object.exact.is_empty() {
        return 0.0;
    }
    let vertices = f64::from(object.bounds.greatest) / (1 << 24) as f64 + f64::from(f32::from_bits(1));
    vertices * SLACK + PRODUCT_ERROR * (max_norm(point) + max_norm(object.anchor))
}

/// Upper bound of the max factor by which a matrix A stretches a vector, at most 1.04 times that
/// factor. The square of the factor is the max eigenvalue of the symmetric matrix B = AᵀA, which is
/// at most the n-th root of any norm of the n-th power of B.
fn spectral_norm(rows: &[[f64; 3]; 3]) -> f64 {
    let greatest = rows.iter().flatten().fold(0.0f64, |m, x| m.max(x.abs()));
    if greatest == 0.0 {
        return 0.0;
    }
    let row_norm =
        |m: &[[f64; 3]; 3]| m.iter().map(|r| r[0].abs() + r[1].abs() + r[2].abs()).fold(0.0f64, f64::max);
    let product = |a: &[[f64; 3]; 3], b: &[[f64; 3]; 3]| {
        [0, 1, 2].map(|i| [0, 1, 2].map(|j| a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j]))
    };
    let scaled = rows.map(|row| row.map(|x| x / greatest));
    let transposed = [0, 1, 2].map(|i| [0, 1, 2].map(|k| scaled[k][i]));
    let mut power = product(&transposed, &scaled);
    // After k steps the power of B with the exponent 2^k is `power` times `factor` to this
    // exponent.
    const STEPS: usize = 5;
    let root = |x: f64, steps: usize| (0..steps).fold(x, |x, _| x.sqrt());
    let mut factor = 1.0;
    for step in 0..STEPS {
        let norm = row_norm(&power);
        factor *= root(norm, step);
        power = power.map(|row| row.map(|x| x / norm));
        power = product(&power, &power);
    }
    let eigenvalue = factor * root(row_norm(&power), STEPS);
    greatest * eigenvalue.sqrt() * (1.0 + 1.0 / (1u64 << 40) as f64)
}
