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

/// Light without the albedo of the surface, and how much it varies.
#[derive(Clone, Copy)]
struct Pixel {
    light: Vec3,
    /// Variance of its luminance.
    variance: f32,
}

/// The neighbour of a pixel, if it lies in the picture.
fn neighbour(at: usize, (width, height): (usize, usize), dx: i64, dy: i64) -> Option<usize> {
    let (x, y) = ((at % width) as i64 + dx, (at / width) as i64 + dy);
    ((0..width as i64).contains(&x) && (0..height as i64).contains(&y))
        .then(|| y as usize * width + x as usize)
}

/// What light is divided by: colours of textures are no noise.
fn albedo(mean: &Shaded) -> Vec3 {
    mean.albedo.max(Vec3::splat(0.02))
}

/// Replaces the colours of a picture; each pixel is the mean of `samples` samples.
pub(super) fn filter(means: &mut [Shaded], size: (u32, u32), samples: u32) {
    let size = (size.0 as usize, size.1 as usize);
    let around = |at: usize, far: i64| {
        let steps = move |k: i64| (k % 3 - 1, k / 3 - 1);
        (0..9).map(steps).filter_map(move |(dx, dy)| neighbour(at, size, dx * far, dy * far))
    };
    // A pixel that is brighter than all around it is a speck.
    let brightest = |at: usize| {
        let others = around(at, 1).filter(|other| *other != at).map(|other| luminance(means[other].color));
        others.fold(0.0, f64::max)
    };
    let pixel = |at: usize| {
        let mean = &means[at];
        let own = luminance(mean.color);
        let limit = if size.0 * size.1 > 1 { brightest(at).max(DARKEST) } else { own };
        let kept = if own > limit { (limit / own) as f32 } else { 1.0 };
        let by = luminance(albedo(mean)).max(0.02) as f32;
        let variance = (mean.square - (own * own) as f32).max(0.0) / samples.max(1) as f32;
        Pixel { light: mean.color * kept / albedo(mean), variance: variance * kept * kept / (by * by) }
    };
    let mut pixels: Vec<Pixel> = (0..means.len()).into_par_iter().map(pixel).collect();
    for pass in 0..PASSES {
        let far = 1i64 << pass;
        let filtered = |at: usize| {
            let here = &pixels[at];
            let (mean, own) = (&means[at], luminance(here.light) as f32);
            let sum: f32 = around(at, 1).map(|other| pixels[other].variance).sum();
            let deviation =
                (sum / around(at, 1).count() as f32).sqrt() * DEVIATIONS + TINY * own + DARKEST as f32;
            let (mut light, mut variance, mut total) = (Vec3::ZERO, 0.0, 0.0);
            for k in 0..25i64 {
                let (dx, dy) = (k % 5 - 2, k / 5 - 2);
                let Some(other) = neighbour(at, size, dx * far, dy * far) else { continue };
                let (there, of) = (&pixels[other], &means[other]);
                // Pixels with equal shares of an edge have equal means, too.
                let turned = (mean.normal - of.normal).length_squared() / (NORMAL * NORMAL);
                let color = (mean.albedo - of.albedo).abs().max_element() / ALBEDO;
                let differs = (own - luminance(there.light) as f32).abs() / deviation;
                let near = KERNEL[dx.unsigned_abs() as usize] * KERNEL[dy.unsigned_abs() as usize];
                let weight = near * (-differs - turned - color * color).exp();
                let weight = if other == at { near } else { weight };
                light += there.light * weight;
                variance += there.variance * weight * weight;
                total += weight;
            }
            Pixel { light: light / total, variance: variance / (total * total) }
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
