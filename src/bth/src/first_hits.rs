//! Queries for the nearest hit of rays in world space, and for any hit.

use crate::object;
use crate::query::Steps;
use crate::rays::{Hit, Ray};
use crate::scene::Scene;
use crate::start_queries::TraceRay;
use crate::starts::world_ray::WorldRay;

impl Scene {
    /// Nearest hit of a ray in world space: a [`Ray`], or a [`StartRay`](crate::rays::StartRay).
    pub fn nearest<R: TraceRay>(&self, ray: &R) -> Option<Hit> {
        let mut hit = Hit::MISS;
        ray.store_nearest(self, &mut hit);
        hit.is_hit().then_some(hit)
    }

    /// Whether a ray in world space hits anything: a [`Ray`], or a [`StartRay`](crate::rays::StartRay).
    pub fn any<R: TraceRay>(&self, ray: &R) -> bool {
        ray.any(self)
    }

    /// As [`Self::nearest`], with statistics of the traversal. A miss is [`Hit::MISS`].
    pub fn nearest_counted<R: TraceRay>(&self, ray: &R) -> (Hit, Steps) {
        let Some(placed) = ray.placed(self) else { return (Hit::MISS, Steps::default()) };
        let (mut hit, steps) = self.nearest_of_all_counted(placed.world_ray());
        if self.has_opacity() {
            // The steps of the search behind holes are not counted.
            self.go_on(placed.world_ray(), &mut hit);
        }
        (hit, steps)
    }

    /// As [`Self::nearest_counted`], as if every triangle were opaque.
    fn nearest_of_all_counted(&self, world_ray: WorldRay<'_>) -> (Hit, Steps) {
        if let Some((object, instance)) = self.sole() {
            return world_ray.in_object(
                instance,
                world_ray.ray,
                |start| object::nearest_counted(object, start, instance),
                |ray| object::nearest_counted(object, ray, instance),
            );
        }
        if let Some(world) = self.world() {
            return world.nearest_counted(self.objects(), world_ray);
        }
        let (mut best, mut steps, mut ray) = (Hit::MISS, Steps::default(), *world_ray.ray);
        for instance in 0..self.object_count() {
            let object = self.view(instance);
            let (hit, object_steps) = world_ray.in_object(
                instance,
                &ray,
                |start| object::nearest_counted(object, start, instance),
                |ray| object::nearest_counted(object, ray, instance),
            );
            steps += object_steps;
            if hit.t < best.t {
                (best, ray.tmax) = (hit, hit.t);
            }
        }
        (best, steps)
    }

    /// Stores the nearest hit of a ray, or [`Hit::MISS`].
    ///
    /// Inlined up to the kernel, which is not: every crate that traces single rays would hold kernels of its own. For a single ray in a
    /// model every instruction on the way there counts.
    #[inline(always)]
    pub(crate) fn nearest_of_ray(&self, ray: &Ray, hit: &mut Hit) {
        match self.sole_opaque() {
            Some(object) => object::store_nearest(object, ray, 0, hit),
            None => self.nearest_of_ray_elsewhere(ray, hit),
        }
    }

    /// As [`Self::nearest_of_ray`], in any scene.
    #[inline(never)]
    fn nearest_of_ray_elsewhere(&self, ray: &Ray, hit: &mut Hit) {
        if !self.has_opacity() {
            if let Some((object, instance)) = self.sole() {
                return object::store_nearest(object, ray, instance, hit);
            }
            if let Some(world) = self.world() {
                return world.store_nearest_of_ray(self.objects(), WorldRay::plain(ray), hit);
            }
        }
        self.nearest_hits_of(std::slice::from_ref(ray), std::slice::from_mut(hit));
    }

    /// Whether a ray hits anything.
    #[inline(always)]
    pub(crate) fn any_of_ray(&self, ray: &Ray) -> bool {
        match self.sole_opaque() {
            Some(object) => object::any(object, ray),
            None => self.any_of_ray_elsewhere(ray),
        }
    }

    /// As [`Self::any_of_ray`], in any scene.
    #[inline(never)]
    fn any_of_ray_elsewhere(&self, ray: &Ray) -> bool {
        if !self.has_opacity() {
            if let Some((object, _)) = self.sole() {
                return object::any(object, ray);
            }
            if let Some(world) = self.world() {
                return world.any_of_ray(self.objects(), WorldRay::plain(ray));
            }
        }
        let mut found = [false];
        self.any_hits_of(std::slice::from_ref(ray), &mut found);
        found[0]
    }

    /// Stores the nearest hit of each ray, or [`Hit::MISS`]. `hits` is as long as `rays`.
    #[inline(never)]
    pub(crate) fn nearest_hits_of(&self, rays: &[Ray], hits: &mut [Hit]) {
        if self.has_opacity() {
            return self.nearest_not_transparent(rays, hits);
        }
        self.nearest_of_all(rays, hits);
    }

    /// As [`Self::nearest_hits_of`], as if every triangle were opaque.
    pub(crate) fn nearest_of_all(&self, rays: &[Ray], hits: &mut [Hit]) {
        object::fill_misses(hits);
        if let Some((object, instance)) = self.sole() {
            if rays.len() < object::MIN_BATCH {
                for (ray, hit) in rays.iter().zip(hits) {
                    *hit = object::nearest(object, ray, instance);
                }
                return;
            }
            return object::with_scratch(|scratch| {
                object::nearest_batch(object, rays, instance, scratch, hits);
            });
        }
        if let Some(world) = self.world() {
            if !world.go_one_by_one(rays) {
                return world.nearest(self.objects(), rays, &[], hits);
            }
            for (ray, hit) in rays.iter().zip(hits) {
                world.store_nearest_of_ray(self.objects(), WorldRay::plain(ray), hit);
            }
            return;
        }
        for instance in 0..self.object_count() {
            let object = self.view(instance);
            for (ray, best) in rays.iter().zip(hits.iter_mut()) {
                // Not `f32::min`, which would replace a `tmax` of NaN by a number.
                let tmax = if best.t < ray.tmax { best.t } else { ray.tmax };
                let ray = Ray { tmax, ..*ray };
                let hit = object::nearest(object, &ray, instance);
                if hit.t < best.t {
                    *best = hit;
                }
            }
        }
    }

    /// Stores for each ray whether it hits anything. `found` is as long as `rays`.
    #[inline(never)]
    pub(crate) fn any_hits_of(&self, rays: &[Ray], found: &mut [bool]) {
        if self.has_opacity() {
            return self.any_not_transparent(rays, found);
        }
        self.any_of_all(rays, found);
    }

    /// As [`Self::any_hits_of`], as if every triangle were opaque.
    pub(crate) fn any_of_all(&self, rays: &[Ray], found: &mut [bool]) {
        found.fill(false);
        if let Some((object, instance)) = self.sole() {
            if rays.len() < object::MIN_BATCH {
                for (ray, found) in rays.iter().zip(found) {
                    *found = object::any(object, ray);
                }
                return;
            }
            return object::with_scratch(|scratch| {
                object::any_batch(object, rays, instance, scratch, found);
            });
        }
        if let Some(world) = self.world() {
            if !world.go_one_by_one(rays) {
                return world.any(self.objects(), rays, &[], found);
            }
            for (ray, found) in rays.iter().zip(found) {
                *found = world.any_of_ray(self.objects(), WorldRay::plain(ray));
            }
            return;
        }
        for instance in 0..self.object_count() {
            let object = self.view(instance);
            for (ray, found) in rays.iter().zip(found.iter_mut()) {
                *found = *found || object::any(object, ray);
            }
        }
    }
}
