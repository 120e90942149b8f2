//! One ray through the instances: it enters one after the other, the nearest box first, and nothing is queued.

use super::World;
use crate::SMALL;
use crate::bvh::coherence::is_same_octant;
use crate::bvh::packet;
use crate::nodes::affine::ObjectRay;
use crate::object;
use crate::objects::Objects;
use crate::query::{Steps, better};
use crate::rays::{Hit, PrimitiveRef, Ray};
use crate::simd::Isa;
use bth_format::object::ObjectView;

/// Fewer rays go one by one if a single instance is visible.
const MIN_RAYS_OF_ONE_INSTANCE: usize = 16;
/// Fewer rays go one by one through several instances.
const MIN_RAYS: usize = packet::entry::MIN_RAYS;

/// Fewer rays in different directions go one by one through several instances.
fn min_incoherent_rays() -> usize {
    match Isa::chosen() {
        Isa::Avx512 => 48,
        Isa::Avx2 => 128,
        Isa::Scalar => MIN_RAYS,
        // With vectors of 128 bits.
        _ => 256,
    }
}

/// An instance that a ray enters.
struct Entered<'a> {
    object: &'a ObjectView<'a>,
    /// The ray in the space of the object.
    ray: ObjectRay,
    /// The triangle on which it starts, or `NONE`.
    from: u32,
}

impl World {
    /// Whether the rays of a batch are so few that they are faster one by one; measured, see docs/notes/scenes.md.
    pub(crate) fn go_one_by_one(&self, rays: &[Ray]) -> bool {
        if self.has_single_visible() {
            return rays.len() < MIN_RAYS_OF_ONE_INSTANCE;
        }
        let is_same_octant = |i: usize| is_same_octant(&rays[0], &rays[i]);
        rays.len() < MIN_RAYS
            || rays.len() < min_incoherent_rays()
                && !(is_same_octant(rays.len() / 2) && is_same_octant(rays.len() - 1))
    }

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
