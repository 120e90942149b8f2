//! The camera of the window: the camera of the options, of the scene, or one that the user moves.

use crate::args::Args;
use crate::camera::{Camera, SceneSetup, scene_camera};
use bth::Scene;
use glam::{DVec2, DVec3};
use std::path::Path;

/// The camera in use.
#[derive(Clone, Copy, Debug)]
pub(super) enum ViewCamera {
    /// The camera that the options chose, which may move with the scene.
    Initial,
    /// The camera in this row of the scene's table.
    Scene(u32),
    /// The camera that the user moves.
    Free(CameraController),
}

/// What the window shows.
pub(crate) struct Content<'a> {
    pub(crate) scene: &'a mut Scene,
    pub(crate) file: &'a Path,
    pub(crate) setup: SceneSetup,
    /// Frames per second.
    pub(crate) rate: f64,
    /// Factor of light in mode path.
    pub(super) factor: f32,
}

impl ViewCamera {
    /// The camera at the time to which the scene is set, for the size of the options.
    pub(super) fn camera(self, content: &Content<'_>, args: &Args) -> Camera {
        match self {
            ViewCamera::Initial => content.setup.camera(content.scene, args).with_aspect_of(args.size),
            ViewCamera::Scene(row) => scene_camera(content.scene, row, args),
            ViewCamera::Free(controller) => controller.camera(args.size),
        }
    }
}

/// Largest cosine of the angle between the view direction and the vertical: the camera never turns
/// upside down.
const MAX_COSINE: f64 = 0.999;
/// Radians that a drag over the height of the window turns the camera.
const TURN: f64 = 3.0;
/// Logarithm of the factor by which a notch of the wheel shortens the distance.
const ZOOM_PER_NOTCH: f64 = 0.15;

/// A camera that the user moves.
#[derive(Clone, Copy, Debug)]
pub(super) struct CameraController {
    camera: Camera,
    vertical: DVec3,
    /// Distance from the eye to the target, the point in the middle of the picture around which the
    /// camera orbits.
    distance: f64,
}

impl CameraController {
    /// Starts from a camera whose target is at `distance`.
    pub(super) fn new(camera: Camera, vertical: DVec3, distance: f64) -> Self {
        Self { camera, vertical, distance }
    }

    /// The camera for a picture of this size.
    pub(super) fn camera(&self, size: (u32, u32)) -> Camera {
        self.camera.with_aspect_of(size)
    }

    /// Orbits around the target; `by` is the drag in heights of the window, to the right and down.
    pub(super) fn orbit(&mut self, by: DVec2) {
        let target = self.camera.eye + self.camera.forward * self.distance;
        let turned = rotated(self.camera.forward, self.vertical, -by.x * TURN);
        let right = turned.cross(self.vertical).normalize_or(self.camera.right);
        let tilted = rotated(turned, right, -by.y * TURN);
        let forward = if tilted.dot(self.vertical).abs() < MAX_COSINE { tilted } else { turned };
        self.set(target - forward * self.distance, forward);
    }

    /// Pans, so that the target follows the pointer; `by` is the drag in heights of the window, to
    /// the right and down.
    pub(super) fn pan(&mut self, by: DVec2) {
        let unit = 2.0 * self.camera.half_height(self.distance);
        let eye = self.camera.eye + (self.camera.up * by.y - self.camera.right * by.x) * unit;
        self.set(eye, self.camera.forward);
    }

    /// Moves towards the target by notches of a wheel, or away from it by negative ones.
    pub(super) fn dolly(&mut self, notches: f64) {
        let factor = (-ZOOM_PER_NOTCH * notches).exp();
        let target = self.camera.eye + self.camera.forward * self.distance;
        self.distance *= factor;
        self.camera = self.camera.zoomed(factor);
        self.set(target - self.camera.forward * self.distance, self.camera.forward);
    }

    /// Moves along the axes of the camera: right, up and forward, in world units.
    pub(super) fn fly(&mut self, by: DVec3) {
        let Camera { eye, right, up, forward, .. } = self.camera;
        self.set(eye + right * by.x + up * by.y + forward * by.z, forward);
    }

    fn set(&mut self, eye: DVec3, forward: DVec3) {
        self.camera = self.camera.moved(eye, forward, self.vertical);
    }
}

/// A vector rotated about a unit axis (Rodrigues' formula).
fn rotated(v: DVec3, axis: DVec3, angle: f64) -> DVec3 {
    let (sin, cos) = angle.sin_cos();
    v * cos + axis.cross(v) * sin + axis * (axis.dot(v) * (1.0 - cos))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn controller() -> CameraController {
        let camera =
            Camera::look_along(DVec3::new(0.0, 1.0, 5.0), DVec3::NEG_Z, DVec3::Y, DVec2::new(0.8, 0.4));
        CameraController::new(camera, DVec3::Y, 5.0)
    }

    fn near(a: DVec3, b: DVec3) -> bool {
        (a - b).length() < 1e-9 * (a.length() + b.length())
    }

    #[test]
    fn orbits_keep_the_target_in_the_middle_and_never_turn_over() {
        let mut controller = controller();
        let target = DVec3::new(0.0, 1.0, 0.0);
        for step in 0..200 {
            controller.orbit(DVec2::new(0.03, if step < 100 { 0.05 } else { -0.05 }));
            let camera = controller.camera((200, 100));
            assert!(near(camera.eye + camera.forward * 5.0, target), "{step}: {camera:?}");
            assert!(camera.up.dot(DVec3::Y) > 0.0, "{step}: {camera:?}");
        }
        let before = controller.camera((200, 100)).eye;
        controller.orbit(DVec2::new(std::f64::consts::TAU / TURN, 0.0));
        assert!(near(controller.camera((200, 100)).eye, before), "once around");
    }

    #[test]
    fn panning_by_the_height_of_the_window_moves_by_what_it_shows() {
        let mut controller = controller();
        controller.pan(DVec2::new(0.0, 1.0));
        assert!(near(controller.camera((200, 100)).eye, DVec3::new(0.0, 1.0 + 2.0 * 0.4 * 5.0, 5.0)));
    }

    #[test]
    fn the_wheel_never_reaches_the_target_and_can_be_turned_back() {
        let mut controller = controller();
        controller.dolly(40.0);
        let close = controller.camera((200, 100)).eye;
        assert!(close.z > 0.0 && close.z < 0.1, "{close}");
        controller.dolly(-40.0);
        assert!(near(controller.camera((200, 100)).eye, DVec3::new(0.0, 1.0, 5.0)));
    }

    #[test]
    fn another_shape_shows_the_same_height() {
        let camera = controller().camera((300, 100));
        assert_eq!(camera.half_extent, DVec2::new(0.4 * 3.0, 0.4));
    }
}
