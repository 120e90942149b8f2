//! The color map of the heat map: black over violet and orange to pale yellow.

/// Inferno-like stops (after the map of Smith and van der Walt, 2015), sRGB.
const STOPS: [[f32; 3]; 9] = [
    [0.001, 0.000, 0.014],
    [0.122, 0.047, 0.283],
    [0.333, 0.059, 0.428],
    [0.533, 0.135, 0.415],
    [0.730, 0.212, 0.333],
    [0.890, 0.350, 0.199],
    [0.977, 0.554, 0.035],
    [0.975, 0.789, 0.241],
    [0.988, 0.998, 0.645],
];

/// The colour (sRGB) of a value from 0 to 1.
pub(crate) fn color(value: f32) -> [f32; 3] {
    let at = value.clamp(0.0, 1.0) * (STOPS.len() - 1) as f32;
    let i = (at as usize).min(STOPS.len() - 2);
    let (low, high, part) = (STOPS[i], STOPS[i + 1], at - i as f32);
    std::array::from_fn(|c| low[c] + (high[c] - low[c]) * part)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brightness_rises_all_the_way() {
        let brightness =
            |v: f32| color(v).iter().zip([0.2126, 0.7152, 0.0722]).map(|(c, w)| c * w).sum::<f32>();
        for i in 0..100 {
            assert!(brightness(i as f32 / 100.0) < brightness((i + 1) as f32 / 100.0));
        }
    }
}
