//! What a batch of rays through the instances of a scene asks for.

use super::enter_object::ObjectRays;
use super::lines::{VisitLines, visit_ray};
use super::scene_batch::{BatchProgress, ObjectVisits, SceneBatch};
use crate::intersect::exact_ray::Lines;
use crate::object::{self, Scratch};
use crate::query::sink::{Answers, Better, SceneRays, Sink};
use crate::rays::Hit;
use bth_format::object::ObjectView;

/// A query over the rays of a batch. The kernels are compiled once for all.
pub(super) trait SceneQuery {
    /// The answers so far.
    fn progress(&self) -> BatchProgress<'_>;
    /// Traces a ray of the batch through all instances at once.
    fn trace_alone(&mut self, batch: &SceneBatch<'_>, ray: usize);
    /// Traces visits one by one.
    fn trace_one_by_one(&mut self, of_object: ObjectVisits<'_>);
    /// Traces visits together, given their rays in the space of the object.
    fn trace_placed(&mut self, of_object: ObjectVisits<'_>, object_rays: &ObjectRays);
    /// Traces visits, given memory for their rays in the space of the object.
    fn trace(&mut self, of_object: ObjectVisits<'_>, object_rays: &mut ObjectRays) {
        if of_object.visits.len() < object::MIN_BATCH {
            return self.trace_one_by_one(of_object);
        }
        object_rays.fill(&of_object, self.progress());
        self.trace_placed(of_object, object_rays);
    }
}

/// Traces visits of one object, given with their rays in its space, and merges the answers into the
/// answers of the scene's rays.
fn trace_visits(
    ObjectVisits { batch, object, visits }: ObjectVisits<'_>,
    object_rays: &ObjectRays,
    scratch: &mut Scratch,
    answers: Answers<'_>,
) {
    let better = |ray: usize, best: &Hit, hit: &Hit, t_scale: f32| batch.better(ray, best, hit, t_scale);
    let better_wide: Option<&Better<'_>> = if batch.wide.is_empty() { None } else { Some(&better) };
    let scene = SceneRays { rays: batch.rays, better_wide, visits, t_scale: &object_rays.t_scale };
    let sink = Sink::of_scene(object.triangle_ids, answers, scene);
    let lines = VisitLines { batch, visits, t_scale: &object_rays.t_scale };
    let mut sink = sink.with_lines(Lines::World(&lines, 0));
    let object = ObjectView { bounds: object_rays.bounds, ..*object };
    object::trace_batch(&object, &object_rays.rays, None, scratch, &mut sink);
}

/// The query for the nearest hits.
pub(super) struct SceneNearest<'a> {
    pub(super) hits: &'a mut [Hit],
    pub(super) scratch: &'a mut Scratch,
    /// True if the rays are in f64.
    pub(super) is_wide: bool,
}

impl SceneQuery for SceneNearest<'_> {
    fn progress(&self) -> BatchProgress<'_> {
        match self.is_wide {
            true => BatchProgress::NearestWide(self.hits),
            false => BatchProgress::Nearest(self.hits),
        }
    }
    fn trace_alone(&mut self, batch: &SceneBatch<'_>, ray: usize) {
        batch.world.store_nearest_of_ray(batch.objects, batch.world_ray(ray), &mut self.hits[ray]);
    }
    fn trace_one_by_one(&mut self, ObjectVisits { batch, object, visits }: ObjectVisits<'_>) {
        for &visit in visits {
            let i = visit.ray as usize;
            let ray = visit_ray(batch, visit, batch.rays[i].tmax.min(self.progress().tmax(i)));
            let hit = object::nearest(object, &ray, visit.instance);
            let t_scale = ray.of_object.t_scale;
            self.hits[i] = batch.better(i, &self.hits[i], &hit, t_scale).unwrap_or(self.hits[i]);
        }
    }
    fn trace_placed(&mut self, of_object: ObjectVisits<'_>, object_rays: &ObjectRays) {
        trace_visits(of_object, object_rays, self.scratch, Answers::Nearest(self.hits));
    }
}

/// The query whether anything is hit.
pub(super) struct SceneAny<'a> {
    pub(super) found: &'a mut [bool],
    pub(super) scratch: &'a mut Scratch,
}

impl SceneQuery for SceneAny<'_> {
    fn progress(&self) -> BatchProgress<'_> {
        BatchProgress::Any(self.found)
    }
    fn trace_alone(&mut self, batch: &SceneBatch<'_>, ray: usize) {
        self.found[ray] = batch.world.any_of_ray(batch.objects, batch.world_ray(ray));
    }
    fn trace_one_by_one(&mut self, ObjectVisits { batch, object, visits }: ObjectVisits<'_>) {
        for &visit in visits {
            let i = visit.ray as usize;
            self.found[i] |= object::any(object, &visit_ray(batch, visit, batch.rays[i].tmax));
        }
    }
    fn trace_placed(&mut self, of_object: ObjectVisits<'_>, object_rays: &ObjectRays) {
        trace_visits(of_object, object_rays, self.scratch, Answers::Any(self.found));
    }
}
