//! The lamp that lights a room which brings no light of its own.

use super::context::FrameContext;
use bth::rays::{Hit, Ray};
use glam::DVec3;

/// The position of a lamp above and beside the camera, in front of the nearest wall in that direction.
pub(super) fn room_lamp(frame: &FrameContext<'_>, vertical: DVec3) -> DVec3 {
    let camera = &frame.camera;
    let direction = (vertical * 0.7 - camera.right * 0.6).normalize();
    let ray = Ray {
        origin: camera.eye.as_vec3().to_array(),
        tmin: 0.0,
        direction: direction.as_vec3().to_array(),
        tmax: (0.15 * frame.bounds.diagonal()) as f32,
    };
    let mut hit = [Hit::MISS];
    frame.scene.batch(&[ray]).nearest(&mut hit);
    let free = f64::from(hit[0].t).min(f64::from(ray.tmax));
    camera.eye + direction * (0.6 * free)
}
