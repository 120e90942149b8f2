//! Linear colours, with the primaries of sRGB.

use glam::Vec3;

/// Brightness to the eye (ITU-R BT.709).
pub(crate) fn luminance(color: Vec3) -> f64 {
    f64::from(color.dot(Vec3::new(0.2126, 0.7152, 0.0722)))
}

/// Compresses linear values above 0.6 towards 1 instead of clipping them.
pub(crate) fn shoulder(color: Vec3) -> Vec3 {
    let compressed = |c: f32| if c <= 0.6 { c } else { 0.6 + 0.4 * (1.0 - (-(c - 0.6) / 0.4).exp()) };
    Vec3::new(compressed(color.x), compressed(color.y), compressed(color.z))
}
