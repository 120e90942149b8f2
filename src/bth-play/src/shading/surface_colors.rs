//! Modes normals and instances: colours that depend on the hit alone.

use super::context::{FrameContext, Sample};
use bth::rays::Hit;
use glam::Vec3;

/// Shading normals as colours: -1 to 1 of each component becomes 0 to 1.
pub(super) fn normals(frame: &FrameContext<'_>, samples: &[Sample], hits: &[Hit]) -> Vec<Vec3> {
    let color = |(sample, hit): (&Sample, &Hit)| {
        if !hit.is_hit() {
            return Vec3::splat(0.09);
        }
        let normal = frame.geometry.shading_normal(hit, frame.point_and_normal(sample, hit).1);
        (normal * 0.5 + 0.5).as_vec3()
    };
    samples.iter().zip(hits).map(color).collect()
}

/// Each instance in a colour of its own, darker where the surface turns away from the camera.
pub(super) fn instances(frame: &FrameContext<'_>, samples: &[Sample], hits: &[Hit]) -> Vec<Vec3> {
    let color = |(sample, hit): (&Sample, &Hit)| {
        if !hit.is_hit() {
            return Vec3::splat(0.02);
        }
        let (_, normal) = frame.point_and_normal(sample, hit);
        let facing = normal.dot(-sample.ray.direction) as f32;
        instance_color(hit.primitive.instance) * (0.25 + 0.75 * facing)
    };
    samples.iter().zip(hits).map(color).collect()
}

/// The linear colour of an instance. The hues of successive numbers are far apart (multiples of the golden ratio).
pub(super) fn instance_color(number: u32) -> Vec3 {
    let angle = (f64::from(number) * 0.618_033_988_749_895).fract() as f32 * std::f32::consts::TAU;
    let third = std::f32::consts::TAU / 3.0;
    let wave = |shift: f32| (0.5 + 0.5 * (angle - shift).cos()).powf(1.5);
    Vec3::new(wave(0.0), wave(third), wave(2.0 * third)) * 0.8 + 0.06
}
