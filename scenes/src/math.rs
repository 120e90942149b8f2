//! Sine and cosine that are equal to the last bit on every machine, and the choice of a resolution.

/// Sine and cosine of an angle in turns (1 is the full circle).
///
/// The angle is reduced to at most an eighth of a turn from a multiple of a quarter turn, where
/// Taylor polynomials of degree 17 and 16 are good to about one unit in the last place. The
/// library functions of different systems differ in the last place; this function does not.
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

/// The resolution n, at least `least`, of a generator that makes `per * n * n` faces: the n whose
/// square is nearest to `faces / per`.
pub(crate) fn resolution_for(faces: u32, per: u32, least: u32) -> u32 {
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
}
