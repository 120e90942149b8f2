//! Results of searches: for one ray, and for each of many.

use super::accept::Accept;
use super::collect::{AnyFound, FirstHit, FirstHits, FoundHit, HitCount};
use super::conditions::{AcceptedHit, Conditions};
use super::search::search;
use crate::instances::World;
use crate::intersect::exact_ray::{ExactRay, LineSource};
use crate::object;
use crate::rays::{Hit, Ray};
use crate::scene::Scene;
use crate::shortcuts::has_special_leaves;
use crate::starts::world_ray::WorldRay;
use crate::trace_ray::TraceRay;
use bth_format::object::ObjectView;
use std::collections::BinaryHeap;

/// The nearest accepted hit.
pub(crate) fn nearest(scene: &Scene, ray: WorldRay<'_>, accept: &Accept<'_>) -> Option<Hit> {
    if let Some(hit) = in_sole_object::<false>(scene, ray, accept) {
        return hit.is_hit().then_some(hit);
    }
    if let Some(hit) = nearest_in_instances(scene, ray, accept) {
        return hit.is_hit().then_some(hit);
    }
    let mut first = FirstHit::default();
    search(scene, ray, accept, &mut first);
    first.0.map(|found| found.hit)
}

/// Returns true if there is an accepted hit.
pub(crate) fn any(scene: &Scene, ray: WorldRay<'_>, accept: &Accept<'_>) -> bool {
    if let Some(hit) = in_sole_object::<true>(scene, ray, accept) {
        return hit.is_hit();
    }
    if let Some(found) = any_in_instances(scene, ray, accept) {
        return found;
    }
    let mut any = AnyFound::default();
    search(scene, ray, accept, &mut any);
    any.0
}

/// The nearest accepted hit, or any, if the scene is one object in world space: by the kernel of
/// single rays. `None` if it is not, if the ray is in f64, or if the object has tetrahedra.
fn in_sole_object<const IS_ANY: bool>(scene: &Scene, ray: WorldRay<'_>, accept: &Accept<'_>) -> Option<Hit> {
    let (object, instance) = scene.sole_in_f32()?;
    if ray.wide.is_some() || has_special_leaves(object) {
        return None;
    }
    let exact = match ray.start {
        None => ExactRay::plain(ray.ray),
        Some(_) => ExactRay::new(ray.ray, LineSource::Start(ray.start_in(instance)?)),
    };
    let masks = scene.masks();
    if accept.mask & masks.of_instance(instance) == 0 {
        return Some(Hit::MISS);
    }
    let groups = masks.groups(scene.object_of(instance));
    let conditions = Conditions { ray: ray.ray, instance, object, groups, accept };
    let goal = AcceptedHit::<IS_ANY> { conditions: &conditions, so_far: &Hit::MISS, t_scale: 1.0 };
    Some(object::accepted(object, &exact, goal, instance))
}

/// The world of a scene, if the kernel of single rays tests conditions in all instances: no object
/// has tetrahedra or positions in f64, and neither has the ray.
fn world_of_kernel<'a>(scene: &'a Scene, ray: &WorldRay<'_>) -> Option<&'a World> {
    scene.world().filter(|_| ray.wide.is_none() && scene.tests_conditions_in_kernel())
}

/// The conditions of a ray in an instance.
fn conditions<'a>(
    scene: &'a Scene,
    ray: &'a Ray,
    (instance, object): (u32, &'a ObjectView<'a>),
    accept: &'a Accept<'a>,
) -> Conditions<'a> {
    let masks = scene.masks();
    // Finding the object of an instance takes longer than some instances.
    let groups = if masks.has_groups() { masks.groups(scene.object_of(instance)) } else { None };
    Conditions { ray, instance, object, groups, accept }
}

/// The nearest accepted hit in instances, or [`Hit::MISS`]; `None` if the kernel cannot find it.
fn nearest_in_instances(scene: &Scene, ray: WorldRay<'_>, accept: &Accept<'_>) -> Option<Hit> {
    let (world, mut best) = (world_of_kernel(scene, &ray)?, Hit::MISS);
    let enters = |instance| accept.mask & scene.mask_of(instance) != 0;
    world.nearest_by(scene.objects(), ray, &mut best, enters, |object, placed, so_far, hit| {
        let instance = placed.instance;
        let conditions = conditions(scene, ray.ray, (instance, object), accept);
        let t_scale = placed.of_object.t_scale;
        let goal = AcceptedHit::<false> { conditions: &conditions, so_far, t_scale };
        *hit = object::accepted(object, placed, goal, instance);
    });
    Some(best)
}

/// Returns true if there is an accepted hit in an instance; `None` if the kernel cannot find it.
fn any_in_instances(scene: &Scene, ray: WorldRay<'_>, accept: &Accept<'_>) -> Option<bool> {
    let world = world_of_kernel(scene, &ray)?;
    let enters = |instance| accept.mask & scene.mask_of(instance) != 0;
    Some(world.any_by(scene.objects(), ray, enters, |object, placed| {
        let instance = placed.instance;
        let conditions = conditions(scene, ray.ray, (instance, object), accept);
        let t_scale = placed.of_object.t_scale;
        let goal = AcceptedHit::<true> { conditions: &conditions, so_far: &Hit::MISS, t_scale };
        object::accepted(object, placed, goal, instance).is_hit()
    }))
}

/// The number of accepted hits.
pub(super) fn count(scene: &Scene, ray: &impl TraceRay, accept: &Accept<'_>) -> usize {
    let mut count = HitCount::default();
    ray.in_world(scene, |ray| search(scene, ray, accept, &mut count));
    count.0
}

/// Appends all accepted hits of a ray to `hits`, in order. `found` is scratch memory.
pub(super) fn append_all(
    scene: &Scene,
    ray: &impl TraceRay,
    accept: &Accept<'_>,
    found: &mut Vec<FoundHit>,
    hits: &mut Vec<Hit>,
) {
    found.clear();
    ray.in_world(scene, |ray| search(scene, ray, accept, found));
    // The heap of `append_nearest` sorts these few hits, too, which saves the code of another sort.
    *found = BinaryHeap::from(std::mem::take(found)).into_sorted_vec();
    hits.extend(found.iter().map(|found| found.hit));
}

/// Appends the `k` nearest accepted hits of a ray to `hits`, in order.
pub(super) fn append_nearest(
    scene: &Scene,
    ray: &impl TraceRay,
    k: usize,
    accept: &Accept<'_>,
    hits: &mut Vec<Hit>,
) {
    if k > 0 {
        let mut first = FirstHits { count: k, hits: BinaryHeap::new() };
        ray.in_world(scene, |ray| search(scene, ray, accept, &mut first));
        hits.extend(first.hits.into_sorted_vec().iter().map(|found| found.hit));
    }
}

/// Stores the result of a query for each ray.
pub(super) fn store_each<R, T>(rays: &[R], results: &mut [T], query: impl Fn(&R) -> T) {
    assert_eq!(rays.len(), results.len(), "as many results as rays");
    for (ray, result) in rays.iter().zip(results) {
        *result = query(ray);
    }
}

/// Replaces `hits` by those that a query appends for each ray, and `offsets` by their first indices
/// and the number of all.
pub(super) fn append_each<R>(
    rays: &[R],
    offsets: &mut Vec<usize>,
    hits: &mut Vec<Hit>,
    mut query: impl FnMut(&R, &mut Vec<Hit>),
) {
    hits.clear();
    offsets.clear();
    offsets.reserve(rays.len() + 1);
    offsets.push(0);
    for ray in rays {
        query(ray, hits);
        offsets.push(hits.len());
    }
}
