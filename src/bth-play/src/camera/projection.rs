//! The camera: a point of the picture becomes a ray in world space.

use crate::args::{Args, Axis};
use bth::rays::Ray;
use glam::{DVec2, DVec3};

/// A pinhole camera or an orthographic one, in world space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Camera {
    pub(crate) eye: DVec3,
    /// `right`, `up` and `forward` are an orthonormal basis.
    pub(crate) right: DVec3,
    pub(crate) up: DVec3,
    pub(crate) forward: DVec3,
    /// Half the width and height of the picture: at distance 1 of a pinhole camera, in world units
    /// of an orthographic one.
    pub(crate) half_extent: DVec2,
    pub(super) projection: Projection,
    /// Distance along `forward` of the near plane.
    pub(super) near: f64,
    /// Distance along `forward` of the far plane; may be infinite.
    pub(super) far: f64,
}

/// How rays leave the camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Projection {
    /// All rays start at the eye.
    Perspective,
    /// All rays have the direction of the camera.
    Orthographic,
}

/// A ray of the camera, in world space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraRay {
    pub(crate) origin: DVec3,
    /// Unit length.
    pub(crate) direction: DVec3,
    /// Smallest and largest t.
    range: (f64, f64),
}

impl CameraRay {
    /// The ray as it is traced.
    pub(crate) fn to_ray(self) -> Ray {
        Ray {
            origin: self.origin.as_vec3().to_array(),
            tmin: self.range.0 as f32,
            direction: self.direction.as_vec3().to_array(),
            tmax: self.range.1 as f32,
        }
    }
}

/// Sine of the angle between two unit vectors below which the rounding of these decides its
/// direction. It is relative to their length.
const STRAIGHT: f64 = 1e-9;

impl Camera {
    /// A pinhole camera at `eye` that looks along `forward` with `vertical` upright in the picture.
    pub(crate) fn look_along(eye: DVec3, forward: DVec3, vertical: DVec3, half_extent: DVec2) -> Self {
        let forward = forward.normalize();
        let side = forward.cross(vertical);
        // Straight up or down every perpendicular direction can be `right`.
        let right =
            if side.length() > STRAIGHT { side.normalize() } else { forward.any_orthonormal_vector() };
        let up = right.cross(forward);
        let (projection, near, far) = (Projection::Perspective, 0.0, f64::INFINITY);
        Self { eye, right, up, forward, half_extent, projection, near, far }
    }

    /// The camera with the same lens at another place.
    pub(crate) fn moved(self, eye: DVec3, forward: DVec3, vertical: DVec3) -> Self {
        let Self { half_extent, projection, near, far, .. } = self;
        Self { projection, near, far, ..Self::look_along(eye, forward, vertical, half_extent) }
    }

    /// The camera for a picture of another aspect ratio; the visible height stays.
    pub(crate) fn with_aspect_of(self, (width, height): (u32, u32)) -> Self {
        let aspect = f64::from(width) / f64::from(height);
        Self { half_extent: DVec2::new(self.half_extent.y * aspect, self.half_extent.y), ..self }
    }

    /// Half the height, in world units, that the picture shows at a distance from the eye.
    pub(crate) fn half_height(&self, distance: f64) -> f64 {
        match self.projection {
            Projection::Perspective => self.half_extent.y * distance,
            Projection::Orthographic => self.half_extent.y,
        }
    }

    /// Scales what an orthographic camera shows; a pinhole camera zooms by moving and stays as it
    /// is.
    pub(crate) fn zoomed(self, factor: f64) -> Self {
        match self.projection {
            Projection::Perspective => self,
            Projection::Orthographic => Self { half_extent: self.half_extent * factor, ..self },
        }
    }

    /// The ray through a point of the picture: (-1, -1) is the lower left corner, (1, 1) the upper
    /// right.
    pub(crate) fn ray(&self, at: DVec2) -> CameraRay {
        let at = at * self.half_extent;
        let shift = self.right * at.x + self.up * at.y;
        if self.projection == Projection::Orthographic {
            let range = (self.near, self.far);
            return CameraRay { origin: self.eye + shift, direction: self.forward, range };
        }
        let direction = (self.forward + shift).normalize();
        // Near and far are planes: a slanted ray reaches them later.
        let slant = 1.0 / direction.dot(self.forward);
        CameraRay { origin: self.eye, direction, range: (self.near * slant, self.far * slant) }
    }
}

/// Returns the unit vectors to the front of a model and up.
pub(crate) fn front_and_up(axis: Axis) -> [DVec3; 2] {
    match axis {
        Axis::Y => [DVec3::Z, DVec3::Y],
        Axis::Z => [DVec3::NEG_Y, DVec3::Z],
    }
}

/// Returns the unit vector that points up.
pub(crate) fn up_vector(axis: Axis) -> DVec3 {
    front_and_up(axis)[1]
}

/// Half the width and height of the picture at distance 1, for the vertical field of view of the
/// options, in degrees.
pub(super) fn half_extent(args: &Args, default_fov: f64) -> DVec2 {
    let half = (args.fov.unwrap_or(default_fov) / 2.0).to_radians().tan();
    DVec2::new(half * f64::from(args.size.0) / f64::from(args.size.1), half)
}
