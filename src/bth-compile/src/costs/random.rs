//! Seeded random numbers for sampled rays: additions, products and square roots only, so that the same
//! rays are drawn on every machine.

/// SplitMix64 (Steele, Lea and Flood 2014).
#[derive(Clone, Debug)]
pub(crate) struct Random(pub(crate) u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub(crate) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A uniform point of the unit sphere.
    pub(crate) fn sphere(&mut self) -> [f64; 3] {
        loop {
            let p = [0; 3].map(|_| 2.0 * self.unit() - 1.0);
            let squared: f64 = p.iter().map(|x| x * x).sum();
            // Points of the ball, the tiny ones left out: dividing them would lose their digits.
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
        let mut random = Random(1);
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
