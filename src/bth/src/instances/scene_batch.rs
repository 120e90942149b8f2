//! The parameters of a batch of rays through the instances of a scene.

use super::World;
use crate::nodes::affine::ObjectRay;
use crate::objects::Objects;
use crate::query::sink::Visit;
use crate::rays::{Ray, StartRay};
use crate::starts::world_ray::{InstanceStart, WorldRay};
use bth_format::object::ObjectView;

/// A batch of rays in world space, and the scene that they go through.
pub(super) struct SceneBatch<'a> {
    pub(super) world: &'a World,
    pub(super) objects: &'a Objects,
    pub(super) rays: &'a [Ray],
    /// For each ray its start, if rays start on triangles; else empty.
    pub(super) starts: &'a [InstanceStart],
}

impl SceneBatch<'_> {
    /// The ray of a visit in the space of the object, ended at `tmax`.
    pub(super) fn object_ray(&self, visit: Visit, tmax: f32) -> ObjectRay {
        let ray = Ray { tmax, ..self.rays[visit.ray as usize] };
        self.world
            .placement(visit.instance)
            .inverse
            .ray_from(&ray, self.start(visit).map(|start| &start.point))
    }

    /// As [`WorldRay::in_object`], for the ray of a visit.
    pub(super) fn in_object<T>(
        &self,
        visit: Visit,
        ray: &Ray,
        start: impl FnOnce(&StartRay) -> T,
        plain: impl FnOnce(&Ray) -> T,
    ) -> T {
        let index = visit.ray as usize;
        let world_ray = WorldRay { ray: &self.rays[index], start: self.starts.get(index) };
        world_ray.in_object(visit.instance, ray, start, plain)
    }

    /// Where the ray of a visit starts, if that is on a triangle of the instance.
    #[inline(always)]
    pub(super) fn start(&self, visit: Visit) -> Option<&InstanceStart> {
        self.starts.get(visit.ray as usize).filter(|start| start.instance == visit.instance)
    }
}

/// Visits of the instances of an object by rays of a batch.
#[derive(Clone, Copy)]
pub(super) struct ObjectVisits<'a> {
    pub(super) batch: &'a SceneBatch<'a>,
    pub(super) object: &'a ObjectView<'a>,
    pub(super) visits: &'a [Visit],
}
