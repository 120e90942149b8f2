//! Motion blur: the times within an open shutter at which a frame is sampled, and which pixels are
//! sampled at each of them.
//!
//! A frame is the mean of its samples, and each sample sees the scene at one time. The scene is set
//! to one of these times after the other; at each of them the tracks are evaluated, and the boxes
//! of the top level bound what is there at that time. So every sample is exact for its time. The
//! times of a pixel are stratified; pixels next to each other take different ones, so that motion
//! becomes fine noise rather than a row of copies.

use bth_random::mix;
use std::ops::Range;

/// Number of times per frame that is aimed at where a pixel has fewer samples: enough that copies
/// of what moves over the picture lie close together.
const TIMES: u32 = 64;
/// Most times among which each sample of a pixel is chosen. More would leave few samples for each
/// time, which cost more than a batch of many.
const MAX_SLOTS: u32 = 16;

/// For how long a frame is exposed, and at which times.
#[derive(Clone, Debug)]
pub(crate) struct Shutter {
    /// How long it is open, in frames; `None` for pictures of an instant.
    open: Option<f64>,
    /// Number of samples per pixel. Each has a stratum of the open time.
    samples: u32,
    /// Number of times in each stratum. Each pixel takes one of them.
    slots: u32,
    /// For each sample its stratum. The first samples of a pixel, however few, are spread over the
    /// whole of the open time, for pictures that are refined over time.
    strata: Vec<u32>,
}

/// A time at which some samples are taken.
#[derive(Clone, Debug)]
pub(crate) struct Exposure {
    /// The time relative to the frame's time, in frames.
    pub(crate) offset: f64,
    /// Numbers of the samples of a pixel.
    pub(crate) samples: Range<u32>,
    /// The slot of this time, and the number of slots.
    slot: (u32, u32),
}

impl Shutter {
    /// A shutter that is open for a number of frames around the time of the frame, or for an
    /// instant, and pictures of a number of samples per pixel.
    pub(crate) fn new(open: Option<f64>, samples: u32) -> Self {
        if open.is_none() {
            return Self { open, samples, slots: 1, strata: Vec::new() };
        }
        // Ranks of the multiples of the golden ratio, modulo 1.
        let part = |sample: u32| (f64::from(sample) * 0.618_033_988_749_894_9).fract();
        let mut order: Vec<u32> = (0..samples).collect();
        order.sort_by(|a, b| part(*a).total_cmp(&part(*b)));
        let mut strata = vec![0; samples as usize];
        order.into_iter().zip(0..).for_each(|(sample, rank)| strata[sample as usize] = rank);
        Self { open, samples, slots: TIMES.div_ceil(samples.max(1)).min(MAX_SLOTS), strata }
    }

    /// Returns true if it is open for more than an instant.
    pub(crate) fn is_open(&self) -> bool {
        self.open.is_some()
    }

    /// Number of times in each stratum.
    pub(crate) fn slots(&self) -> u32 {
        self.slots
    }

    /// The time of the samples with a number in the pixels of a slot. `sample` is below the number
    /// of samples and `slot` below [`Self::slots`].
    pub(crate) fn exposure(&self, sample: u32, slot: u32) -> Exposure {
        let offset = self.open.map_or(0.0, |open| {
            let row = u64::from(self.strata[sample as usize]) * u64::from(self.slots) + u64::from(slot);
            let count = u64::from(self.samples) * u64::from(self.slots);
            open * ((row as f64 + 0.5) / count as f64 - 0.5)
        });
        Exposure { offset, samples: sample..sample + 1, slot: (slot, self.slots) }
    }

    /// All times of a frame. Taken one after the other, they give the samples of each pixel in
    /// order.
    pub(crate) fn exposures(&self) -> Vec<Exposure> {
        if self.open.is_none() {
            return vec![Exposure { offset: 0.0, samples: 0..self.samples, slot: (0, 1) }];
        }
        let of_sample = |sample: u32| (0..self.slots).map(move |slot| self.exposure(sample, slot));
        (0..self.samples).flat_map(of_sample).collect()
    }
}

impl Exposure {
    /// Returns true if the samples of a pixel are taken at this time.
    pub(crate) fn takes(&self, (x, y): (u32, u32)) -> bool {
        let (slot, slots) = self.slot;
        let pixel = (u64::from(y) << 32) | u64::from(x);
        // The constant differs from the one of sample points, whose rotations would otherwise go
        // with the times.
        slots == 1
            || mix(mix(pixel ^ 0x7368_7574_7465_7200) ^ u64::from(self.samples.start)) % u64::from(slots)
                == u64::from(slot)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_pixel_takes_each_sample_once_and_one_in_each_stratum() {
        for samples in [1, 2, 3, 7, 16, 64, 100] {
            let shutter = Shutter::new(Some(0.5), samples);
            assert!(shutter.slots() * samples >= TIMES.min(MAX_SLOTS * samples), "{samples}");
            for pixel in [(0, 0), (3, 1), (1279, 719), (16383, 16383)] {
                let taken: Vec<Exposure> =
                    shutter.exposures().into_iter().filter(|exposure| exposure.takes(pixel)).collect();
                let numbers: Vec<u32> = taken.iter().map(|exposure| exposure.samples.start).collect();
                assert_eq!(numbers, (0..samples).collect::<Vec<_>>(), "in order");
                let stratum =
                    |exposure: &Exposure| ((exposure.offset / 0.5 + 0.5) * f64::from(samples)) as u32;
                let mut strata: Vec<u32> = taken.iter().map(stratum).collect();
                strata.sort_unstable();
                assert_eq!(strata, numbers, "{samples} samples at {pixel:?}");
            }
        }
    }

    #[test]
    fn times_lie_evenly_around_the_frame_and_pixels_share_them_evenly() {
        let shutter = Shutter::new(Some(2.0), 16);
        let mut times: Vec<f64> = shutter.exposures().iter().map(|exposure| exposure.offset).collect();
        times.sort_by(f64::total_cmp);
        assert_eq!(times.len(), 64);
        for (row, time) in times.iter().enumerate() {
            assert!((time - (2.0 * (row as f64 + 0.5) / 64.0 - 1.0)).abs() < 1e-12, "{row}: {time}");
        }
        let pixels: Vec<(u32, u32)> = (0..4096).map(|i| (i % 64, i / 64)).collect();
        for exposure in shutter.exposures() {
            let taken = pixels.iter().filter(|pixel| exposure.takes(**pixel)).count();
            assert!((900..1150).contains(&taken), "{taken} of 4096 at {exposure:?}");
        }
    }

    #[test]
    fn an_instant_is_one_exposure_of_all_samples() {
        let exposures = Shutter::new(None, 16).exposures();
        assert_eq!(exposures.len(), 1);
        assert_eq!((exposures[0].offset, exposures[0].samples.clone()), (0.0, 0..16));
        assert!(exposures[0].takes((5, 6)));
        assert!(!Shutter::new(None, 16).is_open());
    }

    /// The first samples of a picture that is refined over time are spread over the open time, too.
    #[test]
    fn the_first_samples_see_all_of_the_motion() {
        let shutter = Shutter::new(Some(1.0), 64);
        for count in [4, 8, 16] {
            let mut times: Vec<f64> = (0..count).map(|sample| shutter.exposure(sample, 0).offset).collect();
            times.sort_by(f64::total_cmp);
            let gaps = times.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
            assert!(gaps < 2.0 / f64::from(count), "{count}: {times:?}");
        }
    }
}
