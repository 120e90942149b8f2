//! One ray through the instances: it enters one after the other, the nearest box first, and nothing is queued.

use super::World;
use crate::SMALL;
use crate::nodes::affine::ObjectRay;
use crate::object;
use crate::objects::Objects;
use crate::query::{Steps, better};
use crate::rays::{Hit, PrimitiveRef, Ray};
use bth_format::object::ObjectView;

/// Fewer rays go through the instances one by one: sixteen coherent rays take 0.9 of that time as a batch, sixteen others 1.25.
pub(crate) const MIN_BATCH: usize = 16;

/// An instance that a ray enters.
struct Entered<'a> {
    object: &'a ObjectView<'a>,
    /// The ray in the space of the object.
    ray: ObjectRay,
    /// The triangle on which it starts, or `NONE`.
    from: u32,
}

impl World {
    /// Stores the nearest hit of a ray, or [`Hit::MISS`], as [`Self::nearest`] does for many. `from` is the triangle on which it starts, or
    /// [`PrimitiveRef::NONE`].
    #[inline(never)]
    pub(crate) fn store_nearest_of_ray(
        &self,
        objects: &Objects,
        ray: &Ray,
        from: PrimitiveRef,
        best: &mut Hit,
    ) {
        self.nearest_by((objects, ray, from), best, |entered, instance, hit| {
            object::store_nearest(entered.object, &entered.ray.ray, entered.from, instance, hit);
        });
    }

    /// As [`Self::store_nearest_of_ray`], with the statistics of the traversal of objects.
    pub(crate) fn nearest_counted(&self, objects: &Objects, ray: &Ray, from: PrimitiveRef) -> (Hit, Steps) {
        let (mut best, mut steps) = (Hit::MISS, Steps::default());
        self.nearest_by((objects, ray, from), &mut best, |entered, instance, hit| {
            let of_object;
            (*hit, of_object) =
                object::nearest_counted(entered.object, &entered.ray.ray, entered.from, instance);
            steps += of_object;
        });
        (best, steps)
    }

    /// Stores the nearest hit of a ray in all instances; `trace` stores that in one.
    #[inline(always)]
    fn nearest_by(
        &self,
        (objects, ray, from): (&Objects, &Ray, PrimitiveRef),
        best: &mut Hit,
        mut trace: impl FnMut(&Entered<'_>, u32, &mut Hit),
    ) {
        *best = Hit::MISS;
        self.enumerate(ray, &mut |instance| {
            // Neither is NaN: for a ray whose `tmax` is, nothing is enumerated.
            let tmax = if best.t < ray.tmax { best.t } else { ray.tmax };
            let entered = self.enter(objects, instance, &Ray { tmax, ..*ray }, from);
            let mut hit = Hit::MISS;
            trace(&entered, instance, &mut hit);
            let Some(nearer) = better(ray, best, &hit, entered.ray.t_scale) else { return Some(tmax) };
            *best = nearer;
            Some(nearer.t)
        });
    }

    /// Whether a ray hits anything, as [`Self::any`] computes it for many; `from` as for [`Self::store_nearest_of_ray`].
    #[inline(never)]
    pub(crate) fn any_of_ray(&self, objects: &Objects, ray: &Ray, from: PrimitiveRef) -> bool {
        self.enumerate(ray, &mut |instance| {
            let entered = self.enter(objects, instance, ray, from);
            (!object::any(entered.object, &entered.ray.ray, entered.from)).then_some(ray.tmax)
        })
    }

    #[inline(always)]
    fn enter<'a>(&self, objects: &'a Objects, instance: u32, ray: &Ray, from: PrimitiveRef) -> Entered<'a> {
        let placement = self.placement(instance);
        self.mark_traced(placement.object());
        let from = if SMALL { PrimitiveRef::NONE } else { from };
        Entered {
            object: objects.view(placement.object()),
            ray: placement.inverse.ray(ray),
            from: from.triangle_of(instance),
        }
    }
}
