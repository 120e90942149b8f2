//! Tone mapping: curves that compress bright values, and the picture of mean colours.

use super::oidn::Denoiser;
use super::picture::{Picture, quantized, srgb};
use super::{denoise, heat_map};
use crate::args::{Args, Denoise, Mode};
use crate::messages::warn;
use crate::shading::Shaded;
use glam::Vec3;
use std::sync::LazyLock;

/// The tone mapper "PBR Neutral" of the Khronos Group (2024): base colours under plain light keep
/// their hue and saturation, and only what is brighter than 0.8 is compressed, towards white.
fn neutral(color: Vec3) -> Vec3 {
    const DARK: f32 = 0.04;
    const START: f32 = 0.8 - DARK;
    const DESATURATION: f32 = 0.15;
    let least = color.min_element();
    let color = color - if least < 2.0 * DARK { least - least * least / (4.0 * DARK) } else { DARK };
    let peak = color.max_element();
    if peak < START {
        return color;
    }
    let left = 1.0 - START;
    let compressed = 1.0 - left * left / (peak + left - START);
    let white = 1.0 - 1.0 / (DESATURATION * (peak - compressed) + 1.0);
    (color * (compressed / peak)).lerp(Vec3::splat(compressed), white)
}

/// Removes noise. `auto` takes Open Image Denoise where it is installed, but not for parts of a
/// sequence that many machines render: not all of them may have it, and it looks at whole pictures.
fn denoised(means: &mut [Shaded], size: (u32, u32), args: &Args) {
    let library = match args.denoise {
        Denoise::Off => return,
        Denoise::On => None,
        Denoise::Auto => LIBRARY.as_ref().filter(|_| args.shard.is_none() && args.tiles.is_none()),
        Denoise::Oidn => LIBRARY.as_ref(),
    };
    if let Some(library) = library {
        match library.filter(means, size) {
            Ok(()) => return,
            Err(what) => warn(&format!("Open Image Denoise failed, so the built-in filter is used: {what}")),
        }
    }
    denoise::filter(means, size, args.spp);
}

/// Pixels around a part of a picture that its pixels depend on.
pub(crate) fn margin(args: &Args) -> u32 {
    let is_filtered = args.mode == Mode::Path && args.denoise != Denoise::Off;
    if is_filtered { denoise::REACH } else { 0 }
}

/// Open Image Denoise, where it is installed.
static LIBRARY: LazyLock<Option<Denoiser>> = LazyLock::new(Denoiser::load);

/// Returns true if Open Image Denoise is installed.
pub(crate) fn has_library() -> bool {
    LIBRARY.is_some()
}

/// The picture of the means of the pixels, in rows from the top, of a width and height; `factor` is
/// for light in mode path, in which noise is removed where the options say so.
pub(crate) fn to_picture(mut means: Vec<Shaded>, size: (u32, u32), args: &Args, factor: f32) -> Picture {
    if args.mode == Mode::Path {
        denoised(&mut means, size, args);
    }
    let means = means.as_slice();
    let (width, height) = size;
    let maximum = match args.mode {
        Mode::Steps => args.scale.unwrap_or_else(|| upper_end(means)),
        _ => 0,
    };
    let display = |color: Vec3| match args.mode {
        Mode::Shaded | Mode::Ao | Mode::Instances | Mode::Clay => color.to_array().map(srgb),
        Mode::Path => neutral(color * factor).to_array().map(srgb),
        Mode::Normals => color.to_array(),
        Mode::Steps => heat_map::color(color.x / maximum as f32),
    };
    let pixels = means.iter().map(|mean| quantized(display(mean.color))).collect();
    let mut picture = Picture { width, height, pixels };
    if args.mode == Mode::Steps {
        heat_map::draw_bar(&mut picture, maximum);
    }
    picture
}

/// The upper end of the heat map: the 99.8th percentile, so that single pixels do not darken the
/// rest, rounded up to a multiple of 4 so that the numbers next to the color bar are whole.
fn upper_end(means: &[Shaded]) -> u32 {
    let mut values: Vec<f32> = means.iter().map(|mean| mean.color.x).collect();
    let Some(last) = values.len().checked_sub(1) else { return 4 };
    let rank = last - last / 500;
    let (_, value, _) = values.select_nth_unstable_by(rank, f32::total_cmp);
    (value.ceil() as u32).max(1).next_multiple_of(4)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Grey of 0.5 loses the 0.04 that gloss adds; colours are continuous where compression starts,
    /// never reach 1, and bright ones turn white.
    #[test]
    fn neutral_tones_keep_colors_and_compress_light() {
        assert_eq!(neutral(Vec3::ZERO), Vec3::ZERO);
        assert!((neutral(Vec3::splat(0.5)) - 0.46).abs().max_element() < 1e-6);
        assert!((neutral(Vec3::new(0.6, 0.3, 0.1)) - Vec3::new(0.56, 0.26, 0.06)).length() < 1e-6);
        let [below, above] = [0.799_99, 0.800_01].map(|light| neutral(Vec3::splat(light)).x);
        assert!((below - above).abs() < 1e-4, "{below} {above}");
        let bright = neutral(Vec3::new(900.0, 500.0, 300.0));
        assert!(bright.max_element() <= 1.0 && bright.min_element() > 0.95, "{bright}");
        let rising: Vec<f32> = (0..1000).map(|k| neutral(Vec3::splat(k as f32 / 50.0)).x).collect();
        assert!(rising.is_sorted());
    }
}
