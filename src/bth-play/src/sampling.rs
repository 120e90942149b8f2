//! Sample points: a low-discrepancy sequence, rotated by a hash of the pixel, so that a picture is
//! the same on every run and with any number of threads; and maps from the unit square to
//! directions.

use bth_random::mix;
use glam::{DVec2, DVec3};

/// The sample points of one pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sampler {
    pixel: u64,
}

impl Sampler {
    pub(crate) fn new(x: u32, y: u32) -> Self {
        Self { pixel: mix((u64::from(y) << 32) | u64::from(x)) }
    }

    /// Point `index` in the unit square of the sequence for one dimension pair, such as the lens or
    /// a bounce: the R2 sequence of Roberts ("The unreasonable effectiveness of quasirandom
    /// sequences", 2018), with a Cranley-Patterson rotation that decorrelates pixels and dimension
    /// pairs.
    pub(crate) fn point(&self, dimension: u64, index: u32) -> DVec2 {
        const STEP: DVec2 = DVec2::new(0.754_877_666_246_692_8, 0.569_840_290_998_053_3);
        let shift = mix(self.pixel ^ mix(dimension + 1));
        let unit = |bits: u64| (bits & 0xffff_ffff) as f64 / 4_294_967_296.0;
        (DVec2::new(unit(shift), unit(shift >> 32)) + STEP * f64::from(index)).fract()
    }
}

/// A unit direction around the unit `normal`, with a density proportional to the cosine of the
/// angle to it.
pub(crate) fn cosine_hemisphere(normal: DVec3, point: DVec2) -> DVec3 {
    let (radius, angle) = (point.x.sqrt(), std::f64::consts::TAU * point.y);
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    tangent * (radius * angle.cos()) + bitangent * (radius * angle.sin()) + normal * (1.0 - point.x).sqrt()
}

/// A point of the unit disc, uniformly distributed for uniform points of the unit square.
pub(crate) fn uniform_disc(point: DVec2) -> DVec2 {
    DVec2::from_angle(std::f64::consts::TAU * point.y) * point.x.sqrt()
}

/// `count` unit directions spread evenly: a Fibonacci sphere.
pub(crate) fn fibonacci_sphere(count: u32) -> impl Iterator<Item = DVec3> {
    (0..count).map(move |i| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
        let angle = f64::from(i) * std::f64::consts::PI * (3.0 - 5f64.sqrt());
        let radius = (1.0 - z * z).sqrt();
        DVec3::new(radius * angle.cos(), radius * angle.sin(), z)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hemisphere_directions_are_unit_and_average_to_two_thirds_of_the_normal() {
        let normal = DVec3::new(1.0, -2.0, 3.0).normalize();
        let sampler = Sampler::new(3, 7);
        let directions: Vec<_> = (0..4096).map(|i| cosine_hemisphere(normal, sampler.point(0, i))).collect();
        assert!(directions.iter().all(|d| (d.length() - 1.0).abs() < 1e-9 && d.dot(normal) > -1e-9));
        let mean = directions.iter().sum::<DVec3>() / 4096.0;
        assert!((mean - normal * (2.0 / 3.0)).length() < 0.01, "{mean}");
    }

    #[test]
    fn points_differ_by_pixel_dimension_and_index() {
        let a = Sampler::new(0, 0).point(0, 0);
        assert_ne!(a, Sampler::new(1, 0).point(0, 0));
        assert_ne!(a, Sampler::new(0, 0).point(1, 0));
        assert_ne!(a, Sampler::new(0, 0).point(0, 1));
        assert_eq!(a, Sampler::new(0, 0).point(0, 0));
    }
}
