//! Random directions, drawn from the seeded generator of the workspace: the same in every run.

use bth_random::Rng;
use glam::DVec3;
use std::f64::consts::TAU;

/// A unit vector, uniform on the sphere (by Archimedes' theorem: its z is uniform).
pub fn on_sphere(rng: &mut Rng) -> DVec3 {
    let z = 2.0 * rng.unit_f64() - 1.0;
    let (sin, cos) = (TAU * rng.unit_f64()).sin_cos();
    let radius = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(radius * cos, radius * sin, z)
}

/// A unit vector in the hemisphere around a unit vector, with a density proportional to the cosine
/// of their angle (Malley's method: a uniform point of the disk, lifted to the hemisphere).
pub fn cosine_weighted(rng: &mut Rng, normal: DVec3) -> DVec3 {
    let square = rng.unit_f64();
    let (sin, cos) = (TAU * rng.unit_f64()).sin_cos();
    let radius = square.sqrt();
    let (side, up) = perpendicular(normal);
    (side * (radius * cos) + up * (radius * sin) + normal * (1.0 - square).max(0.0).sqrt()).normalize()
}

/// Two unit vectors that are perpendicular to a unit vector and to each other.
pub fn perpendicular(normal: DVec3) -> (DVec3, DVec3) {
    let other = if normal.x.abs() < 0.6 { DVec3::X } else { DVec3::Y };
    let side = normal.cross(other).normalize();
    (side, normal.cross(side))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cosine_directions_average_two_thirds_along_the_normal() {
        let (mut rng, normal) = (Rng::new(9), DVec3::new(2.0, -1.0, 2.0) / 3.0);
        let mean = (0..20_000).map(|_| cosine_weighted(&mut rng, normal).dot(normal)).sum::<f64>() / 20_000.0;
        assert!((mean - 2.0 / 3.0).abs() < 0.01, "{mean}");
    }
}
