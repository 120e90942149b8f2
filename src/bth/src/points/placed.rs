//! An instance for searches of closest points: its corners in world space, and bounds of distances
//! in the space of its object.
//!
//! An affine transform does not preserve distances, so triangles are measured in world space. Each
//! coordinate of a corner is computed in f64 and rounded to f32, as if the instance had been
//! written to a file as a mesh. The BVH is walked in object space. Let A be the linear part of the
//! inverse transform and |A| its spectral norm. A triangle within the distance d in world space
//! lies within
//! |A| d in object space, plus a slack for the roundings of the point, the corners and the inverse.

use crate::instances::Placed;
use bth_format::object::ObjectView;

/// Bounds all roundings relative to the magnitudes in [`PlacedObject::new`]: 2^-24 · √3 for world
/// corners, the same for the point in object space, and 10 · 2^24 · 2^-53 for the error of the
/// inverse (see `instances/placement.rs`).
const ROUNDING: f64 = 1.0 / (1 << 21) as f64;
/// The min magnitude that roundings are relative to: denormal numbers are rounded by as much as the
/// smallest normal one.
const LEAST: f64 = f32::MIN_POSITIVE as f64;

/// An instance for a search.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlacedObject {
    placed: Placed,
    /// Upper bound of |A|.
    norm: f64,
    /// Max |coordinate| of the world box, at least [`LEAST`].
    extent: f64,
    /// Magnitude of the roundings in object space for a point at the origin of world space.
    magnitude: f64,
}

impl PlacedObject {
    pub(super) fn new(placed: Placed, object: &ObjectView<'_>) -> PlacedObject {
        let norm = spectral_norm(&placed.inverse);
        let world = placed.lower.iter().chain(&placed.upper).fold(LEAST, |m, x| m.max(f64::from(x.abs())));
        let origin = placed.origin.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        // The length of a vector is less than twice its max |coordinate|.
        let magnitude = 2.0 * (norm * (world + origin) + f64::from(object.bounds.greatest).max(LEAST));
        PlacedObject { placed, norm, extent: world, magnitude }
    }

    /// Index of the object.
    pub(super) fn object(&self) -> u32 {
        self.placed.object
    }

    /// The point in object space. Coordinates beyond the range of f32 are limited to it: that moves
    /// the point to the closest one of a cube that contains the object, and no part of the object
    /// gets farther.
    pub(super) fn point(&self, point: [f32; 3]) -> [f32; 3] {
        let mut relative = [0.0; 3];
        for k in 0..3 {
            relative[k] = f64::from(point[k]) - self.placed.origin[k];
        }
        self.placed.inverse.map(|row| {
            let x = row[0] * relative[0] + row[1] * relative[1] + row[2] * relative[2];
            (x as f32).clamp(f32::MIN, f32::MAX)
        })
    }

    /// Length in object space by which roundings may move the point and the corners.
    pub(super) fn slack(&self, point: [f32; 3]) -> f64 {
        let greatest = point.iter().fold(0.0f64, |m, x| m.max(f64::from(x.abs())));
        ROUNDING * (self.magnitude + 2.0 * self.norm * greatest)
    }

    /// Upper bound of the squared distance in object space of what lies within a squared distance
    /// in world space.
    pub(super) fn squared_in_object(&self, squared: f64, slack: f64) -> f64 {
        let distance = squared.sqrt() * self.norm + slack;
        distance * distance
    }

    /// The transform from object space to world space: rows of four.
    pub(super) fn world_rows(&self) -> &[[f64; 4]; 3] {
        &self.placed.to_world
    }

    /// Max |coordinate| of the world box.
    pub(super) fn extent(&self) -> f64 {
        self.extent
    }

    /// Corners in world space.
    pub(super) fn corners_in_world(&self, corners: [[f32; 3]; 3]) -> [[f32; 3]; 3] {
        corners.map(|p| {
            let [x, y, z] = p.map(f64::from);
            self.placed.to_world.map(|[a, b, c, d]| (a * x + b * y + c * z + d) as f32)
        })
    }
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
