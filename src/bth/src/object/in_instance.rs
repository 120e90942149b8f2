//! Queries of a ray of the world in one instance, by its object.

use crate::object;
use crate::query::Steps;
use crate::rays::{Hit, Ray, StartRay};
use crate::starts::world_ray::WorldRay;
use bth_format::object::ObjectView;

impl WorldRay<'_> {
    /// Nearest hit in an instance, given the ray in the space of its object, with its end.
    pub(crate) fn nearest_in(&self, object: &ObjectView<'_>, instance: u32, ray: &Ray) -> Hit {
        let start = |start: &StartRay| object::nearest(object, start, instance);
        self.in_object(instance, ray, start, |ray| object::nearest(object, ray, instance))
    }

    /// Like [`Self::nearest_in`], with the statistics of the traversal.
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
}
