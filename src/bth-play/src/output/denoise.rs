//! Removes noise from pictures of mode path with an edge-avoiding filter: Dammertz, Sewtz, Hanika
//! and Lensch, "Edge-Avoiding À-Trous Wavelet Transform for Fast Global Illumination Filtering"
//! (2010). How much neighbours may differ follows from how much the samples of a pixel do (Schied
//! et al., "Spatiotemporal Variance-Guided Filtering", 2017), so that what has no noise stays as it
//! is.

use crate::color::luminance;
use crate::shading::Shaded;
use glam::Vec3;
use rayon::prelude::*;

/// Passes; the pixels that are looked at lie twice as far apart in each.
const PASSES: u32 = 5;
/// Pixels on each side that the filter of a pixel reads: one for specks, then two steps a pass.
pub(super) const REACH: u32 = 1 + 2 * ((1 << PASSES) - 1);
/// Weights of a pixel and of those one and two steps away, along each axis.
const KERNEL: [f32; 3] = [0.375, 0.25, 0.0625];
/// Standard deviations by which the light of neighbours may differ.
const DEVIATIONS: f32 = 3.0;
/// Differences of normals and of albedos that count as edges.
const NORMAL: f32 = 0.1;
const ALBEDO: f32 = 0.06;

/// Luminance below which a pixel counts as black, in units of the light of white.
const DARKEST: f64 = 1e-6;
/// A difference that nobody sees, relative to the light.
const TINY: f32 = 1e-4;

/// Differences from which on the weight of a neighbour is zero in f32.
const TOO_DIFFERENT: f32 = 104.0;

/// Light without the albedo of the surface, and how much it varies.
#[derive(Clone, Copy)]
struct Pixel {
    light: Vec3,
    luminance: f32,
    /// Variance of the luminance.
    variance: f32,
}

/// Calls `visit` with the pixels that are up to `reach` steps of `far` pixels away along each axis
/// and lie in the picture, row by row, and with their steps.
#[inline(always)]
fn neighbours(
    at: usize,
    (width, height): (usize, usize),
    (reach, far): (i64, i64),
    mut visit: impl FnMut(usize, i64, i64),
) {
    let (x, y, width, height) = ((at % width) as i64, (at / width) as i64, width as i64, height as i64);
    for (dy, row) in
        (-reach..=reach).map(|dy| (dy, y + dy * far)).filter(|(_, row)| (0..height).contains(row))
    {
        for dx in -reach..=reach {
            let column = x + dx * far;
            if (0..width).contains(&column) {
                visit((row * width + column) as usize, dx, dy);
            }
        }
    }
}

/// What light is divided by: colours of textures are no noise.
fn albedo(mean: &Shaded) -> Vec3 {
    mean.albedo.max(Vec3::splat(0.02))
}

/// Replaces the colours of a picture; each pixel is the mean of `samples` samples.
pub(super) fn filter(means: &mut [Shaded], size: (u32, u32), samples: u32) {
    let size = (size.0 as usize, size.1 as usize);
    // A pixel that is brighter than all around it is a speck.
    let brightest = |at: usize| {
        let mut most = 0.0f64;
        neighbours(at, size, (1, 1), |other, dx, dy| {
            if (dx, dy) != (0, 0) {
                most = most.max(luminance(means[other].color));
            }
        });
        most
    };
    let pixel = |at: usize| {
        let mean = &means[at];
        let own = luminance(mean.color);
        let limit = if size.0 * size.1 > 1 { brightest(at).max(DARKEST) } else { own };
        let kept = if own > limit { (limit / own) as f32 } else { 1.0 };
        let by = luminance(albedo(mean)).max(0.02) as f32;
        let variance = (mean.square - (own * own) as f32).max(0.0) / samples.max(1) as f32;
        let light = mean.color * kept / albedo(mean);
        Pixel { light, luminance: luminance(light) as f32, variance: variance * kept * kept / (by * by) }
    };
    let mut pixels: Vec<Pixel> = (0..means.len()).into_par_iter().map(pixel).collect();
    for pass in 0..PASSES {
        let far = 1i64 << pass;
        let filtered = |at: usize| {
            let (mean, own) = (&means[at], pixels[at].luminance);
            let (mut sum, mut count) = (0.0, 0);
            neighbours(at, size, (1, 1), |other, _, _| {
                sum += pixels[other].variance;
                count += 1;
            });
            let deviation = (sum / count as f32).sqrt() * DEVIATIONS + TINY * own + DARKEST as f32;
            let (mut light, mut variance, mut total) = (Vec3::ZERO, 0.0, 0.0);
            neighbours(at, size, (2, far), |other, dx, dy| {
                let (there, of) = (&pixels[other], &means[other]);
                // Pixels with equal shares of an edge have equal means, too.
                let turned = (mean.normal - of.normal).length_squared() / (NORMAL * NORMAL);
                let color = (mean.albedo - of.albedo).abs().max_element() / ALBEDO;
                let difference = (own - there.luminance).abs() / deviation + turned + color * color;
                let near = KERNEL[dx.unsigned_abs() as usize] * KERNEL[dy.unsigned_abs() as usize];
                let weight = match difference {
                    _ if other == at => near,
                    large if large > TOO_DIFFERENT => return,
                    small => near * (-small).exp(),
                };
                light += there.light * weight;
                variance += there.variance * weight * weight;
                total += weight;
            });
            let light = light / total;
            Pixel { light, luminance: luminance(light) as f32, variance: variance / (total * total) }
        };
        pixels = (0..pixels.len()).into_par_iter().map(filtered).collect();
    }
    for (mean, pixel) in means.iter_mut().zip(pixels) {
        mean.color = pixel.light * albedo(mean);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bth_random::Rng;

    const SIZE: (u32, u32) = (48, 32);
    const SAMPLES: u32 = 8;

    /// A picture of two walls of different brightness with noise; the light of each sample is
    /// uniform from 0 to twice the mean.
    fn noisy() -> (Vec<Shaded>, impl Fn(usize) -> f32) {
        let truth = |at: usize| if at % SIZE.0 as usize >= 20 { 0.8 } else { 0.2 };
        let mut random = Rng::new(3);
        let pixel = |at: usize| {
            let normal = if truth(at) > 0.5 { Vec3::X } else { Vec3::Y };
            let mut sum = Shaded::default();
            for _ in 0..SAMPLES {
                let light = truth(at) * 2.0 * random.below(1 << 20) as f32 / (1 << 20) as f32;
                sum += Shaded { color: Vec3::splat(light), albedo: Vec3::ONE, normal, square: light * light };
            }
            sum / SAMPLES as f32
        };
        ((0..(SIZE.0 * SIZE.1) as usize).map(pixel).collect(), truth)
    }

    fn error(means: &[Shaded], truth: impl Fn(usize) -> f32) -> f32 {
        let squares = means.iter().enumerate().map(|(at, mean)| (mean.color.x - truth(at)).powi(2));
        (squares.sum::<f32>() / means.len() as f32).sqrt()
    }

    #[test]
    fn noise_goes_and_edges_stay() {
        let (mut means, truth) = noisy();
        let before = error(&means, &truth);
        filter(&mut means, SIZE, SAMPLES);
        let after = error(&means, &truth);
        assert!(after < before / 5.0, "{before} {after}");
    }

    #[test]
    fn what_has_no_noise_stays_and_specks_go() {
        let plain = |light: f32| Shaded {
            color: Vec3::splat(light),
            albedo: Vec3::ONE,
            normal: Vec3::Z,
            square: light * light,
        };
        let mut ramp: Vec<Shaded> = (0..SIZE.0 * SIZE.1).map(|at| plain((at % SIZE.0) as f32)).collect();
        let before: Vec<f32> = ramp.iter().map(|mean| mean.color.x).collect();
        filter(&mut ramp, SIZE, SAMPLES);
        assert!(ramp.iter().zip(&before).all(|(mean, x)| (mean.color.x - x).abs() < 0.02));
        let mut speck = vec![plain(0.5); (SIZE.0 * SIZE.1) as usize];
        speck[500].color = Vec3::splat(100.0);
        filter(&mut speck, SIZE, SAMPLES);
        assert!(speck.iter().all(|mean| (mean.color.x - 0.5).abs() < 0.01));
        let mut one = [plain(2.0)];
        filter(&mut one, (1, 1), 1);
        assert!((one[0].color.x - 2.0).abs() < 1e-5);
    }
}
