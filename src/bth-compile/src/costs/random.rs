//! Seeded random numbers for sampled rays: additions, products and square roots only, so that the same rays are drawn on
//! every machine.

use bth_random::Rng;

/// The generator of sample rays.
#[derive(Clone, Debug)]
pub(crate) struct RayRng(Rng);

impl RayRng {
    /// A generator whose numbers depend on the seed only.
    pub(crate) fn new(seed: u64) -> Self {
        Self(Rng::new(seed))
    }

    /// Uniform in [0, 1).
    pub(crate) fn unit(&mut self) -> f64 {
        (self.0.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A uniform point of the unit sphere.
    pub(crate) fn sphere(&mut self) -> [f64; 3] {
        loop {
            let p = [0; 3].map(|_| 2.0 * self.unit() - 1.0);
            let squared: f64 = p.iter().map(|x| x * x).sum();
            // Uniform in the ball but for its centre, where the division would lose digits.
            if (1e-6..=1.0).contains(&squared) {
                return p.map(|x| x / squared.sqrt());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_fill_the_unit_interval_and_directions_the_sphere() {
        let mut random = RayRng::new(1);
        let mean = (0..10_000).map(|_| random.unit()).sum::<f64>() / 1e4;
        assert!((mean - 0.5).abs() < 0.02, "{mean}");
        let mut sum = [0.0; 3];
        for _ in 0..10_000 {
            let d = random.sphere();
            assert!((d.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-12);
            (0..3).for_each(|k| sum[k] += d[k]);
        }
        assert!(sum.iter().all(|x| (x / 1e4).abs() < 0.03), "{sum:?}");
    }
}
