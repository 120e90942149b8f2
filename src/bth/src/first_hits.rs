//! Queries for the nearest hit of rays in world space, and for any hit.

use crate::SMALL;
use crate::object;
use crate::query::Steps;
use crate::rays::{Hit, PrimitiveRef, Ray};
use crate::scene::Scene;
use bth_format::layout::NONE;

impl Scene {
    /// Nearest hit of a ray in world space.
    pub fn nearest(&self, ray: &Ray) -> Option<Hit> {
        self.nearest_from(ray, PrimitiveRef::NONE)
    }

    /// As [`Self::nearest`], for a ray that starts on a triangle, or [`PrimitiveRef::NONE`]. The triangle is a hint where a
    /// traversal of tetrahedra may begin, and never changes the result.
    pub fn nearest_from(&self, ray: &Ray, triangle: PrimitiveRef) -> Option<Hit> {
        let mut hit = Hit::MISS;
        self.nearest_of_ray(ray, triangle, &mut hit);
        hit.is_hit().then_some(hit)
    }

    /// Whether a ray in world space hits anything.
    pub fn any(&self, ray: &Ray) -> bool {
        self.any_from(ray, PrimitiveRef::NONE)
    }

    /// As [`Self::any`], with a hint as for [`Self::nearest_from`].
    pub fn any_from(&self, ray: &Ray, triangle: PrimitiveRef) -> bool {
        self.any_of_ray(ray, triangle)
    }

    /// As [`Self::nearest_from`], with statistics of the traversal. A miss is [`Hit::MISS`].
    pub fn nearest_counted(&self, ray: &Ray, from: PrimitiveRef) -> (Hit, Steps) {
        let counted = self.nearest_of_all_counted(ray, from);
        if self.has_opacity() { self.counted_not_transparent(ray, counted) } else { counted }
    }

    /// As [`Self::nearest_counted`], as if every triangle were opaque.
    fn nearest_of_all_counted(&self, ray: &Ray, from: PrimitiveRef) -> (Hit, Steps) {
        if let Some((object, instance)) = self.sole() {
            return object::nearest_counted(object, ray, hint(from, instance), instance);
        }
        if let Some(world) = self.world() {
            return world.nearest_counted(self.objects(), ray, from);
        }
        let (mut best, mut steps, mut ray) = (Hit::MISS, Steps::default(), *ray);
        for instance in 0..self.object_count() {
            let (hit, object_steps) =
                object::nearest_counted(self.view(instance), &ray, hint(from, instance), instance);
            steps += object_steps;
            if hit.t < best.t {
                (best, ray.tmax) = (hit, hit.t);
            }
        }
        (best, steps)
    }

    /// Stores the nearest hit of a ray, or [`Hit::MISS`]. `from` is the triangle on which it starts, or [`PrimitiveRef::NONE`].
    ///
    /// Inlined up to the kernel, which is not: every crate that traces single rays would hold kernels of its own. For a single ray in a
    /// model every instruction on the way there counts.
    #[inline(always)]
    pub(crate) fn nearest_of_ray(&self, ray: &Ray, from: PrimitiveRef, hit: &mut Hit) {
        match self.sole_opaque() {
            Some(object) => object::store_nearest(object, ray, hint(from, 0), 0, hit),
            None => self.nearest_of_ray_elsewhere(ray, from, hit),
        }
    }

    /// As [`Self::nearest_of_ray`], in any scene.
    #[inline(never)]
    fn nearest_of_ray_elsewhere(&self, ray: &Ray, from: PrimitiveRef, hit: &mut Hit) {
        if !self.has_opacity() {
            if let Some((object, instance)) = self.sole() {
                return object::store_nearest(object, ray, hint(from, instance), instance, hit);
            }
            if let Some(world) = self.world() {
                return world.store_nearest_of_ray(self.objects(), ray, from, hit);
            }
        }
        self.nearest_hits_of(std::slice::from_ref(ray), Some(&[from]), std::slice::from_mut(hit));
    }

    /// Whether a ray hits anything; `from` as for [`Self::nearest_of_ray`].
    #[inline(always)]
    pub(crate) fn any_of_ray(&self, ray: &Ray, from: PrimitiveRef) -> bool {
        match self.sole_opaque() {
            Some(object) => object::any(object, ray, hint(from, 0)),
            None => self.any_of_ray_elsewhere(ray, from),
        }
    }

    /// As [`Self::any_of_ray`], in any scene.
    #[inline(never)]
    fn any_of_ray_elsewhere(&self, ray: &Ray, from: PrimitiveRef) -> bool {
        if !self.has_opacity() {
            if let Some((object, instance)) = self.sole() {
                return object::any(object, ray, hint(from, instance));
            }
            if let Some(world) = self.world() {
                return world.any_of_ray(self.objects(), ray, from);
            }
        }
        let mut found = [false];
        self.any_hits_of(std::slice::from_ref(ray), Some(&[from]), &mut found);
        found[0]
    }

    /// Stores the nearest hit of each ray, or [`Hit::MISS`]. `hits`, and `from` if it is given, are as long as `rays`.
    #[inline(never)]
    pub(crate) fn nearest_hits_of(&self, rays: &[Ray], from: Option<&[PrimitiveRef]>, hits: &mut [Hit]) {
        if self.has_opacity() {
            return self.nearest_not_transparent(rays, from, hits);
        }
        self.nearest_of_all(rays, from, hits);
    }

    /// As [`Self::nearest_hits_of`], as if every triangle were opaque.
    pub(crate) fn nearest_of_all(&self, rays: &[Ray], from: Option<&[PrimitiveRef]>, hits: &mut [Hit]) {
        object::fill_misses(hits);
        if let Some((object, instance)) = self.sole() {
            if rays.len() < object::MIN_BATCH {
                for (i, (ray, hit)) in rays.iter().zip(hits).enumerate() {
                    *hit = object::nearest(object, ray, hint(start_primitive(from, i), instance), instance);
                }
                return;
            }
            return object::with_scratch(|scratch| {
                object::nearest_batch(object, rays, from, instance, scratch, hits);
            });
        }
        if let Some(world) = self.world() {
            if !world.go_one_by_one(rays) {
                return world.nearest(self.objects(), rays, from, hits);
            }
            for (i, (ray, hit)) in rays.iter().zip(hits).enumerate() {
                world.store_nearest_of_ray(self.objects(), ray, start_primitive(from, i), hit);
            }
            return;
        }
        for instance in 0..self.object_count() {
            let object = self.view(instance);
            for (i, (ray, best)) in rays.iter().zip(hits.iter_mut()).enumerate() {
                // Not `f32::min`, which would replace a `tmax` of NaN by a number.
                let tmax = if best.t < ray.tmax { best.t } else { ray.tmax };
                let ray = Ray { tmax, ..*ray };
                let hit = object::nearest(object, &ray, hint(start_primitive(from, i), instance), instance);
                if hit.t < best.t {
                    *best = hit;
                }
            }
        }
    }

    /// Stores for each ray whether it hits anything. `found`, and `from` if it is given, are as long as `rays`.
    #[inline(never)]
    pub(crate) fn any_hits_of(&self, rays: &[Ray], from: Option<&[PrimitiveRef]>, found: &mut [bool]) {
        if self.has_opacity() {
            return self.any_not_transparent(rays, from, found);
        }
        self.any_of_all(rays, from, found);
    }

    /// As [`Self::any_hits_of`], as if every triangle were opaque.
    pub(crate) fn any_of_all(&self, rays: &[Ray], from: Option<&[PrimitiveRef]>, found: &mut [bool]) {
        found.fill(false);
        if let Some((object, instance)) = self.sole() {
            if rays.len() < object::MIN_BATCH {
                for (i, (ray, found)) in rays.iter().zip(found).enumerate() {
                    *found = object::any(object, ray, hint(start_primitive(from, i), instance));
                }
                return;
            }
            return object::with_scratch(|scratch| {
                object::any_batch(object, rays, from, instance, scratch, found);
            });
        }
        if let Some(world) = self.world() {
            if !world.go_one_by_one(rays) {
                return world.any(self.objects(), rays, from, found);
            }
            for (i, (ray, found)) in rays.iter().zip(found).enumerate() {
                *found = world.any_of_ray(self.objects(), ray, start_primitive(from, i));
            }
            return;
        }
        for instance in 0..self.object_count() {
            let object = self.view(instance);
            for (i, (ray, found)) in rays.iter().zip(found.iter_mut()).enumerate() {
                *found = *found || object::any(object, ray, hint(start_primitive(from, i), instance));
            }
        }
    }
}

/// The triangle on which a ray of a batch starts, or [`PrimitiveRef::NONE`].
fn start_primitive(from: Option<&[PrimitiveRef]>, ray: usize) -> PrimitiveRef {
    from.map_or(PrimitiveRef::NONE, |f| f[ray])
}

/// The triangle of an instance's object on which a ray starts, or `NONE`.
fn hint(from: PrimitiveRef, instance: u32) -> u32 {
    if SMALL { NONE } else { from.triangle_of(instance) }
}
