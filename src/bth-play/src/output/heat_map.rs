//! The heat map: its colours from black over violet and orange to pale yellow, and its color bar.

use super::picture::{Picture, quantized};

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

/// Digits of 3×5 pixels: rows from the top, three bits each.
const DIGITS: [[u8; 5]; 10] = [
    [7, 5, 5, 5, 7],
    [2, 6, 2, 2, 7],
    [7, 1, 7, 4, 7],
    [7, 1, 7, 1, 7],
    [5, 5, 7, 1, 1],
    [7, 4, 7, 1, 7],
    [7, 4, 7, 5, 7],
    [7, 1, 1, 1, 1],
    [7, 5, 7, 5, 7],
    [7, 5, 7, 1, 7],
];
/// Numbers next to the bar.
const TICKS: u32 = 4;

/// Draws the color bar for values from 0 to `maximum` at the right edge, if there is room.
pub(super) fn draw_bar(picture: &mut Picture, maximum: u32) {
    let scale = (picture.height / 240).max(1);
    let digits = maximum.to_string().len() as u32;
    let (bar, gap) = (10 * scale, 4 * scale);
    let width = bar + 2 * gap + digits * 4 * scale;
    let (top, height) = (picture.height / 8, picture.height * 3 / 4);
    if picture.width < 4 * width || height < 16 * scale {
        return;
    }
    let left = picture.width - width - gap;
    for y in 0..height {
        let value = 1.0 - y as f32 / (height - 1).max(1) as f32;
        let color = quantized(color(value));
        (0..bar).for_each(|x| picture.set(left + x, top + y, color));
    }
    border(picture, left, top, bar, height);
    for tick in 0..=TICKS {
        let y = top + (height - 1) * (TICKS - tick) / TICKS;
        let value = (f64::from(maximum) * f64::from(tick) / f64::from(TICKS)).round() as u32;
        (0..gap).for_each(|x| picture.set(left + bar + x, y, [255; 3]));
        number(picture, value, left + bar + 2 * gap, y.saturating_sub(5 * scale / 2), scale);
    }
}

fn border(picture: &mut Picture, left: u32, top: u32, width: u32, height: u32) {
    for x in 0..width {
        picture.set(left + x, top, [255; 3]);
        picture.set(left + x, top + height - 1, [255; 3]);
    }
    for y in 0..height {
        picture.set(left, top + y, [255; 3]);
        picture.set(left + width - 1, top + y, [255; 3]);
    }
}

fn number(picture: &mut Picture, value: u32, left: u32, top: u32, scale: u32) {
    for (position, digit) in value.to_string().bytes().enumerate() {
        let rows = DIGITS[usize::from(digit - b'0')];
        for (y, row) in rows.into_iter().enumerate() {
            for x in (0..3).filter(|x| row >> (2 - x) & 1 == 1) {
                let at = (left + (position as u32 * 4 + x) * scale, top + y as u32 * scale);
                for i in 0..scale * scale {
                    picture.set(at.0 + i % scale, at.1 + i / scale, [255; 3]);
                }
            }
        }
    }
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

    #[test]
    fn fits_any_picture_size() {
        for (width, height) in [(1, 1), (16, 9), (200, 40), (64, 1000), (1280, 720)] {
            let mut picture = Picture { width, height, pixels: vec![[0; 3]; (width * height) as usize] };
            draw_bar(&mut picture, 4_000_000_000);
            draw_bar(&mut picture, 0);
        }
    }
}
