//! The one seeded generator of pseudo-random numbers of the workspace: tests, benchmarks, generated
//! models and sampled rays all draw from it, so that the same seed gives the same numbers on every
//! machine and in every release.
#![warn(missing_docs)]

/// SplitMix64 (Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators", OOPSLA
/// 2014): 64 bits of state, period 2^64. Not for cryptography.
#[derive(Clone, Debug)]
pub struct Rng(u64);

/// Square of the smallest distance of points in the unit ball from its centre, relative to its
/// radius.
const LEAST_SQUARE: f64 = 1e-6;

impl Rng {
    /// A generator whose numbers depend on the seed only; any seed will do.
    pub fn new(seed: u64) -> Rng {
        Rng(seed)
    }

    /// The next 64 bits.
    #[inline]
    #[allow(clippy::should_implement_trait)] // It is no iterator: it never ends, and callers want a number.
    pub fn next(&mut self) -> u64 {
        let bits = mix(self.0);
        self.0 = self.0.wrapping_add(GAMMA);
        bits
    }

    /// A whole number from 0 to `n - 1`, by the remainder: the bias, at most n / 2^64, matters to
    /// no use here.
    ///
    /// # Panics
    /// If `n` is 0.
    #[inline]
    pub fn below(&mut self, n: u64) -> u64 {
        self.next() % n
    }

    /// Uniform in `[0, 1)`: a multiple of 2^-24, so 1 is never returned.
    #[inline]
    pub fn unit_f32(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1u64 << 24) as f32
    }

    /// Uniform in `[0, 1)`: a multiple of 2^-53, so 1 is never returned.
    #[inline]
    pub fn unit_f64(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform between two finite numbers: at least `lower`, and at most `upper`, which only
    /// rounding can return.
    #[inline]
    pub fn between(&mut self, lower: f64, upper: f64) -> f64 {
        lower + (upper - lower) * self.unit_f64()
    }

    /// A point uniform in the unit ball, by rejection from the cube around it. Its distance from
    /// the centre is from 0.001 to 1, so that it can be normalized.
    pub fn point_in_ball(&mut self) -> [f64; 3] {
        loop {
            let p = [(); 3].map(|()| self.between(-1.0, 1.0));
            if (LEAST_SQUARE..=1.0).contains(&square_length(p)) {
                return p;
            }
        }
    }

    /// A vector of length 1, to rounding, uniform on the sphere.
    pub fn unit_vector(&mut self) -> [f64; 3] {
        let p = self.point_in_ball();
        let scale = 1.0 / square_length(p).sqrt();
        p.map(|x| x * scale)
    }
}

/// The increment of the state: 2^64 divided by the golden ratio, made odd.
const GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

/// A hash of 64 bits in which every input bit changes every output bit with probability about one
/// half: the output of a generator in this state. For numbers that must depend on a place, such as
/// a pixel, rather than on a sequence.
#[inline]
pub fn mix(bits: u64) -> u64 {
    let z = bits.wrapping_add(GAMMA);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

fn square_length(p: [f64; 3]) -> f64 {
    p[0] * p[0] + p[1] * p[1] + p[2] * p[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_the_reference() {
        // Of the reference implementation, seed 1234567 (Vigna, splitmix64.c).
        let mut rng = Rng::new(1_234_567);
        let numbers = [(); 3].map(|()| rng.next());
        assert_eq!(
            numbers,
            [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423]
        );
    }

    #[test]
    fn numbers_below_a_bound_reach_all_of_them() {
        let mut rng = Rng::new(3);
        let mut seen = [0; 7];
        for _ in 0..700 {
            seen[rng.below(7) as usize] += 1;
        }
        assert!(seen.iter().all(|&n| n > 50), "{seen:?}");
    }

    #[test]
    fn mix_is_the_first_number_of_a_generator() {
        assert_eq!(mix(1_234_567), Rng::new(1_234_567).next());
    }

    #[test]
    fn numbers_of_the_unit_interval_fill_it_and_stay_below_one() {
        let mut rng = Rng::new(1);
        let wide: Vec<f64> = (0..10_000).map(|_| rng.unit_f64()).collect();
        let narrow: Vec<f64> = (0..10_000).map(|_| f64::from(rng.unit_f32())).collect();
        for numbers in [wide, narrow] {
            assert!(numbers.iter().all(|x| (0.0..1.0).contains(x)));
            assert!((numbers.iter().sum::<f64>() / 10_000.0 - 0.5).abs() < 0.015);
        }
    }

    #[test]
    fn numbers_between_two_bounds_average_to_their_middle() {
        let mut rng = Rng::new(1);
        let sum: f64 = (0..10_000).map(|_| rng.between(2.0, 4.0)).sum();
        assert!((sum / 10_000.0 - 3.0).abs() < 0.03);
    }

    #[test]
    fn points_lie_in_the_ball_and_vectors_on_the_sphere_on_all_sides() {
        let mut rng = Rng::new(2);
        let mut octants = [0; 8];
        for _ in 0..800 {
            let length = square_length(rng.point_in_ball()).sqrt();
            assert!((0.001..=1.0).contains(&length));
            let v = rng.unit_vector();
            assert!((square_length(v) - 1.0).abs() < 4.0 * f64::EPSILON);
            octants[(0..3).map(|k| usize::from(v[k] < 0.0) << k).sum::<usize>()] += 1;
        }
        assert!(octants.iter().all(|&n| n > 60), "{octants:?}");
    }
}
