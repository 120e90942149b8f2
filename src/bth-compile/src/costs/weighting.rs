//! Rays of a scene in the space of one of its objects; they weight the nodes of the object.

use crate::sampling::SampleRay;

/// The rays of a scene's cameras, lights and frames that concern an object.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Weighting {
    /// Rays that enter the object's box from outside.
    pub outside: Vec<SampleRay>,
    /// Rays that start on the object's triangles.
    pub surface: Vec<SampleRay>,
}

impl Weighting {
    /// BLAKE3 of the rays, hexadecimal.
    pub(super) fn hash(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        for rays in [&self.outside, &self.surface] {
            hasher.update(&(rays.len() as u64).to_le_bytes());
            for ray in rays {
                let numbers = ray.origin.iter().chain(&ray.direction).chain([&ray.tmax]);
                numbers.for_each(|x| {
                    hasher.update(&x.to_le_bytes());
                });
                hasher.update(&ray.from.unwrap_or(u32::MAX).to_le_bytes());
            }
        }
        hasher.finalize().to_hex().to_string()
    }

    /// Shares of rays from outside and from surfaces.
    pub(super) fn shares(&self) -> [f64; 2] {
        let [outside, surface] = [&self.outside, &self.surface].map(|rays| rays.len() as f64);
        let all = (outside + surface).max(1.0);
        [outside / all, surface / all]
    }
}
