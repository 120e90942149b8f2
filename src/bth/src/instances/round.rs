//! A round of a batch through the instances: what all visits of the round share.

use super::World;
use super::affine::ObjectRay;
use crate::query::sink::Visit;
use crate::rays::{Ray, Surface};
use bth_format::File;
use bth_format::layout::NONE;

/// What the visits of a round share.
pub(super) struct Round<'a> {
    pub(super) world: &'a World,
    pub(super) file: &'a File,
    pub(super) rays: &'a [Ray],
    pub(super) from: Option<&'a [Surface]>,
}

impl Round<'_> {
    /// The ray of a visit in the object's space.
    pub(super) fn object_ray(&self, visit: Visit, tmax: f32) -> ObjectRay {
        self.world.placed_at(visit.instance).inverse.ray(&Ray { tmax, ..self.rays[visit.ray as usize] })
    }

    pub(super) fn hint(&self, ray: usize, instance: u32) -> u32 {
        let from = self.from.map_or(Surface::NONE, |f| f[ray]);
        if from.instance == instance { from.triangle } else { NONE }
    }
}
