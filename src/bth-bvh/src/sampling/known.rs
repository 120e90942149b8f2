//! Rays that will be traced through an object, as far as they are known when it is compiled: those
//! of a scene's cameras, lights and frames, or those that a user gives.

use super::SampleRay;
use bth::rays::Ray;
use glam::DVec3;

/// Most rays that are kept of those that a user gives. The trees of five models that were made for
/// 16,384 and for 65,536 bounces take as many steps of other bounces, to 1 %.
const MOST: usize = 1 << 16;

/// Rays that are known when an object is compiled, in its space. Nodes are weighted by them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KnownRays {
    /// Rays that enter the object's box from outside, or whose start is not known.
    pub outside: Vec<SampleRay>,
    /// Rays that start on the object's triangles.
    pub surface: Vec<SampleRay>,
}

impl KnownRays {
    /// Those rays of a file that can be traced, and the number of the others: rays with numbers
    /// that are not finite (but for an infinite tmax), without direction, or with an empty range.
    /// Of more than 65,536 some are taken, evenly spaced.
    pub fn of(rays: &[Ray]) -> (Self, usize) {
        let usable: Vec<SampleRay> = rays.iter().filter_map(sample_ray).collect();
        let left_out = rays.len() - usable.len();
        let taken = usable.len().min(MOST);
        let outside = (0..taken).map(|i| usable[i * usable.len() / taken]).collect();
        (Self { outside, surface: Vec::new() }, left_out)
    }

    /// All rays, or of more than 65,536 some, evenly spaced.
    pub(super) fn some(&self) -> Vec<SampleRay> {
        let all = self.outside.iter().chain(&self.surface).copied();
        all.step_by(self.count().div_ceil(MOST).max(1)).collect()
    }

    /// Number of the rays.
    pub fn count(&self) -> usize {
        self.outside.len() + self.surface.len()
    }

    /// BLAKE3 of the rays, hexadecimal.
    pub fn hash(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        for rays in [&self.outside, &self.surface] {
            hasher.update(&(rays.len() as u64).to_le_bytes());
            for ray in rays {
                let numbers = ray.origin.iter().chain(&ray.direction).chain([&ray.tmax]);
                numbers.for_each(|x| {
                    hasher.update(&x.to_le_bytes());
                });
                hasher.update(&ray.from.unwrap_or(u32::MAX).to_le_bytes());
            }
        }
        hasher.finalize().to_hex().to_string()
    }

    /// Shares of rays from outside and from surfaces.
    pub fn shares(&self) -> [f64; 2] {
        let [outside, surface] = [&self.outside, &self.surface].map(|rays| rays.len() as f64);
        let all = (outside + surface).max(1.0);
        [outside / all, surface / all]
    }
}

/// The ray from its tmin on, with a unit direction; `None` if it cannot be traced.
fn sample_ray(ray: &Ray) -> Option<SampleRay> {
    let [origin, direction] = [ray.origin, ray.direction].map(|v| DVec3::from(v.map(f64::from)));
    let [tmin, tmax] = [ray.tmin, ray.tmax].map(f64::from);
    let (start, length) = (origin + tmin * direction, direction.length());
    let unit = direction / length;
    (start.is_finite() && unit.is_finite() && tmin <= tmax).then(|| SampleRay {
        origin: start.into(),
        direction: unit.into(),
        tmax: (tmax - tmin) * length,
        from: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_begin_at_their_tmin_and_measure_the_length_of_their_direction() {
        let ray = Ray { origin: [1.0, 2.0, 3.0], tmin: 0.5, direction: [0.0, -2.0, 0.0], tmax: 2.0 };
        let (known, left_out) = KnownRays::of(&[ray, Ray { tmax: f32::INFINITY, ..ray }]);
        let expected =
            SampleRay { origin: [1.0, 1.0, 3.0], direction: [0.0, -1.0, 0.0], tmax: 3.0, from: None };
        assert_eq!(known.outside, [expected, SampleRay { tmax: f64::INFINITY, ..expected }]);
        assert_eq!((known.count(), left_out), (2, 0));
        assert_eq!(known.shares(), [1.0, 0.0]);
    }

    #[test]
    fn rays_that_cannot_be_traced_are_counted() {
        let good = Ray::new([0.0; 3], [0.0, 0.0, 1.0]);
        let bad = [
            Ray { origin: [f32::NAN, 0.0, 0.0], ..good },
            Ray { direction: [0.0; 3], ..good },
            Ray { direction: [0.0, f32::INFINITY, 0.0], ..good },
            Ray { tmin: f32::NEG_INFINITY, ..good },
            Ray { tmin: 2.0, tmax: 1.0, ..good },
            Ray { tmax: f32::NAN, ..good },
        ];
        let (known, left_out) = KnownRays::of(&[&bad[..], &[good]].concat());
        assert_eq!((known.count(), left_out), (1, bad.len()));
        assert_eq!(KnownRays::of(&[]), (KnownRays::default(), 0));
    }

    #[test]
    fn of_many_rays_some_are_taken_from_all_parts() {
        let rays: Vec<Ray> = (0..3 * MOST).map(|i| Ray::new([i as f32, 0.0, 0.0], [0.0, 0.0, 1.0])).collect();
        let (known, left_out) = KnownRays::of(&rays);
        assert_eq!((known.count(), left_out), (MOST, 0));
        assert!(known.outside.iter().zip(0..).all(|(ray, i)| ray.origin[0] == f64::from(3 * i)));
    }
}
