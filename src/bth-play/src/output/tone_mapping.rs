//! Tone mapping: curves that compress bright values, and the picture of mean colours.

use super::heat_map;
use super::picture::{Picture, quantized, srgb};
use crate::args::{Args, Mode};
use glam::Vec3;

/// Compresses linear values above 0.6 towards 1 instead of clipping them.
pub(crate) fn shoulder(color: Vec3) -> Vec3 {
    let compressed = |c: f32| if c <= 0.6 { c } else { 0.6 + 0.4 * (1.0 - (-(c - 0.6) / 0.4).exp()) };
    Vec3::new(compressed(color.x), compressed(color.y), compressed(color.z))
}

/// The extended operator of Reinhard et al. ("Photographic Tone Reproduction for Digital Images",
/// 2002, equation 4), which maps 4 to white. It is for mean colours: the curve is concave, so that
/// means of compressed samples would be the darker the more these differ.
fn reinhard(color: Vec3) -> Vec3 {
    color * (Vec3::ONE + color / 16.0) / (Vec3::ONE + color)
}

/// The picture of the mean colours of the pixels, in rows from the top.
pub(crate) fn to_picture(colors: &[Vec3], args: &Args) -> Picture {
    let (width, height) = args.size;
    let maximum = match args.mode {
        Mode::Steps => args.scale.unwrap_or_else(|| upper_end(colors)),
        _ => 0,
    };
    let display = |color: &Vec3| match args.mode {
        Mode::Shaded | Mode::Ao | Mode::Instances | Mode::Clay => color.to_array().map(srgb),
        Mode::Path => reinhard(*color).to_array().map(srgb),
        Mode::Normals => color.to_array(),
        Mode::Steps => heat_map::color(color.x / maximum as f32),
    };
    let pixels = colors.iter().map(|color| quantized(display(color))).collect();
    let mut picture = Picture { width, height, pixels };
    if args.mode == Mode::Steps {
        heat_map::draw_bar(&mut picture, maximum);
    }
    picture
}

/// The upper end of the heat map: the 99.8th percentile, so that single pixels do not darken the
/// rest, rounded up to a multiple of 4 so that the numbers next to the color bar are whole.
fn upper_end(colors: &[Vec3]) -> u32 {
    let mut values: Vec<f32> = colors.iter().map(|c| c.x).collect();
    let Some(last) = values.len().checked_sub(1) else { return 4 };
    let rank = last - last / 500;
    let (_, value, _) = values.select_nth_unstable_by(rank, f32::total_cmp);
    (value.ceil() as u32).max(1).next_multiple_of(4)
}
