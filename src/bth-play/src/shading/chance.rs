//! Chance in shading: whether a ray passes a surface that blends.

use crate::sampling::Sampler;
use bth::rays::PrimitiveRef;
use bth_random::mix;

/// What decides by chance whether a ray passes a surface of alpha mode BLEND: a sample of a pixel, and a number for each ray of the
/// sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chance {
    pub(crate) sampler: Sampler,
    /// Number of the sample within its pixel.
    pub(crate) index: u32,
    /// Number of the ray within its sample.
    pub(crate) ray: u64,
}

impl Chance {
    /// A number from 0 to below 1 for a surface: low-discrepancy over the samples of a pixel.
    pub(crate) fn at(&self, primitive: PrimitiveRef) -> f32 {
        let surface = mix(u64::from(primitive.instance) << 32 | u64::from(primitive.triangle));
        self.sampler.point(surface ^ mix(self.ray), self.index).x as f32
    }
}
