//! The little mathematics that the generators share, equal to the last bit on every machine.

/// A point or vector.
pub(crate) type Vec3 = [f64; 3];

pub(crate) fn add(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}
pub(crate) fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
pub(crate) fn scale(a: Vec3, s: f64) -> Vec3 {
    [a[0] * s, a[1] * s, a[2] * s]
}
pub(crate) fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
pub(crate) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
pub(crate) fn length(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}
pub(crate) fn normalize(a: Vec3) -> Vec3 {
    scale(a, 1.0 / length(a))
}

/// Sine and cosine of an angle in turns (1 is the full circle).
///
/// The angle is reduced to an eighth of a turn on either side of a multiple of a quarter, where
/// Taylor polynomials of degree 17 and 16 are good to about one unit in the last place. The
/// library functions of different systems differ in the last place; this does not.
pub(crate) fn sin_cos(turns: f64) -> (f64, f64) {
    let quarter = (4.0 * turns + 0.5).floor();
    let x = (turns - quarter / 4.0) * std::f64::consts::TAU;
    let y = x * x;
    let series = |first: f64, from: i32| {
        let (mut sum, mut term) = (first, first);
        for k in 0..8 {
            let n = f64::from(from + 2 * k);
            term = -term * y / ((n + 1.0) * (n + 2.0));
            sum += term;
        }
        sum
    };
    let (sin, cos) = (series(x, 1), series(1.0, 0));
    match (quarter - 4.0 * (quarter / 4.0).floor()) as u32 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// SplitMix64 (Steele, Lea and Flood 2014).
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }
    /// Uniform in [0, 1), a multiple of 2^-53.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }
    /// Uniform in [lower, upper).
    pub(crate) fn range(&mut self, lower: f64, upper: f64) -> f64 {
        lower + (upper - lower) * self.unit()
    }
    /// A point in the unit ball, by rejection; never nearer to the centre than a thousandth.
    pub(crate) fn in_ball(&mut self) -> Vec3 {
        loop {
            let p = [self.range(-1.0, 1.0), self.range(-1.0, 1.0), self.range(-1.0, 1.0)];
            let square = dot(p, p);
            if (1e-6..=1.0).contains(&square) {
                return p;
            }
        }
    }
    /// A direction, uniform on the sphere.
    pub(crate) fn direction(&mut self) -> Vec3 {
        normalize(self.in_ball())
    }
}

/// The whole number n, at least `least`, for which `per * n * n` is nearest to `faces`.
pub(crate) fn side_for(faces: u32, per: u32, least: u32) -> u32 {
    ((f64::from(faces) / f64::from(per)).sqrt() + 0.5).floor().max(f64::from(least)) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_agree_with_the_library() {
        for i in -4000..4000 {
            let turns = f64::from(i) / 977.0;
            let (s, c) = sin_cos(turns);
            let angle = turns.fract() * std::f64::consts::TAU;
            // The reference loses precision in its own reduction by up to the angle's ulp.
            assert!((s - angle.sin()).abs() < 8.0 * f64::EPSILON, "sin {turns}");
            assert!((c - angle.cos()).abs() < 8.0 * f64::EPSILON, "cos {turns}");
        }
    }

    #[test]
    fn random_numbers_fill_their_range() {
        let mut random = Random::new(1);
        let sum: f64 = (0..10_000).map(|_| random.range(2.0, 4.0)).sum();
        assert!((sum / 10_000.0 - 3.0).abs() < 0.03);
    }
}
