//! From the means of the samples to a picture that can be shown.

use crate::args::{Args, Mode};
use crate::picture::{Picture, quantized, srgb};
use crate::{legend, ramp};
use glam::Vec3;

/// The picture of a mode; `colors` in rows from the top.
pub(crate) fn develop(colors: &[Vec3], args: &Args) -> Picture {
    let (width, height) = args.size;
    let maximum = match args.mode {
        Mode::Steps => args.scale.unwrap_or_else(|| high_end(colors)),
        _ => 0,
    };
    let display = |color: &Vec3| match args.mode {
        Mode::Shaded | Mode::Ao | Mode::Path | Mode::Instances => color.to_array().map(srgb),
        Mode::Normals => color.to_array(),
        Mode::Steps => ramp::color(color.x / maximum as f32),
    };
    let pixels = colors.iter().map(|color| quantized(display(color))).collect();
    let mut picture = Picture { width, height, pixels };
    if args.mode == Mode::Steps {
        legend::draw(&mut picture, maximum);
    }
    picture
}

/// The upper end of the heat map: the 99.8th percentile, so that single pixels do not darken the
/// rest, rounded up to a multiple of 4 so that the legend's numbers are whole.
fn high_end(colors: &[Vec3]) -> u32 {
    let mut values: Vec<f32> = colors.iter().map(|c| c.x).collect();
    let Some(last) = values.len().checked_sub(1) else { return 4 };
    let rank = last - last / 500;
    let (_, value, _) = values.select_nth_unstable_by(rank, f32::total_cmp);
    (value.ceil() as u32).max(1).next_multiple_of(4)
}
