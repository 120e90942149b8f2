//! Cameras outside the model, placed so that it fills the picture, and the cameras of a scene.

use super::bounds::SceneBounds;
use super::projection::{Camera, Projection, front_and_up, half_extent};
use crate::args::{Args, View};
use bth::Scene;
use glam::{DVec2, DVec3};

/// Vertical field of view, degrees: narrow enough to keep proportions natural.
const EXTERIOR_FOV: f64 = 32.0;
/// Degrees around the model, from its front.
const YAW: f64 = 35.0;
/// Degrees above the horizon.
const PITCH: f64 = 20.0;
/// Share of the width or height of the picture that the model fills.
const FILLED_SHARE: f64 = 0.86;

/// The camera of `--camera` with eye and target, or else of `--yaw` and `--pitch` around the whole
/// model.
pub(super) fn exterior_camera(args: &Args, bounds: &SceneBounds) -> Camera {
    let [front, vertical] = front_and_up(args.up());
    let half_extent = half_extent(args, EXTERIOR_FOV);
    if let Some(View::Points([ex, ey, ez, tx, ty, tz])) = args.camera {
        let eye = DVec3::new(ex, ey, ez);
        return Camera::look_along(eye, DVec3::new(tx, ty, tz) - eye, vertical, half_extent / args.zoom);
    }
    let (yaw, pitch) = (args.yaw.unwrap_or(YAW).to_radians(), args.pitch.unwrap_or(PITCH).to_radians());
    let towards = (DVec3::X * yaw.sin() + front * yaw.cos()) * pitch.cos() + vertical * pitch.sin();
    let mut camera = Camera::look_along(bounds.center(), -towards, vertical, half_extent);
    camera.eye = fitted_eye(&camera, bounds, half_extent * FILLED_SHARE);
    camera.half_extent /= args.zoom;
    camera
}

/// The eye nearest to the model from which all its points lie within the frustum of half extent
/// `t`.
///
/// In camera axes around the centre, with the eye at (a, b, -d), a point (x, y, z) is inside when
/// |x - a| <= (z + d) tx. The two extremes of x ∓ z tx give a and the smallest d; y likewise.
fn fitted_eye(camera: &Camera, bounds: &SceneBounds, t: DVec2) -> DVec3 {
    let mut high = DVec2::NEG_INFINITY;
    let mut low = DVec2::NEG_INFINITY;
    let center = bounds.center();
    for point in bounds.points() {
        let q = *point - center;
        let (xy, z) = (DVec2::new(q.dot(camera.right), q.dot(camera.up)), q.dot(camera.forward));
        high = high.max(xy - t * z);
        low = low.max(-xy - t * z);
    }
    if !high.is_finite() || !low.is_finite() {
        return center - camera.forward;
    }
    let distance = ((high + low) / (2.0 * t)).max_element();
    let shift = (high - low) / 2.0;
    center + camera.right * shift.x + camera.up * shift.y - camera.forward * distance
}

/// The camera in a row of the scene's table, at the time to which the scene is set.
///
/// # Panics
/// If the scene has no such camera.
pub(crate) fn scene_camera(scene: &Scene, row: u32, args: &Args) -> Camera {
    let lens = scene.description().expect("a scene with this camera").cameras[row as usize];
    let (rows, _) = scene.node(lens.node);
    let column = |k: usize| DVec3::new(rows[0][k], rows[1][k], rows[2][k]);
    let aspect = f64::from(args.size.0) / f64::from(args.size.1);
    let (projection, half) = if lens.projection == 1 {
        (Projection::Orthographic, lens.size / 2.0 * column(1).length())
    } else {
        (Projection::Perspective, (args.fov.unwrap_or(lens.size) / 2.0).to_radians().tan())
    };
    let forward = (-column(2)).normalize_or(DVec3::NEG_Z);
    let half_extent = DVec2::new(half * aspect, half) / args.zoom;
    let mut camera = Camera::look_along(column(3), forward, column(1), half_extent);
    camera.projection = projection;
    camera.near = lens.near;
    camera.far = if lens.far > 0.0 { lens.far } else { f64::INFINITY };
    camera
}
