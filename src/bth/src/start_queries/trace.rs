//! The nearest hit of rays that start on surfaces, and any hit.

use crate::object;
use crate::rays::{Hit, Ray, StartRay};
use crate::scene::Scene;
use crate::simd::Isa;
use crate::starts::prepare::ENDED;
use crate::starts::world_ray::{InstanceStart, PlacedRay, WorldRay};
use bth_format::object::ObjectView;
use std::cell::Cell;

thread_local! {
    /// The rays of a batch in world space. A thread keeps their memory from one batch to the next.
    static PLACED: Cell<(Vec<Ray>, Vec<InstanceStart>)> = const { Cell::new((Vec::new(), Vec::new())) };
}

impl Scene {
    /// Stores the nearest hit of a ray, or [`Hit::MISS`].
    #[inline(always)]
    pub(crate) fn nearest_of_start(&self, ray: &StartRay, hit: &mut Hit) {
        match self.sole_opaque() {
            Some(object) => nearest_in(object, 0, ray, hit),
            None => self.nearest_of_start_elsewhere(ray, hit),
        }
    }

    /// As [`Self::nearest_of_start`], in any scene.
    #[inline(never)]
    fn nearest_of_start_elsewhere(&self, ray: &StartRay, hit: &mut Hit) {
        if !self.has_opacity()
            && let Some((object, instance)) = self.sole()
        {
            return nearest_in(object, instance, ray, hit);
        }
        *hit = Hit::MISS;
        let Some(placed) = self.place(ray) else { return };
        let world_ray = placed.world_ray();
        match self.world() {
            Some(world) => world.store_nearest_of_ray(self.objects(), world_ray, hit),
            None => self.nearest_of_objects(world_ray, hit),
        }
        if self.has_opacity() {
            self.go_on(world_ray, hit);
        }
    }

    /// Stores the nearest hit of a ray in all objects of a file without scene sections, each in world space.
    fn nearest_of_objects(&self, world_ray: WorldRay<'_>, best: &mut Hit) {
        for instance in 0..self.object_count() {
            let tmax = if best.t < world_ray.ray.tmax { best.t } else { world_ray.ray.tmax };
            let ray = Ray { tmax, ..*world_ray.ray };
            let object = self.view(instance);
            let hit = world_ray.in_object(
                instance,
                &ray,
                |start| object::nearest(object, start, instance),
                |ray| object::nearest(object, ray, instance),
            );
            if hit.t < best.t {
                *best = hit;
            }
        }
    }

    /// Whether a ray hits anything.
    #[inline(always)]
    pub(crate) fn any_of_start(&self, ray: &StartRay) -> bool {
        match self.sole_opaque() {
            Some(object) => any_in(object, 0, ray),
            None => self.any_of_start_elsewhere(ray),
        }
    }

    /// As [`Self::any_of_start`], in any scene.
    #[inline(never)]
    fn any_of_start_elsewhere(&self, ray: &StartRay) -> bool {
        if !self.has_opacity()
            && let Some((object, instance)) = self.sole()
        {
            return any_in(object, instance, ray);
        }
        let Some(placed) = self.place(ray) else { return false };
        let world_ray = placed.world_ray();
        if self.has_opacity() {
            return self.hits_what_is_not_transparent(world_ray);
        }
        match self.world() {
            Some(world) => world.any_of_ray(self.objects(), world_ray),
            None => (0..self.object_count()).any(|instance| {
                let object = self.view(instance);
                world_ray.in_object(
                    instance,
                    world_ray.ray,
                    |start| object::any(object, start),
                    |ray| object::any(object, ray),
                )
            }),
        }
    }

    /// Stores the nearest hit of each ray, or [`Hit::MISS`]. `hits` is as long as `rays`.
    #[inline(never)]
    pub(crate) fn nearest_of_starts(&self, rays: &[StartRay], hits: &mut [Hit]) {
        if !self.goes_in_batches(rays) {
            return rays.iter().zip(hits).for_each(|(ray, hit)| self.nearest_of_start(ray, hit));
        }
        object::fill_misses(hits);
        if let Some((object, instance)) = self.sole() {
            object::with_scratch(|scratch| {
                object::starts::nearest_from_starts(object, rays, instance, scratch, hits);
            });
        } else if let Some(world) = self.world() {
            self.with_placed(rays, |rays, starts| world.nearest(self.objects(), rays, starts, hits));
        }
        if self.has_opacity() {
            for (ray, hit) in rays.iter().zip(hits) {
                if hit.is_hit()
                    && let Some(placed) = self.place(ray)
                {
                    self.go_on(placed.world_ray(), hit);
                }
            }
        }
    }

    /// Stores for each ray whether it hits anything. `found` is as long as `rays`.
    #[inline(never)]
    pub(crate) fn any_of_starts(&self, rays: &[StartRay], found: &mut [bool]) {
        if !self.goes_in_batches(rays) {
            return rays.iter().zip(found).for_each(|(ray, found)| *found = self.any_of_start(ray));
        }
        found.fill(false);
        if let Some((object, instance)) = self.sole() {
            object::with_scratch(|scratch| {
                object::starts::any_from_starts(object, rays, instance, scratch, found);
            });
        } else if let Some(world) = self.world() {
            self.with_placed(rays, |rays, starts| world.any(self.objects(), rays, starts, found));
        }
        if self.has_opacity() {
            for (ray, found) in rays.iter().zip(found) {
                *found = *found && self.any_of_start(ray);
            }
        }
    }

    /// Whether rays are traced together: not in scalar code, nor through several objects of a file without scene sections.
    fn goes_in_batches(&self, rays: &[StartRay]) -> bool {
        let has_vectors = Isa::chosen() != Isa::Scalar;
        has_vectors && rays.len() >= object::MIN_BATCH && (self.world().is_some() || self.object_count() == 1)
    }

    /// Calls `trace` with the rays of a batch in world space, and their starts.
    fn with_placed(&self, rays: &[StartRay], trace: impl FnOnce(&[Ray], &[InstanceStart])) {
        let (mut world_rays, mut starts) = PLACED.take();
        world_rays.clear();
        starts.clear();
        for ray in rays {
            let (ray, start) = match self.place(ray) {
                Some(PlacedRay { ray, start: Some(start) }) => (ray, start),
                _ => (ENDED, InstanceStart::none(ENDED.origin)),
            };
            world_rays.push(ray);
            starts.push(start);
        }
        trace(&world_rays, &starts);
        PLACED.set((world_rays, starts));
    }
}

/// Stores the nearest hit of a ray in an instance whose object's space is world space.
#[inline(always)]
fn nearest_in(object: &ObjectView<'_>, instance: u32, ray: &StartRay, hit: &mut Hit) {
    if ray.start.primitive.instance == instance {
        object::store_nearest(object, ray, instance, hit);
    } else {
        *hit = Hit::MISS;
    }
}

/// Whether a ray hits anything in an instance whose object's space is world space.
#[inline(always)]
fn any_in(object: &ObjectView<'_>, instance: u32, ray: &StartRay) -> bool {
    ray.start.primitive.instance == instance && object::any(object, ray)
}
