//! Enumerates the instances of a scene that a ray may hit.
//! [`bvh::enumerate`](crate::bvh::enumerate) does the same for the triangles of an object.

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

impl<'a> EnteredInstance<'a> {
    /// A visible instance.
    pub(crate) fn new(scene: &'a Scene, instance: u32) -> EnteredInstance<'a> {
        let sole = scene.sole().filter(|(_, sole)| *sole == instance);
        let placement = scene.world().filter(|_| sole.is_none()).map(|world| world.placement(instance));
        let object_index = scene.object_of(instance);
        if let Some(world) = scene.world() {
            world.mark_traced(object_index);
        }
        EnteredInstance { instance, object_index, object: scene.view(object_index), placement }
    }

    /// A ray in the space of the object. All queries transform rays here, so t has the same bits in
    /// all of them.
    pub(crate) fn object_ray(&self, ray: WorldRay<'_>) -> ObjectRay {
        match self.placement {
            None => ObjectRay { ray: *ray.ray, t_scale: 1.0 },
            Some(placement) => placement.inverse.ray_from(ray.ray, ray.start_in(self.instance)),
        }
    }
}

/// Calls `visit` with each visible instance that a ray in world space may hit within its range of
/// t. `visit` returns the max t, in world space and rounded to f32, of hits that can still change
/// the result, or `None` to end; instances beyond may be skipped. Returns true if `visit` has ended
/// the enumeration.
pub(crate) fn enumerate_instances(
    scene: &Scene,
    ray: &Ray,
    visit: &mut dyn FnMut(EnteredInstance<'_>) -> Option<f32>,
) -> bool {
    if let Some((object, instance)) = scene.sole() {
        let object_index = scene.world().map_or(0, |world| world.placement(instance).object());
        return visit(EnteredInstance { instance, object_index, object, placement: None }).is_none();
    }
    let Some(world) = scene.world() else {
        return (0..scene.object_count()).any(|object_index| {
            let object = scene.view(object_index);
            visit(EnteredInstance { instance: object_index, object_index, object, placement: None }).is_none()
        });
    };
    world.enumerate(ray, &mut |instance| {
        let placement = world.placement(instance);
        let object_index = placement.object();
        world.mark_traced(object_index);
        let object = scene.view(object_index);
        visit(EnteredInstance { instance, object_index, object, placement: Some(placement) })
    })
}
