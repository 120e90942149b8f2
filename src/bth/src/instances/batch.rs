//! Batches of rays through the instances. All rays of a chunk advance to their next instance; then their visits are sorted by
//! instance, so that each object receives many rays at once.

use super::World;
use super::enter_object::ObjectRays;
use super::listed_rays::ListedRays;
use super::packets::TopLevelPackets;
use super::placement::Placement;
use super::progress::Progress;
use super::scene_batch::{ObjectVisits, SceneBatch};
use super::scene_query::SceneQuery;
use super::top_level::TopLevel;
use super::traverse::RayTraversals;
use super::visit_queue::VisitQueue;
use crate::intersect::start_point::Starts;
use crate::object::{self, Scratch};
use crate::objects::Objects;
use crate::query::better;
use crate::query::sink::{Answers, SceneRays, Sink, Visit};
use crate::rays::{Hit, Ray};
use crate::simd::{Isa, Kernel, Simd};
use crate::starts::world_ray::InstanceStart;
use bth_format::layout::NONE;
use std::cell::Cell;

/// Number of rays that advance together.
const CHUNK: usize = 2048;
/// From this number of rays on, the rays through one instance are a batch of their own: they are as many as four packets hold, so
/// the cost of a further batch is small. Fewer rays are joined with those through other instances of the same object.
const MIN_RAYS_PER_INSTANCE: usize = 256;

/// The rays of a chunk. A thread keeps their memory from one batch to the next.
#[derive(Default)]
struct ActiveRays {
    /// The coherent rays.
    packets: TopLevelPackets,
    /// Of the other rays those that meet few instances' boxes.
    lists: ListedRays,
    /// The rest.
    traversals: RayTraversals,
    /// Indices within the chunk of the rays in `traversals` that have not ended.
    active: Vec<u32>,
    /// The visits to be traced before the rays advance.
    visits: VisitQueue,
    /// The rays of visits in the space of their object.
    object_rays: ObjectRays,
}

impl ActiveRays {
    fn is_any_active(&self) -> bool {
        !(self.active.is_empty() && self.lists.active.is_empty() && self.packets.is_empty())
    }
}

thread_local! {
    static ACTIVE_RAYS: Cell<Option<Box<ActiveRays>>> = const { Cell::new(None) };
}

/// Kernel that starts the rays of a chunk.
struct StartKernel<'a> {
    batch: &'a SceneBatch<'a>,
    /// Index of the first ray of the chunk.
    first: usize,
    /// Number of its rays.
    count: usize,
    active_rays: &'a mut ActiveRays,
}

impl Kernel for StartKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let StartKernel {
            batch,
            first,
            count,
            active_rays: ActiveRays { packets, lists, traversals, active, visits, .. },
        } = self;
        let (world, rays) = (batch.world, &batch.rays[first..first + count]);
        let top = &world.top;
        packets.start(s, top, rays, active);
        if world.has_single_visible() && !batch.starts.is_empty() {
            // No other instance is visible, so a ray that starts on it needs no traversal.
            active.retain(|&index| {
                let start = &batch.starts[first + index as usize];
                let starts_here = start.instance != NONE;
                if starts_here {
                    visits.all.push(Visit { ray: first as u32 + index, instance: start.instance });
                }
                !starts_here
            });
        }
        let queue = (lists, first as u32, &mut visits.all);
        traversals.start(s, top, rays, active, queue);
    }
}

/// Kernel that advances each active ray to its next instance, and removes the rays that have ended.
struct AdvanceKernel<'a> {
    top: &'a TopLevel,
    /// The answers so far of the rays of the chunk.
    progress: Progress<'a>,
    /// Index of the first ray of the chunk.
    first: u32,
    active_rays: &'a mut ActiveRays,
}

impl Kernel for AdvanceKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let AdvanceKernel {
            top,
            progress,
            first,
            active_rays: ActiveRays { packets, lists, traversals, active, visits, .. },
        } = self;
        packets.advance(s, progress, (first, visits));
        lists.advance(progress, (first, &mut visits.all));
        traversals.advance(s, top, active, progress, (first, &mut visits.all));
    }
}

impl World {
    /// Stores the nearest hits; among hits of equal t that in the instance of least index. All are [`Hit::MISS`] before. `starts` holds
    /// the starts of all rays, or is empty.
    pub(crate) fn nearest(
        &self,
        objects: &Objects,
        rays: &[Ray],
        starts: &[InstanceStart],
        hits: &mut [Hit],
    ) {
        object::with_scratch(|scratch| self.run(objects, rays, starts, &mut SceneNearest { hits, scratch }));
    }

    /// Stores whether rays hit anything; false before.
    pub(crate) fn any(&self, objects: &Objects, rays: &[Ray], starts: &[InstanceStart], found: &mut [bool]) {
        object::with_scratch(|scratch| {
            self.run(objects, rays, starts, &mut SceneAny { rays, found, scratch })
        });
    }

    fn run(&self, objects: &Objects, rays: &[Ray], starts: &[InstanceStart], query: &mut dyn SceneQuery) {
        let batch = SceneBatch { world: self, objects, rays, starts };
        // They are taken out while they are in use, so that after a panic the next batch begins with new memory.
        let mut active_rays = ACTIVE_RAYS.take().unwrap_or_default();
        let isa = Isa::chosen();
        for first in (0..rays.len()).step_by(CHUNK) {
            let end = (first + CHUNK).min(rays.len());
            active_rays.visits.clear();
            let (count, active_rays) = (end - first, &mut *active_rays);
            isa.run(StartKernel { batch: &batch, first, count, active_rays });
            self.trace(&batch, query, active_rays);
            while active_rays.is_any_active() {
                let progress = query.progress().of_rays_from(first);
                let (top, first, active_rays) = (&self.top, first as u32, &mut *active_rays);
                isa.run(AdvanceKernel { top, progress, first, active_rays });
                self.trace(&batch, query, active_rays);
            }
        }
        ACTIVE_RAYS.set(Some(active_rays));
    }

    /// The placement of an instance that is in the top level.
    #[inline]
    pub(crate) fn placement(&self, instance: u32) -> &Placement {
        self.placements[instance as usize].as_ref().expect("the top level holds visible instances")
    }

    /// Traces all queued visits, object by object, and empties the queue.
    fn trace(&self, batch: &SceneBatch<'_>, query: &mut dyn SceneQuery, active_rays: &mut ActiveRays) {
        let ActiveRays { visits, object_rays, .. } = active_rays;
        self.by_object(visits, |object, visits| {
            self.mark_traced(object);
            let object = batch.objects.view(object);
            query.trace(ObjectVisits { batch, object, visits }, object_rays);
        });
        visits.clear();
    }

    /// Calls `work` with objects and all queued visits of their instances, sorted by instance. An object may come several times.
    pub(super) fn by_object(&self, visits: &mut VisitQueue, mut work: impl FnMut(u32, &[Visit])) {
        // Neighbouring rays through one instance remain coherent in its space.
        visits.sort(self.placements.len());
        let VisitQueue { sorted, short_runs, gathered, .. } = &mut *visits;
        short_runs.clear();
        let mut first = 0;
        for run in sorted.chunk_by(|a, b| a.instance == b.instance) {
            let (object, end) = (self.placement(run[0].instance).object(), first + run.len());
            if run.len() >= MIN_RAYS_PER_INSTANCE {
                work(object, run);
            } else {
                short_runs.push(u64::from(object) << 32 | first as u64);
            }
            first = end;
        }
        short_runs.sort_unstable();
        for runs in short_runs.chunk_by(|a, b| a >> 32 == b >> 32) {
            gathered.clear();
            for &run in runs {
                let visits = &sorted[run as u32 as usize..];
                gathered.extend(visits.iter().take_while(|visit| visit.instance == visits[0].instance));
            }
            work((runs[0] >> 32) as u32, gathered);
        }
    }
}

/// Traces visits of one object, given with their rays in its space, and merges the answers into those of the rays of the scene.
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

struct SceneNearest<'a> {
    hits: &'a mut [Hit],
    scratch: &'a mut Scratch,
}

impl SceneQuery for SceneNearest<'_> {
    fn progress(&self) -> Progress<'_> {
        Progress::Nearest(self.hits)
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

struct SceneAny<'a> {
    rays: &'a [Ray],
    found: &'a mut [bool],
    scratch: &'a mut Scratch,
}

impl SceneQuery for SceneAny<'_> {
    fn progress(&self) -> Progress<'_> {
        Progress::Any(self.found)
    }
    fn trace_one_by_one(&mut self, ObjectVisits { batch, object, visits }: ObjectVisits<'_>) {
        for &visit in visits {
            let i = visit.ray as usize;
            let ray = batch.object_ray(visit, self.rays[i].tmax);
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

#[cfg(test)]
#[path = "batch_tests.rs"]
mod tests;
