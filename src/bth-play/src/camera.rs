//! The camera, and how it is placed so that the model fills the picture.

use crate::args::{Args, Axis, View};
use crate::stage::Space;
use bth::Scene;
use glam::{DVec2, DVec3};

/// Vertical field of view of a product shot, degrees: long enough to keep proportions natural.
const FOV: f64 = 32.0;
/// Degrees around the model, from its front.
const YAW: f64 = 35.0;
/// Degrees above the horizon.
const PITCH: f64 = 20.0;
/// Share of the picture that the model fills.
const FILL: f64 = 0.86;

/// A pinhole camera or, with parallel rays, an orthographic one; world space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Camera {
    pub(crate) eye: DVec3,
    pub(crate) right: DVec3,
    pub(crate) up: DVec3,
    pub(crate) forward: DVec3,
    /// Half the width and height of the picture: at distance 1, or of parallel rays.
    pub(crate) extent: DVec2,
    /// Whether all rays have the direction of the camera.
    parallel: bool,
    /// Nothing nearer along `forward` is seen.
    near: f64,
    /// Nothing farther is seen; may be infinite.
    far: f64,
}

/// A camera ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight {
    pub(crate) origin: DVec3,
    /// Unit.
    pub(crate) direction: DVec3,
    /// Least and greatest t.
    pub(crate) range: (f64, f64),
}

impl Camera {
    /// The camera at `eye` that looks along `forward`.
    pub(crate) fn looking(eye: DVec3, forward: DVec3, vertical: DVec3, extent: DVec2) -> Self {
        let forward = forward.normalize();
        let side = forward.cross(vertical);
        // Straight up or down there is no natural right; any will do.
        let right = if side.length() > 1e-9 { side.normalize() } else { forward.any_orthonormal_vector() };
        let up = right.cross(forward);
        Self { eye, right, up, forward, extent, parallel: false, near: 0.0, far: f64::INFINITY }
    }

    /// The camera that the options ask for, but for `--inside`.
    pub(crate) fn outside(args: &Args, space: &Space) -> Self {
        let vertical = vertical(args.up);
        let extent = extent(args, FOV);
        if let Some(View::Points([ex, ey, ez, tx, ty, tz])) = args.camera {
            let eye = DVec3::new(ex, ey, ez);
            return Self::looking(eye, DVec3::new(tx, ty, tz) - eye, vertical, extent / args.zoom);
        }
        let (yaw, pitch) = (args.yaw.unwrap_or(YAW).to_radians(), args.pitch.unwrap_or(PITCH).to_radians());
        let (side, front) = match args.up {
            Axis::Y => (DVec3::X, DVec3::Z),
            Axis::Z => (DVec3::X, DVec3::NEG_Y),
        };
        let towards = (side * yaw.sin() + front * yaw.cos()) * pitch.cos() + vertical * pitch.sin();
        let mut camera = Self::looking(space.center(), -towards, vertical, extent);
        camera.eye = camera.fitted_eye(space, extent * FILL);
        camera.extent /= args.zoom;
        camera
    }

    /// The nearest eye from which all points lie within the frustum of half extent `t`.
    ///
    /// In camera axes around the centre, with the eye at (a, b, -d), a point (x, y, z) is inside
    /// when |x - a| <= (z + d) tx. The two extremes of x ∓ z tx give a and the least d; y likewise.
    fn fitted_eye(&self, space: &Space, t: DVec2) -> DVec3 {
        let mut high = DVec2::NEG_INFINITY;
        let mut low = DVec2::NEG_INFINITY;
        let center = space.center();
        space.for_each_point(|p| {
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

    /// The camera with the same lens at another place.
    pub(crate) fn moved(self, eye: DVec3, forward: DVec3, vertical: DVec3) -> Self {
        let Self { extent, parallel, near, far, .. } = self;
        Self { parallel, near, far, ..Self::looking(eye, forward, vertical, extent) }
    }

    /// The camera for a picture of another shape: as high as before.
    pub(crate) fn reshaped(self, (width, height): (u32, u32)) -> Self {
        let aspect = f64::from(width) / f64::from(height);
        Self { extent: DVec2::new(self.extent.y * aspect, self.extent.y), ..self }
    }

    /// Half the height of the picture where it is so far away.
    pub(crate) fn half_height(&self, distance: f64) -> f64 {
        if self.parallel { self.extent.y } else { self.extent.y * distance }
    }

    /// With parallel rays: the camera that sees a part of the height, or more.
    pub(crate) fn widened(self, factor: f64) -> Self {
        if self.parallel { Self { extent: self.extent * factor, ..self } } else { self }
    }

    /// The ray through a point of the picture: (-1, -1) is the lower left corner, (1, 1) the upper right.
    pub(crate) fn sight(&self, at: DVec2) -> Sight {
        let at = at * self.extent;
        let shift = self.right * at.x + self.up * at.y;
        if self.parallel {
            let range = (self.near, self.far);
            return Sight { origin: self.eye + shift, direction: self.forward, range };
        }
        let direction = (self.forward + shift).normalize();
        let slant = 1.0 / direction.dot(self.forward);
        Sight { origin: self.eye, direction, range: (self.near * slant, self.far * slant) }
    }
}

/// A camera of the scene at its time.
pub(crate) fn carried(scene: &Scene, row: u32, args: &Args) -> Camera {
    let lens = scene.description().expect("a scene with this camera").cameras[row as usize];
    let (rows, _) = scene.node(lens.node);
    let column = |k: usize| DVec3::new(rows[0][k], rows[1][k], rows[2][k]);
    let aspect = f64::from(args.size.0) / f64::from(args.size.1);
    let parallel = lens.projection == 1;
    let half = if parallel {
        lens.size / 2.0 * column(1).length()
    } else {
        (args.fov.unwrap_or(lens.size) / 2.0).to_radians().tan()
    };
    let forward = (-column(2)).normalize_or(DVec3::NEG_Z);
    let extent = DVec2::new(half * aspect, half) / args.zoom;
    let mut camera = Camera::looking(column(3), forward, column(1), extent);
    camera.parallel = parallel;
    camera.near = lens.near;
    camera.far = if lens.far > 0.0 { lens.far } else { f64::INFINITY };
    camera
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
