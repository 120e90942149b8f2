//! One ray through the instances: it enters one after the other, the nearest box first, and nothing
//! is queued.

use super::World;
use super::lines::RayInInstance;
use super::placement::Placement;
use crate::bvh::packet;
use crate::coherence::is_same_octant;
use crate::intersect::exact_line::ExactT;
use crate::object;
use crate::objects::Objects;
use crate::query::double::better_wide;
use crate::query::{Steps, better};
use crate::rays::{Hit, PrimitiveRef, Ray};
use crate::simd::Isa;
use crate::starts::world_ray::WorldRay;
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

impl World {
    /// Returns true if the rays of a batch are so few that they are faster one by one; measured,
    /// see docs/notes/scenes.md.
    /// `narrow` returns a ray.
    pub(crate) fn go_one_by_one(&self, count: usize, narrow: impl Fn(usize) -> Ray) -> bool {
        if self.groups().is_some() {
            return true;
        }
        if self.only_visible().is_some() {
            return count < MIN_RAYS_OF_ONE_INSTANCE;
        }
        let is_same_octant = |i: usize| is_same_octant(&narrow(0), &narrow(i));
        count < MIN_RAYS
            || count < min_incoherent_rays() && !(is_same_octant(count / 2) && is_same_octant(count - 1))
    }

    /// Stores the nearest hit of a ray, or [`Hit::MISS`], as [`Self::nearest`] does for many.
    #[inline(never)]
    pub(crate) fn store_nearest_of_ray(&self, objects: &Objects, ray: WorldRay<'_>, best: &mut Hit) {
        self.nearest_by(
            objects,
            ray,
            best,
            |_| true,
            |object, ray, _, hit| {
                object::store_nearest(object, ray, ray.instance, hit);
            },
        );
    }

    /// Like [`Self::store_nearest_of_ray`], with the statistics of the traversal of objects.
    pub(crate) fn nearest_counted(&self, objects: &Objects, ray: WorldRay<'_>) -> (Hit, Steps) {
        let (mut best, mut steps) = (Hit::MISS, Steps::default());
        self.nearest_by(
            objects,
            ray,
            &mut best,
            |_| true,
            |object, ray, _, hit| {
                let counted = object::nearest_counted(object, ray, ray.instance);
                *hit = counted.0;
                steps += counted.1;
            },
        );
        (best, steps)
    }

    /// Stores the nearest hit of a ray in all instances that it `enters`; `trace` stores that in
    /// one, given the nearest so far.
    #[inline(always)]
    pub(crate) fn nearest_by(
        &self,
        objects: &Objects,
        world_ray: WorldRay<'_>,
        best: &mut Hit,
        enters: impl Fn(u32) -> bool,
        mut trace: impl FnMut(&ObjectView<'_>, &RayInInstance<'_>, &Hit, &mut Hit),
    ) {
        *best = Hit::MISS;
        let ray = world_ray.ray;
        self.enter_each(world_ray, |instance, placement| {
            // Neither is NaN: for a ray whose `tmax` is, nothing is enumerated.
            let end = if world_ray.wide.is_some() { best.t.next_up() } else { best.t };
            let tmax = if end < ray.tmax { end } else { ray.tmax };
            if !enters(instance) {
                return Some(tmax);
            }
            let (object, of_instance) = self.enter(objects, (instance, placement), world_ray, tmax);
            let mut hit = Hit::MISS;
            trace(object, &of_instance, best, &mut hit);
            let t_scale = of_instance.of_object.t_scale;
            // The results of two branches would be passed through memory.
            if world_ray.wide.is_some() {
                let exact_t = |hit: &Hit| self.exact_t(objects, world_ray, hit);
                let Some(nearer) = better_wide(best, &hit, t_scale, exact_t) else { return Some(tmax) };
                *best = nearer;
                // Another instance may be nearer by less than f32 can tell.
                return Some(nearer.t.next_up());
            }
            let Some(nearer) = better(ray, best, &hit, t_scale) else { return Some(tmax) };
            *best = nearer;
            Some(nearer.t)
        });
    }

    /// The exact t of a hit.
    pub(super) fn exact_t(&self, objects: &Objects, ray: WorldRay<'_>, hit: &Hit) -> Option<ExactT> {
        let PrimitiveRef { instance, triangle } = hit.primitive;
        let placement = self.placed(instance)?;
        let (object, of_instance) = self.enter(objects, (instance, &placement), ray, f32::INFINITY);
        of_instance.exact_t(object, triangle)
    }

    /// Returns true if a ray hits anything, as [`Self::any`] computes it for many.
    #[inline(never)]
    pub(crate) fn any_of_ray(&self, objects: &Objects, ray: WorldRay<'_>) -> bool {
        self.any_by(objects, ray, |_| true, |object, ray| object::any(object, ray))
    }

    /// Returns true if `hits` returns true for an instance that a ray `enters`.
    #[inline(always)]
    pub(crate) fn any_by(
        &self,
        objects: &Objects,
        ray: WorldRay<'_>,
        enters: impl Fn(u32) -> bool,
        hits: impl Fn(&ObjectView<'_>, &RayInInstance<'_>) -> bool,
    ) -> bool {
        self.enter_each(ray, |instance, placement| {
            if !enters(instance) {
                return Some(ray.ray.tmax);
            }
            let (object, of_instance) = self.enter(objects, (instance, placement), ray, ray.ray.tmax);
            (!hits(object, &of_instance)).then_some(ray.ray.tmax)
        })
    }

    /// Like [`Self::enumerate_placed`], but without a test of the box where only one instance is
    /// visible.
    #[inline(always)]
    fn enter_each(&self, ray: WorldRay<'_>, mut visit: impl FnMut(u32, &Placement) -> Option<f32>) -> bool {
        match self.only_visible() {
            // False for NaN, too.
            Some(instance) => {
                ray.ray.tmin <= ray.ray.tmax && visit(instance, self.placement(instance)).is_none()
            }
            None => self.enumerate_placed(ray.ray, || ray.rounded_line(), visit),
        }
    }

    /// The object of an instance, and a ray in it that ends at `tmax`.
    #[inline(always)]
    fn enter<'a>(
        &'a self,
        objects: &'a Objects,
        (instance, placement): (u32, &Placement),
        ray: WorldRay<'a>,
        tmax: f32,
    ) -> (&'a ObjectView<'a>, RayInInstance<'a>) {
        let object = placement.object();
        self.mark_traced(object);
        (objects.view(object), RayInInstance::new(self, objects, (instance, placement), ray, tmax))
    }
}
