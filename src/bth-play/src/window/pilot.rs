//! Where the camera of the window is: with a camera of the scene, or where the user took it.

use crate::camera::Camera;
use glam::{DVec2, DVec3};

/// Least angle between the line of sight and the vertical, as a cosine.
const STEEPEST: f64 = 0.999;
/// Radians of a drag across the height of the window.
const TURN: f64 = 3.0;
/// Part of the distance that a notch of the wheel takes.
const NOTCH: f64 = 0.15;

/// A camera that the user moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pilot {
    camera: Camera,
    vertical: DVec3,
    /// To what is in the middle of the picture, around which it orbits.
    distance: f64,
}

impl Pilot {
    /// Takes over a camera; `distance` to what is in the middle of the picture.
    pub(crate) fn new(camera: Camera, vertical: DVec3, distance: f64) -> Self {
        Self { camera, vertical, distance }
    }

    /// The camera for a picture of this size.
    pub(crate) fn camera(&self, size: (u32, u32)) -> Camera {
        self.camera.reshaped(size)
    }

    /// Turns around what is in the middle; `by` in heights of the window, to the right and down.
    pub(crate) fn orbit(&mut self, by: DVec2) {
        let target = self.camera.eye + self.camera.forward * self.distance;
        let turned = rotated(self.camera.forward, self.vertical, -by.x * TURN);
        let right = turned.cross(self.vertical).normalize_or(self.camera.right);
        let tilted = rotated(turned, right, -by.y * TURN);
        let forward = if tilted.dot(self.vertical).abs() < STEEPEST { tilted } else { turned };
        self.place(target - forward * self.distance, forward);
    }

    /// Moves sideways, so that what is in the middle follows the pointer; `by` as above.
    pub(crate) fn pan(&mut self, by: DVec2) {
        let unit = 2.0 * self.camera.half_height(self.distance);
        let eye = self.camera.eye + (self.camera.up * by.y - self.camera.right * by.x) * unit;
        self.place(eye, self.camera.forward);
    }

    /// Moves towards what is in the middle by notches of a wheel, or away from it.
    pub(crate) fn approach(&mut self, notches: f64) {
        let factor = (-NOTCH * notches).exp();
        let target = self.camera.eye + self.camera.forward * self.distance;
        self.distance *= factor;
        self.camera = self.camera.widened(factor);
        self.place(target - self.camera.forward * self.distance, self.camera.forward);
    }

    /// Flies: right, up and forward, in world units.
    pub(crate) fn fly(&mut self, by: DVec3) {
        let Camera { eye, right, up, forward, .. } = self.camera;
        self.place(eye + right * by.x + up * by.y + forward * by.z, forward);
    }

    fn place(&mut self, eye: DVec3, forward: DVec3) {
        self.camera = self.camera.moved(eye, forward, self.vertical);
    }
}

/// A vector turned around a unit axis (Rodrigues).
fn rotated(v: DVec3, axis: DVec3, angle: f64) -> DVec3 {
    let (sin, cos) = angle.sin_cos();
    v * cos + axis.cross(v) * sin + axis * (axis.dot(v) * (1.0 - cos))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pilot() -> Pilot {
        let camera = Camera::looking(DVec3::new(0.0, 1.0, 5.0), DVec3::NEG_Z, DVec3::Y, DVec2::new(0.8, 0.4));
        Pilot::new(camera, DVec3::Y, 5.0)
    }

    fn near(a: DVec3, b: DVec3) -> bool {
        (a - b).length() < 1e-9 * (a.length() + b.length())
    }

    #[test]
    fn orbits_keep_the_target_in_the_middle_and_never_turn_over() {
        let mut pilot = pilot();
        let target = DVec3::new(0.0, 1.0, 0.0);
        for step in 0..200 {
            pilot.orbit(DVec2::new(0.03, if step < 100 { 0.05 } else { -0.05 }));
            let camera = pilot.camera((200, 100));
            assert!(near(camera.eye + camera.forward * 5.0, target), "{step}: {camera:?}");
            assert!(camera.up.dot(DVec3::Y) > 0.0, "{step}: {camera:?}");
        }
        let before = pilot.camera((200, 100)).eye;
        pilot.orbit(DVec2::new(std::f64::consts::TAU / TURN, 0.0));
        assert!(near(pilot.camera((200, 100)).eye, before), "once around");
    }

    #[test]
    fn panning_by_the_height_of_the_window_moves_by_what_it_shows() {
        let mut pilot = pilot();
        pilot.pan(DVec2::new(0.0, 1.0));
        assert!(near(pilot.camera((200, 100)).eye, DVec3::new(0.0, 1.0 + 2.0 * 0.4 * 5.0, 5.0)));
    }

    #[test]
    fn the_wheel_comes_nearer_without_ever_arriving_and_back() {
        let mut pilot = pilot();
        pilot.approach(40.0);
        let near_by = pilot.camera((200, 100)).eye;
        assert!(near_by.z > 0.0 && near_by.z < 0.1, "{near_by}");
        pilot.approach(-40.0);
        assert!(near(pilot.camera((200, 100)).eye, DVec3::new(0.0, 1.0, 5.0)));
    }

    #[test]
    fn another_shape_shows_the_same_height() {
        let camera = pilot().camera((300, 100));
        assert_eq!(camera.extent, DVec2::new(0.4 * 3.0, 0.4));
    }
}
