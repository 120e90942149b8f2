//! The pinhole camera, and how it is placed so that the model fills the picture.

use crate::args::{Args, Axis};
use crate::surface::Shape;
use glam::{DVec2, DVec3};

/// Vertical field of view of a product shot, degrees: long enough to keep proportions natural.
const FOV: f64 = 32.0;
/// Share of the picture that the model fills.
const FILL: f64 = 0.86;

/// A pinhole camera, world space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Camera {
    pub(crate) eye: DVec3,
    pub(crate) right: DVec3,
    pub(crate) up: DVec3,
    pub(crate) forward: DVec3,
    /// Half the width and height of the picture at distance 1.
    pub(crate) extent: DVec2,
}

impl Camera {
    /// The camera at `eye` that looks along `forward`.
    pub(crate) fn looking(eye: DVec3, forward: DVec3, vertical: DVec3, extent: DVec2) -> Self {
        let forward = forward.normalize();
        let side = forward.cross(vertical);
        // Straight up or down there is no natural right; any will do.
        let right = if side.length() > 1e-9 { side.normalize() } else { forward.any_orthonormal_vector() };
        Self { eye, right, up: right.cross(forward), forward, extent }
    }

    /// The camera that the options ask for, but for `--inside`.
    pub(crate) fn outside(args: &Args, shape: &Shape<'_>) -> Self {
        let vertical = vertical(args.up);
        let extent = extent(args, FOV);
        if let Some([ex, ey, ez, tx, ty, tz]) = args.camera {
            let eye = DVec3::new(ex, ey, ez);
            return Self::looking(eye, DVec3::new(tx, ty, tz) - eye, vertical, extent / args.zoom);
        }
        let (yaw, pitch) = (args.yaw.to_radians(), args.pitch.to_radians());
        let (side, front) = match args.up {
            Axis::Y => (DVec3::X, DVec3::Z),
            Axis::Z => (DVec3::X, DVec3::NEG_Y),
        };
        let towards = (side * yaw.sin() + front * yaw.cos()) * pitch.cos() + vertical * pitch.sin();
        let mut camera = Self::looking(shape.center(), -towards, vertical, extent);
        camera.eye = camera.fitted_eye(shape, extent * FILL);
        camera.extent /= args.zoom;
        camera
    }

    /// The nearest eye from which all points lie within the frustum of half extent `t`.
    ///
    /// In camera axes around the centre, with the eye at (a, b, -d), a point (x, y, z) is inside
    /// when |x - a| <= (z + d) tx. The two extremes of x ∓ z tx give a and the least d; y likewise.
    fn fitted_eye(&self, shape: &Shape<'_>, t: DVec2) -> DVec3 {
        let mut high = DVec2::NEG_INFINITY;
        let mut low = DVec2::NEG_INFINITY;
        let center = shape.center();
        shape.for_each_point(|p| {
            let q = p - center;
            let (xy, z) = (DVec2::new(q.dot(self.right), q.dot(self.up)), q.dot(self.forward));
            high = high.max(xy - t * z);
            low = low.max(-xy - t * z);
        });
        if !high.is_finite() || !low.is_finite() {
            return center - self.forward;
        }
        let distance = ((high + low) / (2.0 * t)).max_element();
        let shift = (high - low) / 2.0;
        center + self.right * shift.x + self.up * shift.y - self.forward * distance
    }

    /// Direction through a point of the picture: (-1, -1) is the lower left corner, (1, 1) the upper right.
    pub(crate) fn direction(&self, at: DVec2) -> DVec3 {
        let at = at * self.extent;
        (self.forward + self.right * at.x + self.up * at.y).normalize()
    }
}

/// The direction that points up.
pub(crate) fn vertical(axis: Axis) -> DVec3 {
    match axis {
        Axis::Y => DVec3::Y,
        Axis::Z => DVec3::Z,
    }
}

/// Half the width and height of the picture at distance 1.
pub(crate) fn extent(args: &Args, default_fov: f64) -> DVec2 {
    let half = (args.fov.unwrap_or(default_fov) / 2.0).to_radians().tan();
    DVec2::new(half * f64::from(args.size.0) / f64::from(args.size.1), half)
}
