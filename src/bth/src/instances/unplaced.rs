//! Single rays through objects whose space is world space, which no instance places.

use super::lines::RayInInstance;
use crate::object;
use crate::objects::Objects;
use crate::query::Steps;
use crate::rays::{Hit, Ray, StartRay};
use crate::starts::world_ray::WorldRay;
use bth_format::object::ObjectView;

/// A ray as one of several objects takes it.
pub(crate) enum UnplacedRay<'a> {
    /// A ray of f32.
    Plain(Ray),
    /// It starts on the object.
    Start(StartRay),
    /// It starts on another object, or it is a ray in f64.
    Line(RayInInstance<'a>),
}

impl<'a> UnplacedRay<'a> {
    /// A ray in the object with this index, ended at `tmax`.
    pub(crate) fn new(
        objects: &'a Objects,
        instance: u32,
        world_ray: WorldRay<'a>,
        tmax: f32,
    ) -> UnplacedRay<'a> {
        let WorldRay { ray, start, wide } = world_ray;
        match (start, wide) {
            (None, None) => UnplacedRay::Plain(Ray { tmax, ..*ray }),
            (Some(of), _) if of.instance == instance => {
                UnplacedRay::Start(StartRay { start: of.start, direction: ray.direction, tmax })
            }
            _ => UnplacedRay::Line(RayInInstance::in_world(Some(objects), instance, world_ray, tmax)),
        }
    }

    /// Nearest hit in the object.
    pub(crate) fn nearest(&self, object: &ObjectView<'_>, instance: u32) -> Hit {
        match self {
            UnplacedRay::Plain(ray) => object::nearest(object, ray, instance),
            UnplacedRay::Start(ray) => object::nearest(object, ray, instance),
            UnplacedRay::Line(ray) => ray.hit_in_world(object::nearest(object, ray, instance)),
        }
    }

    /// Like [`Self::nearest`], with the statistics of the traversal.
    pub(crate) fn nearest_counted(&self, object: &ObjectView<'_>, instance: u32) -> (Hit, Steps) {
        match self {
            UnplacedRay::Plain(ray) => object::nearest_counted(object, ray, instance),
            UnplacedRay::Start(ray) => object::nearest_counted(object, ray, instance),
            UnplacedRay::Line(ray) => {
                let (hit, steps) = object::nearest_counted(object, ray, instance);
                (ray.hit_in_world(hit), steps)
            }
        }
    }

    /// Returns true if the ray hits anything in the object.
    pub(crate) fn any(&self, object: &ObjectView<'_>) -> bool {
        match self {
            UnplacedRay::Plain(ray) => object::any(object, ray),
            UnplacedRay::Start(ray) => object::any(object, ray),
            UnplacedRay::Line(ray) => object::any(object, ray),
        }
    }
}
