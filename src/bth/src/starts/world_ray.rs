//! Rays in world space that may start on a triangle of an instance.

use crate::intersect::start_point::StartPoint;
use crate::object;
use crate::query::Steps;
use crate::rays::{Hit, Ray, Start, StartRay};
use bth_format::layout::NONE;
use bth_format::object::ObjectView;

/// A start in the space of the object of an instance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InstanceStart {
    pub(crate) instance: u32,
    pub(crate) start: Start,
    pub(crate) point: StartPoint,
}

impl InstanceStart {
    /// For a ray that starts on no triangle.
    pub(crate) fn none(origin: [f32; 3]) -> InstanceStart {
        let point = StartPoint::beside(origin);
        InstanceStart { instance: NONE, start: Start::NONE, point }
    }
}

/// A ray in world space, and its start if that is on a triangle. Its origin is then the start
/// rounded to f32, where other instances see it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WorldRay<'a> {
    pub(crate) ray: &'a Ray,
    pub(crate) start: Option<&'a InstanceStart>,
}

impl<'a> WorldRay<'a> {
    /// A ray with an origin.
    #[inline(always)]
    pub(crate) fn plain(ray: &'a Ray) -> WorldRay<'a> {
        WorldRay { ray, start: None }
    }

    /// The start, if it is on this instance.
    #[inline(always)]
    pub(crate) fn start_in(&self, instance: u32) -> Option<&'a StartPoint> {
        self.start.filter(|start| start.instance == instance).map(|start| &start.point)
    }

    /// Nearest hit in an instance, given the ray in the space of its object, with its end.
    pub(crate) fn nearest_in(&self, object: &ObjectView<'_>, instance: u32, ray: &Ray) -> Hit {
        let start = |start: &StartRay| object::nearest(object, start, instance);
        self.in_object(instance, ray, start, |ray| object::nearest(object, ray, instance))
    }

    /// As [`Self::nearest_in`], with the statistics of the traversal.
    pub(crate) fn nearest_counted_in(
        &self,
        object: &ObjectView<'_>,
        instance: u32,
        ray: &Ray,
    ) -> (Hit, Steps) {
        let start = |start: &StartRay| object::nearest_counted(object, start, instance);
        self.in_object(instance, ray, start, |ray| object::nearest_counted(object, ray, instance))
    }

    /// Returns true if the ray hits anything in an instance; parameters as for
    /// [`Self::nearest_in`].
    pub(crate) fn any_in(&self, object: &ObjectView<'_>, instance: u32, ray: &Ray) -> bool {
        self.in_object(instance, ray, |start| object::any(object, start), |ray| object::any(object, ray))
    }

    /// As a ray in an instance, given the ray in the space of its object: one that starts there, or
    /// else one with an origin.
    #[inline(always)]
    pub(crate) fn in_object<T>(
        &self,
        instance: u32,
        ray: &Ray,
        start: impl FnOnce(&StartRay) -> T,
        plain: impl FnOnce(&Ray) -> T,
    ) -> T {
        match self.start.filter(|start| start.instance == instance) {
            Some(of) => start(&StartRay { start: of.start, direction: ray.direction, tmax: ray.tmax }),
            None => plain(ray),
        }
    }
}

/// A ray that was placed in the world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedRay {
    pub(crate) ray: Ray,
    pub(crate) start: Option<InstanceStart>,
}

impl PlacedRay {
    pub(crate) fn world_ray(&self) -> WorldRay<'_> {
        WorldRay { ray: &self.ray, start: self.start.as_ref() }
    }
}
