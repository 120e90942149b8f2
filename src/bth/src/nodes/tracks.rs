//! Interpolation of animation tracks, as of glTF animation samplers (glTF 2.0 specification,
//! appendix C). A track holds the keys of one property of one node.

use bth_format::SceneView;
use bth_format::layout::*;

/// The value of a checked track at a time in seconds. As many of the four numbers are valid as the
/// property has components. A quaternion is not normalized.
pub(crate) fn value(view: &SceneView<'_>, track: &Track, seconds: f64) -> [f64; 4] {
    let property = Property::from_code(track.property).unwrap_or(Property::Visible);
    let interpolation = Interpolation::from_code(track.interpolation).unwrap_or(Interpolation::Step);
    let width = property.width().unwrap_or(0);
    let per_key = width * interpolation.values_per_key();
    let (times, values) = view.keys(track, per_key);
    // Row 0, 1 or 2 of a key. Keys with tangents have three rows: in-tangent, value and
    // out-tangent.
    let row = |key: usize, row: usize| -> [f64; 4] {
        std::array::from_fn(|i| if i < width { values[key * per_key + row * width + i] } else { 0.0 })
    };
    let value_row = interpolation.values_per_key() / 2;
    let next = times.partition_point(|t| *t <= seconds);
    if next == 0 || next == times.len() || interpolation == Interpolation::Step {
        return row(next.saturating_sub(1), value_row);
    }
    let (from, to) = (next - 1, next);
    let (part, duration) = between(times[from], times[to], seconds);
    let (a, b) = (row(from, value_row), row(to, value_row));
    if interpolation == Interpolation::Cubic {
        return hermite(a, row(from, 2), b, row(to, 0), part, duration);
    }
    if property == Property::Rotation { slerp(a, b, part) } else { lerp(a, b, part) }
}

/// The value of a checked track of `width` numbers at a time in seconds, each number by itself: of
/// weights.
pub(crate) fn values(view: &SceneView<'_>, track: &Track, width: usize, seconds: f64) -> Vec<f64> {
    let interpolation = Interpolation::from_code(track.interpolation).unwrap_or(Interpolation::Step);
    let per_key = width * interpolation.values_per_key();
    let (times, values) = view.keys(track, per_key);
    let row = |key: usize, row: usize, i: usize| values[key * per_key + row * width + i];
    let value_row = interpolation.values_per_key() / 2;
    let next = times.partition_point(|t| *t <= seconds);
    if next == 0 || next == times.len() || interpolation == Interpolation::Step {
        return (0..width).map(|i| row(next.saturating_sub(1), value_row, i)).collect();
    }
    let (from, to) = (next - 1, next);
    let (part, duration) = between(times[from], times[to], seconds);
    let one = |i: usize| {
        let (a, b) = (row(from, value_row, i), row(to, value_row, i));
        if interpolation == Interpolation::Cubic {
            return hermite([a; 4], [row(from, 2, i); 4], [b; 4], [row(to, 0, i); 4], part, duration)[0];
        }
        a + part * (b - a)
    };
    (0..width).map(one).collect()
}

/// The part of the time between two keys that has passed, and that time in seconds, at most the
/// max number. Halves do not overflow, and have the same quotient.
fn between(from: f64, to: f64, seconds: f64) -> (f64, f64) {
    let part = (0.5 * seconds - 0.5 * from) / (0.5 * to - 0.5 * from);
    (part, (to - from).min(f64::MAX))
}

/// Returns true if the value of a checked track differs between two times. The track is evaluated
/// only if the keys around the times do not decide.
pub(crate) fn differs(view: &SceneView<'_>, track: &Track, a: f64, b: f64) -> bool {
    let (times, _) = view.keys(track, 0);
    let next_key = |seconds: f64| times.partition_point(|t| *t <= seconds);
    let row = next_key(a);
    if a == b || row == next_key(b) && (row == 0 || row == times.len()) {
        return false;
    }
    if row == next_key(b) && track.interpolation == Interpolation::Step as u32 {
        return false;
    }
    value(view, track, a) != value(view, track, b)
}

/// Linear interpolation.
fn lerp(a: [f64; 4], b: [f64; 4], part: f64) -> [f64; 4] {
    std::array::from_fn(|i| a[i] + part * (b[i] - a[i]))
}

/// Cubic Hermite spline with tangents in units of the value per second.
fn hermite(a: [f64; 4], a_out: [f64; 4], b: [f64; 4], b_in: [f64; 4], part: f64, duration: f64) -> [f64; 4] {
    let (square, cube) = (part * part, part * part * part);
    let weights = [
        2.0 * cube - 3.0 * square + 1.0,
        duration * (cube - 2.0 * square + part),
        3.0 * square - 2.0 * cube,
        duration * (cube - square),
    ];
    std::array::from_fn(|i| {
        weights[0] * a[i] + weights[1] * a_out[i] + weights[2] * b[i] + weights[3] * b_in[i]
    })
}

/// The quaternion with unit length. It is first divided by its max component, so that squares
/// do not overflow.
fn unit(q: [f64; 4]) -> [f64; 4] {
    let greatest = q.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let q = q.map(|x| x / greatest);
    let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    q.map(|x| x / length)
}

/// Spherical linear interpolation along the shorter arc (Shoemake, "Animating rotation with
/// quaternion curves", SIGGRAPH 1985).
fn slerp(a: [f64; 4], b: [f64; 4], part: f64) -> [f64; 4] {
    let (a, mut b) = (unit(a), unit(b));
    let mut cosine: f64 = a.iter().zip(&b).map(|(x, y)| x * y).sum();
    if cosine < 0.0 {
        (b, cosine) = (b.map(|x| -x), -cosine);
    }
    let angle = libm::acos(cosine.min(1.0));
    let whole = libm::sin(angle);
    if whole == 0.0 {
        return lerp(a, b, part);
    }
    let (weight_a, weight_b) = (libm::sin((1.0 - part) * angle) / whole, libm::sin(part * angle) / whole);
    std::array::from_fn(|i| weight_a * a[i] + weight_b * b[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track_of(property: Property, interpolation: Interpolation, keys: u32) -> Track {
        let (property, interpolation) = (property as u32, interpolation as u32);
        Track { node: 0, property, interpolation, keys, first_time: 0, first_value: 0, reserved: [0; 2] }
    }

    fn view_of<'a>(times: &'a [f64], values: &'a [f64]) -> SceneView<'a> {
        SceneView { times, values, ..SceneView::default() }
    }

    /// The value at time `t` of a track with the given keys.
    fn sample(
        property: Property,
        interpolation: Interpolation,
        times: &[f64],
        values: &[f64],
        t: f64,
    ) -> Vec<f64> {
        let (track, view) = (track_of(property, interpolation, times.len() as u32), view_of(times, values));
        value(&view, &track, t)[..property.width().unwrap()].to_vec()
    }

    #[test]
    fn values_are_constant_beyond_the_keys_and_steps_keep_the_last_key() {
        let keys: &[f64] = &[0.0, 0.0, 0.0, 4.0, 8.0, 2.0];
        let at = |i, t| sample(Property::Translation, i, &[1.0, 3.0], keys, t);
        for interpolation in [Interpolation::Step, Interpolation::Linear] {
            assert_eq!(at(interpolation, -5.0), [0.0; 3]);
            assert_eq!(at(interpolation, 1.0), [0.0; 3]);
            assert_eq!(at(interpolation, 3.0), [4.0, 8.0, 2.0]);
            assert_eq!(at(interpolation, 9.0), [4.0, 8.0, 2.0]);
        }
        assert_eq!(at(Interpolation::Step, 2.999), [0.0; 3]);
        assert_eq!(at(Interpolation::Linear, 1.5), [1.0, 2.0, 0.5]);
    }

    #[test]
    fn differs_is_true_exactly_where_values_differ() {
        let values: Vec<f64> = [0.0, 1.0, 1.0, 3.0].iter().flat_map(|x| [*x; 3]).collect();
        for (interpolation, a, b, differ) in [
            (Interpolation::Linear, 0.1, 0.2, true),
            (Interpolation::Linear, 1.1, 1.9, false),
            (Interpolation::Linear, 0.9, 1.9, true),
            (Interpolation::Linear, -3.0, 0.0, false),
            (Interpolation::Linear, 3.0, 7.0, false),
            (Interpolation::Linear, f64::NAN, 0.5, true),
            (Interpolation::Step, 0.1, 0.9, false),
            (Interpolation::Step, 0.9, 1.0, true),
            (Interpolation::Step, 1.0, 2.9, false),
        ] {
            let track = track_of(Property::Scale, interpolation, 4);
            let view = view_of(&[0.0, 1.0, 2.0, 3.0], &values);
            assert_eq!(differs(&view, &track, a, b), differ, "{interpolation:?} {a} {b}");
            assert_eq!(differs(&view, &track, b, a), differ, "{interpolation:?} {b} {a}");
        }
    }

    #[test]
    fn the_time_between_keys_may_exceed_the_greatest_number() {
        let times = [-1.5e308, 1.5e308];
        for (t, expected) in [(0.0, 2.0), (0.75e308, 3.0), (1.5e308, 4.0)] {
            let keys = [0.0, 0.0, 0.0, 4.0, 4.0, 4.0];
            assert_eq!(sample(Property::Scale, Interpolation::Linear, &times, &keys, t), [expected; 3]);
        }
        let keys = [[0.0; 3], [0.0; 3], [0.0; 3], [0.0; 3], [4.0; 3], [0.0; 3]].concat();
        assert_eq!(sample(Property::Scale, Interpolation::Cubic, &times, &keys, 0.0), [2.0; 3]);
    }

    #[test]
    fn cubic_splines_have_the_values_and_tangents_of_their_keys() {
        let zero = [0.0; 3];
        let keys = [zero, [1.0, 2.0, 3.0], [4.0, 0.0, 0.0], [0.0, -6.0, 0.0], [2.0, 2.0, 2.0], zero].concat();
        let at = |t| sample(Property::Scale, Interpolation::Cubic, &[0.0, 2.0], &keys, t);
        assert_eq!(at(0.0), [1.0, 2.0, 3.0]);
        assert_eq!(at(2.0), [2.0, 2.0, 2.0]);
        let slope =
            |t: f64, step: f64| (0..3).map(|i| (at(t + step)[i] - at(t)[i]) / step).collect::<Vec<_>>();
        for (found, expected) in [(slope(0.0, 1e-6), [4.0, 0.0, 0.0]), (slope(2.0, -1e-6), [0.0, -6.0, 0.0])]
        {
            for i in 0..3 {
                assert!((found[i] - expected[i]).abs() < 1e-4, "{found:?}");
            }
        }
    }

    #[test]
    fn rotations_have_constant_speed_along_the_shorter_arc() {
        let half = |degrees: f64| (degrees.to_radians() / 2.0).sin_cos();
        let ((s, c), sign) = (half(100.0), -3.0);
        // The second key is the same rotation with the other sign, and not of unit length.
        let keys = [0.0, 0.0, 0.0, 1.0, 0.0, s * sign, 0.0, c * sign];
        for part in [0.1, 0.5, 0.9] {
            let q = sample(Property::Rotation, Interpolation::Linear, &[0.0, 1.0], &keys, part);
            let (s, c) = half(100.0 * part);
            assert!((q[1] - s).abs() < 1e-15 && (q[3] - c).abs() < 1e-15, "{q:?}");
        }
        let same = sample(
            Property::Rotation,
            Interpolation::Linear,
            &[0.0, 1.0],
            &[0.0, 0.6, 0.0, 0.8, 0.0, 0.6, 0.0, 0.8],
            0.3,
        );
        assert!((same[1] - 0.6).abs() < 1e-15 && (same[3] - 0.8).abs() < 1e-15, "{same:?}");
    }
}
