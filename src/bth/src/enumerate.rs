//! Enumeration of the instances of a scene that a ray may hit. That of the triangles of an object is
//! [`bvh::enumerate`](crate::bvh::enumerate).

use crate::instances::Placement;
use crate::nodes::ObjectRay;
use crate::rays::Ray;
use crate::scene::Scene;
use crate::starts::world_ray::WorldRay;
use bth_format::object::ObjectView;

/// An instance that a ray may hit.
pub(crate) struct EnteredInstance<'a> {
    /// Its index.
    pub(crate) instance: u32,
    /// Index of its object.
    pub(crate) object_index: u32,
    pub(crate) object: &'a ObjectView<'a>,
    /// `None` if the object's space is world space.
    placement: Option<&'a Placement>,
}

impl EnteredInstance<'_> {
    /// A ray in the space of the object. All queries transform rays as here, so t has the same bits in all of them.
    pub(crate) fn object_ray(&self, ray: WorldRay<'_>) -> ObjectRay {
        match self.placement {
            None => ObjectRay { ray: *ray.ray, t_scale: 1.0 },
            Some(placement) => placement.inverse.ray_from(ray.ray, ray.start_in(self.instance)),
        }
    }
}

impl Scene {
    /// A visible instance.
    pub(crate) fn entered(&self, instance: u32) -> EnteredInstance<'_> {
        let sole = self.sole().filter(|(_, sole)| *sole == instance);
        let placement = self.world().filter(|_| sole.is_none()).map(|world| world.placement(instance));
        let object_index = self.object_of(instance);
        if let Some(world) = self.world() {
            world.mark_traced(object_index);
        }
        EnteredInstance { instance, object_index, object: self.view(object_index), placement }
    }

    /// Calls `visit` with each visible instance that a ray in world space may hit within its range of t. `visit` returns the
    /// greatest t, in world space and rounded to f32, of hits that can still change the result, or `None` to end; instances that
    /// lie beyond may be left out. Returns whether `visit` has ended the enumeration.
    pub(crate) fn enumerate_instances(
        &self,
        ray: &Ray,
        visit: &mut dyn FnMut(EnteredInstance<'_>) -> Option<f32>,
    ) -> bool {
        if let Some((object, instance)) = self.sole() {
            let object_index = self.world().map_or(0, |world| world.placement(instance).object());
            return visit(EnteredInstance { instance, object_index, object, placement: None }).is_none();
        }
        let Some(world) = self.world() else {
            return (0..self.object_count()).any(|object_index| {
                let object = self.view(object_index);
                visit(EnteredInstance { instance: object_index, object_index, object, placement: None })
                    .is_none()
            });
        };
        world.enumerate(ray, &mut |instance| {
            let placement = world.placement(instance);
            let object_index = placement.object();
            world.mark_traced(object_index);
            let object = self.view(object_index);
            visit(EnteredInstance { instance, object_index, object, placement: Some(placement) })
        })
    }
}
