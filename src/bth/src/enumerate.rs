//! Enumerates the instances of a scene that a ray may hit.
//! [`bvh::enumerate`](crate::bvh::enumerate) does the same for the triangles of an object.

use crate::instances::{Placement, RayInInstance, World};
use crate::intersect::exact_ray::{ExactRay, LineSource};
use crate::intersect::origin::{RoundedLine, RoundedOrigin};
use crate::intersect::start_point::StartPoint;
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
    scene: &'a Scene,
    /// The instances and its placement; `None` if the object's space is world space.
    placed: Option<(&'a World, &'a Placement)>,
}

impl<'a> EnteredInstance<'a> {
    /// A visible instance with its placement, if there are any.
    pub(crate) fn new(
        scene: &'a Scene,
        instance: u32,
        placement: Option<&'a Placement>,
    ) -> EnteredInstance<'a> {
        let is_sole = scene.sole_in_f32().is_some_and(|(_, sole)| sole == instance);
        let object_index = scene.object_of(instance);
        if let Some(world) = scene.world() {
            world.mark_traced(object_index);
        }
        let world = scene.world().filter(|_| !is_sole);
        let placed = world.zip(placement);
        EnteredInstance { instance, object_index, object: scene.view(object_index), scene, placed }
    }

    /// A point of world space in the space of the object's source.
    pub(crate) fn point(&self, point: RoundedOrigin) -> RoundedOrigin {
        let Some((_, placement)) = &self.placed else { return point };
        let line = RoundedLine { origin: point, direction: [1.0, 0.0, 0.0], direction_error: 0.0 };
        placement.line(&line).origin
    }

    /// A ray in the instance, ended at `tmax`. All queries transform rays here, so t has the same
    /// bits in all of them.
    pub(crate) fn ray<'r>(&self, ray: WorldRay<'r>, tmax: f32) -> EnteredRay<'r>
    where
        'a: 'r,
    {
        match &self.placed {
            Some((world, placement)) => {
                let at = (self.instance, *placement);
                let of_instance = RayInInstance::new(world, self.scene.objects(), at, ray, tmax);
                EnteredRay::InInstance(of_instance.relative_to(self.object.anchor))
            }
            None if ray.wide.is_some() || ray.start.is_some_and(|of| of.instance != self.instance) => {
                let objects = Some(self.scene.objects());
                EnteredRay::InInstance(RayInInstance::in_world(objects, self.instance, ray, tmax))
            }
            None => EnteredRay::InWorld { ray: Ray { tmax, ..*ray.ray }, start: ray.start_in(self.instance) },
        }
    }
}

/// A ray in the space of an instance's object.
pub(crate) enum EnteredRay<'a> {
    /// Object space is world space.
    InWorld {
        /// The ray.
        ray: Ray,
        /// Where it starts, if that is on a triangle of the object.
        start: Option<&'a StartPoint>,
    },
    /// The object is placed in the world.
    InInstance(RayInInstance<'a>),
}

impl EnteredRay<'_> {
    /// The ray for decisions.
    pub(crate) fn exact(&self) -> ExactRay<'_> {
        match self {
            EnteredRay::InWorld { ray, start: None } => ExactRay::plain(ray),
            EnteredRay::InWorld { ray, start: Some(start) } => ExactRay::new(ray, LineSource::Start(start)),
            EnteredRay::InInstance(of_instance) => of_instance.exact_ray(),
        }
    }

    /// Factor from t in object space to t in world space, a power of two.
    pub(crate) fn t_scale(&self) -> f32 {
        match self {
            EnteredRay::InWorld { .. } => 1.0,
            EnteredRay::InInstance(of_instance) => of_instance.of_object.t_scale,
        }
    }
}

/// Calls `visit` with each visible instance that a ray in world space may hit within its range of
/// t. `visit` returns the max t, in world space and rounded to f32, of hits that can still change
/// the result, or `None` to end; instances beyond may be skipped. Returns true if `visit` has ended
/// the enumeration. `line` returns the line of the ray, as exact as it is known.
pub(crate) fn enumerate_instances(
    scene: &Scene,
    (ray, line): (&Ray, &dyn Fn() -> RoundedLine),
    visit: &mut dyn FnMut(EnteredInstance<'_>) -> Option<f32>,
) -> bool {
    if let Some((object, instance)) = scene.sole_in_f32() {
        let object_index = scene.world().map_or(0, |world| world.placement(instance).object());
        return visit(EnteredInstance { instance, object_index, object, scene, placed: None }).is_none();
    }
    let Some(world) = scene.world() else {
        return (0..scene.object_count()).any(|object_index| {
            let object = scene.view(object_index);
            let instance = object_index;
            visit(EnteredInstance { instance, object_index, object, scene, placed: None }).is_none()
        });
    };
    world.enumerate_placed(ray, line, |instance, placement| {
        let object_index = placement.object();
        world.mark_traced(object_index);
        let (object, placed) = (scene.view(object_index), Some((world, placement)));
        visit(EnteredInstance { instance, object_index, object, scene, placed })
    })
}
