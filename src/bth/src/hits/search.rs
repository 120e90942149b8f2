//! The search for the hits of a ray: all triangles that the f32 tests do not exclude are decided
//! exactly, tested against what the ray is allowed to hit, and passed to a collector.

use super::accept::Accept;
use super::collect::{Collector, FoundHit};
use super::conditions::Conditions;
use crate::bvh::candidate::intersect;
use crate::bvh::enumerate::enumerate;
use crate::enumerate::{EnteredInstance, enumerate_instances};
use crate::intersect::exact::{Intersection, precise, reported};
use crate::intersect::exact_ray::{ExactRay, LineSource};
use crate::intersect::line::{RATIO_ERROR, widened};
use crate::masks::Masks;
use crate::query::{Receiver, TriangleRef, in_range, may_be_in_range};
use crate::scene::Scene;
use crate::starts::world_ray::WorldRay;

/// Passes to a collector the hits of a ray that are accepted and that it wants.
pub(super) fn search(
    scene: &Scene,
    world_ray: WorldRay<'_>,
    accept: &Accept<'_>,
    collector: &mut dyn Collector,
) {
    let (masks, ray) = (scene.masks(), world_ray.ray);
    // Not `f32::min`, which would replace a `tmax` of NaN by a number.
    let tmax = |limit: f32| if limit < ray.tmax { limit } else { ray.tmax };
    enumerate_instances(scene, (ray, &|| world_ray.rounded_line()), &mut |entered| {
        if accept.mask & scene.mask_of(entered.instance) != 0
            && search_instance(&entered, (world_ray, tmax(collector.limit())), (accept, masks), collector)
        {
            return None;
        }
        Some(tmax(collector.limit()))
    });
}

/// Passes the hits in an instance up to `tmax`. Returns true if the collector's result is complete.
fn search_instance(
    entered: &EnteredInstance<'_>,
    (world_ray, tmax): (WorldRay<'_>, f32),
    (accept, masks): (&Accept<'_>, &Masks),
    collector: &mut dyn Collector,
) -> bool {
    let of_instance = entered.ray(world_ray, tmax);
    let exact = of_instance.exact();
    let conditions = Conditions {
        ray: world_ray.ray,
        instance: entered.instance,
        object: entered.object,
        groups: masks.groups(entered.object_index),
        accept,
    };
    let mut hits = InstanceHits {
        conditions,
        exact,
        t_scale: of_instance.t_scale(),
        collector,
        limit: widened(exact.ray.tmax.into()),
    };
    enumerate(entered.object, exact, &mut hits)
}

/// The state of a search in an instance.
struct InstanceHits<'a> {
    conditions: Conditions<'a>,
    /// The ray in the space of the object.
    exact: ExactRay<'a>,
    /// Factor from t in object space to t in world space.
    t_scale: f32,
    collector: &'a mut dyn Collector,
    /// Upper bound of the exact t, in the space of the object, of hits that can change the result.
    limit: f64,
}

impl InstanceHits<'_> {
    /// t in world space as it is reported; `None` if it lies out of the ray's range.
    fn reported_t(&self, t: f64) -> Option<f32> {
        let (ray, t_scale) = (self.exact.ray, self.t_scale);
        if !in_range(t as f32, ray.tmin, ray.tmax) {
            return None;
        }
        let t = reported(t);
        if t_scale == 1.0 {
            return Some(t);
        }
        let t = t * t_scale;
        in_range(t, self.conditions.ray.tmin, self.conditions.ray.tmax).then_some(t)
    }

    /// Returns true if t is in the range of a ray in f64; always true for others.
    fn is_in_wide_range(&self, found: &Intersection, corners: impl FnOnce() -> [[f64; 3]; 3]) -> bool {
        let LineSource::World(lines, ray) = self.exact.line else { return true };
        let Some([tmin, tmax]) = lines.range(ray) else { return true };
        let off = 4.0 * RATIO_ERROR * found.t.abs();
        if found.t - tmin > off && tmax - found.t > off {
            return true;
        }
        let exact = lines.exact(ray).intersection(corners());
        exact.is_some_and(|exact| tmin <= exact.t && exact.t <= tmax)
    }

    /// t in world space of a ray in f64, within 2^-40; 0 for others.
    fn wide_t(&self, found: &Intersection, corners: impl FnOnce() -> [[f64; 3]; 3]) -> f64 {
        let LineSource::World(lines, ray) = self.exact.line else { return 0.0 };
        if lines.range(ray).is_none() {
            return 0.0;
        }
        let corners = corners();
        let precise = precise(&lines.line(ray), corners).or_else(|| lines.exact(ray).intersection(corners));
        precise.map_or(found.t, |precise| precise.t) * f64::from(self.t_scale) + 0.0
    }

    /// Updates the limit after the collector has taken a hit.
    fn shrink(&mut self) {
        let (t, t_scale) = (self.collector.limit(), self.t_scale);
        if t < f32::INFINITY {
            // The product of t in the object and the factor may have been rounded where it is
            // denormal.
            let t = if t_scale == 1.0 { f64::from(t) } else { f64::from(t.next_up()) / f64::from(t_scale) };
            self.limit = widened(t).min(self.limit);
        }
    }
}

impl Receiver for InstanceHits<'_> {
    fn receive(&mut self, triangle: TriangleRef<'_>, corners: [[f32; 3]; 3]) -> bool {
        let (ExactRay { ray, .. }, object) = (self.exact, self.conditions.object);
        let may_matter = |t| may_be_in_range(t, ray.tmin, self.limit);
        let found = intersect(object, self.exact, (triangle, corners), may_matter);
        let Some(intersection) = found else { return false };
        let Some(t) = self.reported_t(intersection.t) else { return false };
        let exact_corners = || object.exact_corners(|| triangle.read(), corners);
        // A hit beyond the limit is excluded before the id is read, which is often a cache miss.
        if !self.is_in_wide_range(&intersection, exact_corners) || t > self.collector.limit() {
            return false;
        }
        let Some(hit) = self.conditions.hit(triangle, &intersection, t) else { return false };
        let wide_t = self.wide_t(&intersection, exact_corners);
        let found = FoundHit { hit, t: intersection.t, wide_t };
        if !self.collector.wants(&found) || !self.conditions.pass_filter(&found.hit) {
            return false;
        }
        let complete = self.collector.take(found);
        self.shrink();
        complete
    }

    fn limit(&self) -> f64 {
        self.limit
    }
}
