//! What a batch of rays through the instances of a scene asks for, and its answers so far.

use super::World;
use super::enter_object::ObjectRays;
use crate::intersect::start_point::Starts;
use crate::nodes::affine::ObjectRay;
use crate::object::{self, Scratch};
use crate::objects::Objects;
use crate::query::better;
use crate::query::sink::{Answers, SceneRays, Sink, Visit};
use crate::rays::{Hit, Ray, StartRay};
use crate::starts::world_ray::{InstanceStart, WorldRay};
use bth_format::object::ObjectView;

/// A batch of rays in world space, and the scene that they go through.
pub(super) struct SceneBatch<'a> {
    pub(super) world: &'a World,
    pub(super) objects: &'a Objects,
    pub(super) rays: &'a [Ray],
    /// For each ray its start, if rays start on triangles; else empty.
    pub(super) starts: &'a [InstanceStart],
}

impl<'a> SceneBatch<'a> {
    /// A ray of the batch.
    fn world_ray(&self, index: usize) -> WorldRay<'a> {
        WorldRay { ray: &self.rays[index], start: self.starts.get(index) }
    }

    /// The ray of a visit in the space of the object, ended at `tmax`.
    pub(super) fn object_ray(&self, visit: Visit, tmax: f32) -> ObjectRay {
        let ray = Ray { tmax, ..self.rays[visit.ray as usize] };
        self.world
            .placement(visit.instance)
            .inverse
            .ray_from(&ray, self.start(visit).map(|start| &start.point))
    }

    /// As [`WorldRay::in_object`], for the ray of a visit.
    pub(super) fn in_object<T>(
        &self,
        visit: Visit,
        ray: &Ray,
        start: impl FnOnce(&StartRay) -> T,
        plain: impl FnOnce(&Ray) -> T,
    ) -> T {
        self.world_ray(visit.ray as usize).in_object(visit.instance, ray, start, plain)
    }

    /// Where the ray of a visit starts, if that is on a triangle of the instance.
    #[inline(always)]
    pub(super) fn start(&self, visit: Visit) -> Option<&InstanceStart> {
        self.starts.get(visit.ray as usize).filter(|start| start.instance == visit.instance)
    }
}

/// Visits of the instances of an object by rays of a batch.
#[derive(Clone, Copy)]
pub(super) struct ObjectVisits<'a> {
    pub(super) batch: &'a SceneBatch<'a>,
    pub(super) object: &'a ObjectView<'a>,
    pub(super) visits: &'a [Visit],
}

/// The answers so far, by ray.
#[derive(Clone, Copy)]
pub(super) enum BatchProgress<'a> {
    /// The nearest hits.
    Nearest(&'a [Hit]),
    /// True if anything is hit.
    Any(&'a [bool]),
}

impl<'a> BatchProgress<'a> {
    /// The rays from an index on.
    pub(super) fn of_rays_from(self, first: usize) -> BatchProgress<'a> {
        match self {
            BatchProgress::Nearest(hits) => BatchProgress::Nearest(&hits[first..]),
            BatchProgress::Any(found) => BatchProgress::Any(&found[first..]),
        }
    }

    /// The max t of hits that can still change the result of a ray if they lie in its range;
    /// negative infinity if its query is complete.
    #[inline(always)]
    pub(super) fn tmax(&self, ray: usize) -> f32 {
        match self {
            BatchProgress::Nearest(hits) => hits[ray].t,
            BatchProgress::Any(found) if found[ray] => f32::NEG_INFINITY,
            BatchProgress::Any(_) => f32::INFINITY,
        }
    }
}

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

/// Traces visits of one object, given with their rays in its space, and merges the answers into
/// those of the rays of the scene.
fn trace_visits(
    ObjectVisits { batch, object, visits }: ObjectVisits<'_>,
    object_rays: &ObjectRays,
    scratch: &mut Scratch,
    answers: Answers<'_>,
) {
    let scene = SceneRays { rays: batch.rays, visits, t_scale: &object_rays.t_scale };
    let sink = Sink::of_scene(object.triangle_ids, answers, scene);
    let mut sink = sink.with_starts(Starts(&object_rays.starts));
    object::trace_batch(object, &object_rays.rays, None, scratch, &mut sink);
}

/// The query for the nearest hits.
pub(super) struct SceneNearest<'a> {
    pub(super) hits: &'a mut [Hit],
    pub(super) scratch: &'a mut Scratch,
}

impl SceneQuery for SceneNearest<'_> {
    fn progress(&self) -> BatchProgress<'_> {
        BatchProgress::Nearest(self.hits)
    }
    fn trace_alone(&mut self, batch: &SceneBatch<'_>, ray: usize) {
        batch.world.store_nearest_of_ray(batch.objects, batch.world_ray(ray), &mut self.hits[ray]);
    }
    fn trace_one_by_one(&mut self, ObjectVisits { batch, object, visits }: ObjectVisits<'_>) {
        for &visit in visits {
            let i = visit.ray as usize;
            let ray = batch.object_ray(visit, batch.rays[i].tmax.min(self.hits[i].t));
            let hit = batch.in_object(
                visit,
                &ray.ray,
                |start| object::nearest(object, start, visit.instance),
                |ray| object::nearest(object, ray, visit.instance),
            );
            self.hits[i] = better(&batch.rays[i], &self.hits[i], &hit, ray.t_scale).unwrap_or(self.hits[i]);
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
            let ray = batch.object_ray(visit, batch.rays[i].tmax);
            self.found[i] |= batch.in_object(
                visit,
                &ray.ray,
                |start| object::any(object, start),
                |ray| object::any(object, ray),
            );
        }
    }
    fn trace_placed(&mut self, of_object: ObjectVisits<'_>, object_rays: &ObjectRays) {
        trace_visits(of_object, object_rays, self.scratch, Answers::Any(self.found));
    }
}
