//! The parameters of a batch of rays through the instances of a scene.

use super::World;
use crate::SMALL;
use crate::nodes::affine::ObjectRay;
use crate::objects::Objects;
use crate::query::sink::Visit;
use crate::rays::{PrimitiveRef, Ray};
use bth_format::layout::NONE;

/// A batch of rays in world space, and the scene that they go through.
pub(super) struct SceneBatch<'a> {
    pub(super) world: &'a World,
    pub(super) objects: &'a Objects,
    pub(super) rays: &'a [Ray],
    /// For each ray the triangle on which it starts; see [`RayBatch::from`](crate::RayBatch::from).
    pub(super) from: Option<&'a [PrimitiveRef]>,
}

impl SceneBatch<'_> {
    /// The ray of a visit in the space of the object, ended at `tmax`.
    pub(super) fn object_ray(&self, visit: Visit, tmax: f32) -> ObjectRay {
        self.world.placement(visit.instance).inverse.ray(&Ray { tmax, ..self.rays[visit.ray as usize] })
    }

    /// The triangles on which rays start, if they are given and used.
    pub(super) fn hints(&self) -> Option<&[PrimitiveRef]> {
        self.from.filter(|_| !SMALL)
    }

    /// The triangle of an instance's object on which a ray starts, or `NONE`.
    pub(super) fn hint(&self, ray: usize, instance: u32) -> u32 {
        let from = self.hints().map_or(PrimitiveRef::NONE, |f| f[ray]);
        if from.instance == instance { from.triangle } else { NONE }
    }
}
