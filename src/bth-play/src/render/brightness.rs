//! Automatic exposure: a few small pictures of the sequence decide for all of its frames, so that
//! these do not flicker, whatever part of them is rendered.

use super::frame::{render_tile, tile_count};
use super::region::Region;
use super::shutter::Shutter;
use crate::args::{Args, Mode};
use crate::camera::SceneSetup;
use crate::color::luminance;
use crate::failure::Failure;
use crate::shading::{FrameContext, Shaded, Shader};
use bth::Scene;
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::path::Path;

/// Height of the small pictures, and samples of a pixel.
const HEIGHT: u32 = 48;
const SAMPLES: u32 = 8;
/// Shares of the pixels, from the darkest on, between which they count.
const COUNTED: [f64; 2] = [0.1, 0.95];
/// Mean luminance of a picture, as a geometric mean.
const MEAN: f64 = 0.34;
/// Luminance below which a pixel counts as black, in units of the light of white.
const DARKEST: f64 = 1e-4;
/// Largest factor of the exposure, and its inverse the smallest.
const LARGEST: f64 = 64.0;

/// The factor of light in mode path; the scene is left at some frame of `(first, last)`.
///
/// # Errors
/// If a frame cannot be set, or the file lacks what the mode needs.
pub(crate) fn light_factor(
    scene: &mut Scene,
    file: &Path,
    setup: &SceneSetup,
    args: &Args,
    (first, last): (i32, i32),
) -> Result<f32, Failure> {
    if let Some(stops) = args.exposure {
        return Ok(stops.exp2() as f32);
    }
    if args.mode != Mode::Path && !args.window {
        return Ok(1.0);
    }
    let (width, height) = args.size;
    let width = (u64::from(HEIGHT) * u64::from(width) / u64::from(height)).clamp(1, 1000) as u32;
    let mut small = args.with_samples(SAMPLES);
    (small.mode, small.size) = (Mode::Path, (width, HEIGHT));
    let mut luminances = Vec::new();
    for frame in BTreeSet::from([first, first.midpoint(last), last]) {
        scene.set_frame(frame)?;
        let frame = FrameContext::new(scene, file, setup, setup.camera(scene, &small), &small)?;
        let shader = Shader::new(&frame);
        let instant = &Shutter::new(None, SAMPLES).exposures()[0];
        let tiles: Vec<_> = (0..tile_count(small.size))
            .into_par_iter()
            .map(|tile| render_tile(&frame, tile, instant, &shader))
            .collect();
        let mut sums = vec![Shaded::default(); (width * HEIGHT) as usize];
        tiles.iter().for_each(|tile| tile.add_to(&mut sums, &Region::whole(small.size)));
        luminances.extend(sums.iter().map(|sum| luminance(sum.color / SAMPLES as f32)));
    }
    Ok(chosen(luminances) as f32)
}

/// The exposure for pixels of these luminances.
fn chosen(mut luminances: Vec<f64>) -> f64 {
    luminances.sort_unstable_by(f64::total_cmp);
    let [from, to] = COUNTED.map(|share| (share * luminances.len() as f64) as usize);
    let counted = &luminances[from..to.max(from + 1).min(luminances.len())];
    let mean = counted.iter().map(|l| l.max(DARKEST).log2()).sum::<f64>() / counted.len().max(1) as f64;
    (MEAN / mean.exp2()).clamp(1.0 / LARGEST, LARGEST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_become_as_bright_as_wanted_but_for_the_brightest_and_the_darkest() {
        let grey = |l: f64| chosen(vec![l; 100]);
        assert!((grey(0.34) - 1.0).abs() < 1e-9 && (grey(0.085) - 4.0).abs() < 1e-9);
        let mut pixels = vec![0.17; 100];
        pixels[3] = 1e6;
        (0..9).for_each(|k| pixels[40 + k] = 0.0);
        assert!((chosen(pixels) - 2.0).abs() < 1e-9);
        assert_eq!((grey(0.0), grey(1e9), chosen(vec![0.34])), (LARGEST, 1.0 / LARGEST, 1.0));
    }
}
