//! Batches of rays through the instances. All rays of a chunk advance to their next instance. Then
//! their visits are sorted by instance, so that each object receives many rays at once.

use super::World;
use super::enter_object::ObjectRays;
use super::lists::InstanceLists;
use super::packets::TopLevelPackets;
use super::placement::Placement;
use super::scene_batch::{BatchProgress, Chunk, ObjectVisits, SceneBatch, WorldRays};
use super::scene_query::{SceneAny, SceneNearest, SceneQuery};
use super::visit_queue::VisitQueue;
use crate::object;
use crate::objects::Objects;
use crate::query::sink::Visit;
use crate::rays::Hit;
use crate::simd::{Isa, Kernel, Simd};
use crate::starts::world_ray::InstanceStart;
use bth_format::layout::NONE;
use std::cell::Cell;

/// Number of rays that advance together.
const CHUNK: usize = 2048;
/// From this number of rays on, the rays through one instance are a separate batch: four packets
/// hold them, so the cost of a further batch is small. Fewer rays are joined with the rays through
/// other instances of the same object.
const MIN_RAYS_PER_INSTANCE: usize = 256;

/// The state of a chunk's rays. A thread keeps the memory from one batch to the next.
#[derive(Default)]
struct ActiveRays {
    /// The coherent rays.
    packets: TopLevelPackets,
    /// The other rays that f32 prepares.
    lists: InstanceLists,
    /// Indices within the chunk of the rest. Each of them is traced alone.
    alone: Vec<u32>,
    /// The visits to be traced before the rays advance.
    visits: VisitQueue,
    /// The rays of visits in the space of their object.
    object_rays: ObjectRays,
}

impl ActiveRays {
    fn is_any_active(&self) -> bool {
        !(self.lists.active.is_empty() && self.packets.is_empty())
    }
}

thread_local! {
    static ACTIVE_RAYS: Cell<Option<Box<ActiveRays>>> = const { Cell::new(None) };
}

/// Kernel that starts the rays of a chunk.
struct StartKernel<'a> {
    chunk: Chunk<'a>,
    /// The starts of its rays; empty if no rays start on triangles, or several instances are
    /// visible.
    starts: &'a [InstanceStart],
    active_rays: &'a mut ActiveRays,
}

impl Kernel for StartKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let StartKernel { chunk, starts, active_rays } = self;
        let ActiveRays { packets, lists, alone, visits, .. } = active_rays;
        packets.start(s, &chunk, alone);
        if !starts.is_empty() {
            // No other instance is visible, so a ray that starts on it needs no traversal.
            alone.retain(|&index| {
                let start = &starts[index as usize];
                let starts_here = start.instance != NONE;
                if starts_here {
                    visits.all.push(Visit { ray: chunk.first + index, instance: start.instance });
                }
                !starts_here
            });
        }
        lists.start(s, &chunk, alone, &mut visits.all);
    }
}

/// Kernel that advances each active ray to its next instance, and removes the rays that have ended.
struct AdvanceKernel<'a> {
    /// The answers so far of the rays of the chunk.
    progress: BatchProgress<'a>,
    /// Index of the first ray of the chunk.
    first: u32,
    active_rays: &'a mut ActiveRays,
}

impl Kernel for AdvanceKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let AdvanceKernel { progress, first, active_rays: ActiveRays { packets, lists, visits, .. } } = self;
        packets.advance(s, progress, first, visits);
        lists.advance(progress, first, &mut visits.all);
    }
}

impl World {
    /// Stores the nearest hits. Of hits at equal t, the lower instance index wins. All are
    /// [`Hit::MISS`] before.
    pub(crate) fn nearest(&self, objects: &Objects, of: WorldRays<'_>, hits: &mut [Hit]) {
        let WorldRays { rays, starts, wide } = of;
        let batch = SceneBatch { world: self, objects, rays, starts, wide };
        object::with_scratch(|scratch| {
            self.run(&batch, &mut SceneNearest { hits, scratch, is_wide: !wide.is_empty() })
        });
    }

    /// Stores for each ray whether it hits anything. All are false before.
    pub(crate) fn any(&self, objects: &Objects, of: WorldRays<'_>, found: &mut [bool]) {
        let WorldRays { rays, starts, wide } = of;
        let batch = SceneBatch { world: self, objects, rays, starts, wide };
        object::with_scratch(|scratch| self.run(&batch, &mut SceneAny { found, scratch }));
    }

    fn run(&self, batch: &SceneBatch<'_>, query: &mut dyn SceneQuery) {
        // Taken out while in use, so that after a panic the next batch begins with new memory.
        let mut active_rays = ACTIVE_RAYS.take().unwrap_or_default();
        let isa = Isa::chosen();
        for (i, rays) in batch.rays.chunks(CHUNK).enumerate() {
            let (first, active_rays) = (i * CHUNK, &mut *active_rays);
            active_rays.visits.clear();
            let chunk = Chunk { top: &self.top, rays, first: first as u32 };
            let starts =
                if self.only_visible().is_some() { batch.starts.get(first..).unwrap_or(&[]) } else { &[] };
            isa.run(StartKernel { chunk, starts, active_rays });
            for index in active_rays.alone.drain(..) {
                query.trace_alone(batch, first + index as usize);
            }
            self.trace(batch, query, active_rays);
            while active_rays.is_any_active() {
                let progress = query.progress().of_rays_from(first);
                isa.run(AdvanceKernel { progress, first: first as u32, active_rays });
                for index in active_rays.lists.unfinished.drain(..) {
                    query.trace_alone(batch, first + index as usize);
                }
                self.trace(batch, query, active_rays);
            }
        }
        ACTIVE_RAYS.set(Some(active_rays));
    }

    /// The placement of an instance that is in the top level.
    #[inline]
    pub(crate) fn placement(&self, instance: u32) -> &Placement {
        match self.placements.get(instance as usize) {
            Some(Some(placement)) => placement,
            _ => self.stored_placement(instance).expect("the top level holds visible instances"),
        }
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

    /// Calls `work` with objects and all queued visits of their instances, sorted by instance. An
    /// object may come several times.
    pub(super) fn by_object(&self, visits: &mut VisitQueue, mut work: impl FnMut(u32, &[Visit])) {
        // Neighbouring rays through one instance remain coherent in its space.
        visits.sort(self.row_count());
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

#[cfg(test)]
#[path = "batch_tests.rs"]
mod tests;
