//! Seeded random numbers: the same rays in every run.

use glam::DVec3;
use std::f64::consts::TAU;

/// SplitMix64 (Steele, Lea and Flood 2014, "Fast splittable pseudorandom number generators").
#[derive(Clone, Debug)]
pub struct Random(pub u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Uniform on the unit sphere (Archimedes).
    pub fn sphere(&mut self) -> DVec3 {
        let z = 2.0 * self.unit() - 1.0;
        let (sin, cos) = (TAU * self.unit()).sin_cos();
        let radius = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(radius * cos, radius * sin, z)
    }

    /// Cosine-weighted in the hemisphere around a unit vector (Malley).
    pub fn cosine(&mut self, normal: DVec3) -> DVec3 {
        let square = self.unit();
        let (sin, cos) = (TAU * self.unit()).sin_cos();
        let radius = square.sqrt();
        let (side, up) = across(normal);
        (side * (radius * cos) + up * (radius * sin) + normal * (1.0 - square).max(0.0).sqrt()).normalize()
    }
}

/// Two unit vectors that are perpendicular to a unit vector and to each other.
pub fn across(normal: DVec3) -> (DVec3, DVec3) {
    let other = if normal.x.abs() < 0.6 { DVec3::X } else { DVec3::Y };
    let side = normal.cross(other).normalize();
    (side, normal.cross(side))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_the_published_generator() {
        let mut random = Random(1234567);
        let first: Vec<u64> = (0..3).map(|_| random.next()).collect();
        assert_eq!(first, [6457827717110365317, 3203168211198807973, 9817491932198370423]);
    }

    #[test]
    fn cosine_directions_average_two_thirds_along_the_normal() {
        let (mut random, normal) = (Random(9), DVec3::new(2.0, -1.0, 2.0) / 3.0);
        let mean = (0..20_000).map(|_| random.cosine(normal).dot(normal)).sum::<f64>() / 20_000.0;
        assert!((mean - 2.0 / 3.0).abs() < 0.01, "{mean}");
    }
}
