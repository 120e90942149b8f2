//! Batches of rays through the instances: in rounds, sorted by object, so that each object gets many
//! rays at once.

use super::World;
use super::enter_object::ObjectRays;
use super::packets::Packets;
use super::placement::Placed;
use super::round::Round;
use super::traverse::RayTraversals;
use super::visit_queue::VisitQueue;
use crate::object::{self, Scratch};
use crate::query::sink::{SceneRays, Sink, Visit};
use crate::query::{self, Steps, better};
use crate::rays::{Hit, Ray, Surface};
use crate::simd::{Isa, Kernel, Simd};
use bth_format::file::File;
use bth_format::object::ObjectView;
use std::cell::RefCell;

/// Rays that are under way together.
const CHUNK: usize = 2048;
/// Rays through one instance from which on they are traced apart from those through others: so many, four packets if they go
/// together, that a small batch more is no loss.
const FEWEST_RAYS_APART: usize = 256;

/// What a query makes of rays in an object.
trait SceneQuery {
    /// The greatest t of a ray that is still of interest; `None` when nothing is.
    fn tmax(&self, ray: usize) -> Option<f32>;
    /// Traces the visits of one object.
    fn trace(&mut self, round: &Round<'_>, object: &ObjectView<'_>, visits: &[Visit]);
}

/// Rays under way, whose memory a thread keeps.
#[derive(Default)]
struct ActiveRays {
    /// Of the rays of a chunk that go together,
    packets: Packets,
    /// and of the others.
    walks: RayTraversals,
    /// The others that go on, by number within the chunk.
    active: Vec<u32>,
    visits: VisitQueue,
}

thread_local! {
    static ACTIVE_RAYS: RefCell<ActiveRays> = RefCell::default();
}

/// Starts the rays of a chunk.
struct StartKernel<'a> {
    round: &'a Round<'a>,
    /// The rays of the chunk: from this one on, so many.
    first: usize,
    count: usize,
    active_rays: &'a mut ActiveRays,
}

impl Kernel for StartKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let StartKernel { round, first, count, active_rays: ActiveRays { packets, walks, active, visits } } =
            self;
        let (world, rays) = (round.world, &round.rays[first..first + count]);
        let top = &world.top;
        packets.start(s, top, rays, active);
        // The instance that a ray starts on comes first: its answer shortens the ray at little cost.
        let start = |number: usize| world.start_of(round.from, first + number);
        if round.from.is_some() {
            let starts = active.iter().filter_map(|&number| Some((number, start(number as usize)?)));
            visits
                .all
                .extend(starts.map(|(number, instance)| Visit { ray: first as u32 + number, instance }));
            // Where there is no other that is all.
            if world.is_alone() {
                active.retain(|&number| start(number as usize).is_none());
            }
        }
        // Where it starts it will have been.
        walks.start(s, top, rays, active, start);
    }
}

/// Takes each ray that is under way to its next instance; those that have come to their end are under way no more.
struct AdvanceKernel<'a, Q> {
    round: &'a Round<'a>,
    query: &'a Q,
    /// The first ray of the chunk.
    first: usize,
    active_rays: &'a mut ActiveRays,
}

impl<Q: SceneQuery> Kernel for AdvanceKernel<'_, Q> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let AdvanceKernel { round, query, first, active_rays: ActiveRays { packets, walks, active, visits } } =
            self;
        let world = round.world;
        let tmax = |number: usize| query.tmax(first + number);
        packets.advance(&round.rays[first..], tmax, |number, instance| {
            visits.all.push(Visit { ray: (first + number) as u32, instance });
        });
        walks.advance(s, &world.top, active, tmax, (first as u32, &mut visits.all));
    }
}

impl World {
    /// Nearest hits; of equal t the instance of least number is reported.
    pub(crate) fn nearest(&self, file: &File, rays: &[Ray], from: Option<&[Surface]>, hits: &mut [Hit]) {
        hits.fill(Hit::MISS);
        object::with_scratch(|scratch| {
            let mut query = SceneNearest { rays, hits, scratch, batch: ObjectRays::default() };
            self.run(file, rays, from, &mut query);
        });
    }

    /// Whether anything is hit.
    pub(crate) fn any(&self, file: &File, rays: &[Ray], from: Option<&[Surface]>, found: &mut [bool]) {
        found.fill(false);
        object::with_scratch(|scratch| {
            let mut query = SceneAny { rays, found, scratch, batch: ObjectRays::default() };
            self.run(file, rays, from, &mut query);
        });
    }

    /// As [`Self::nearest`] for one ray, with a count of the work within objects.
    pub(crate) fn nearest_counted(&self, file: &File, ray: &Ray, from: Surface) -> (Hit, Steps) {
        let mut query = SceneCounted { ray, best: Hit::MISS, steps: Steps::default() };
        self.run(file, std::slice::from_ref(ray), Some(&[from]), &mut query);
        (query.best, query.steps)
    }

    fn run(&self, file: &File, rays: &[Ray], from: Option<&[Surface]>, query: &mut impl SceneQuery) {
        let round = Round { world: self, file, rays, from };
        // Taken out while they are in use, so that a panic leaves nothing half done behind.
        let mut active_rays = ACTIVE_RAYS.take();
        let isa = Isa::chosen();
        for first in (0..rays.len()).step_by(CHUNK) {
            let end = (first + CHUNK).min(rays.len());
            active_rays.visits.all.clear();
            isa.run(StartKernel { round: &round, first, count: end - first, active_rays: &mut active_rays });
            self.trace(&round, query, &mut active_rays.visits);
            while !active_rays.active.is_empty() || !active_rays.packets.is_empty() {
                isa.run(AdvanceKernel { round: &round, query, first, active_rays: &mut active_rays });
                self.trace(&round, query, &mut active_rays.visits);
            }
        }
        ACTIVE_RAYS.set(active_rays);
    }

    /// The instance that a ray is said to start on, if it can be seen.
    fn start_of(&self, from: Option<&[Surface]>, ray: usize) -> Option<u32> {
        let instance = from?[ray].instance;
        self.placed.get(instance as usize)?.is_some().then_some(instance)
    }

    /// The place of an instance that the top level holds.
    #[inline]
    pub(super) fn placed_at(&self, instance: u32) -> &Placed {
        self.placed[instance as usize].as_ref().expect("the top level holds instances with a place")
    }

    fn trace(&self, round: &Round<'_>, query: &mut impl SceneQuery, visits: &mut VisitQueue) {
        // In the space of one instance neighbours stay neighbours, and take the same way.
        visits.sort(self.placed.len());
        let mut trace = |object: u32, visits: &[Visit]| {
            self.touch(object);
            let object = round.file.view(object).expect("checked when opened");
            query.trace(round, object, visits);
        };
        let VisitQueue { sorted, short_runs, gathered, .. } = &mut *visits;
        short_runs.clear();
        let mut first = 0;
        for same in sorted.chunk_by(|a, b| a.instance == b.instance) {
            let (object, end) = (self.placed_at(same[0].instance).object(), first + same.len());
            if same.len() >= FEWEST_RAYS_APART {
                trace(object, same);
            } else {
                short_runs.push([object, first as u32, end as u32]);
            }
            first = end;
        }
        short_runs.sort_unstable();
        for runs in short_runs.chunk_by(|a, b| a[0] == b[0]) {
            gathered.clear();
            for &[_, first, end] in runs {
                gathered.extend_from_slice(&sorted[first as usize..end as usize]);
            }
            trace(runs[0][0], gathered);
        }
        visits.all.clear();
    }
}

struct SceneNearest<'a> {
    rays: &'a [Ray],
    hits: &'a mut [Hit],
    scratch: &'a mut Scratch,
    batch: ObjectRays,
}

impl SceneQuery for SceneNearest<'_> {
    fn tmax(&self, ray: usize) -> Option<f32> {
        Some(self.rays[ray].tmax.min(self.hits[ray].t))
    }
    fn trace(&mut self, round: &Round<'_>, object: &ObjectView<'_>, visits: &[Visit]) {
        if visits.len() < object::MIN_BATCH {
            for &visit in visits {
                let i = visit.ray as usize;
                let ray = round.object_ray(visit, round.rays[i].tmax.min(self.hits[i].t));
                let from = round.hint(i, visit.instance);
                let hit = object::nearest(object, &ray.ray, from, visit.instance);
                self.hits[i] =
                    better(&round.rays[i], &self.hits[i], &hit, ray.t_scale).unwrap_or(self.hits[i]);
            }
            return;
        }
        self.batch.fill(round, object, visits, |ray| round.rays[ray].tmax.min(self.hits[ray].t));
        let scene = SceneRays { rays: round.rays, visits, t_scale: &self.batch.t_scale };
        let mut to = Sink::<query::Nearest>::of_scene(object.triangle_ids, self.hits, scene);
        object::trace_batch(object, &self.batch.rays, self.batch.hints(), self.scratch, &mut to);
    }
}

struct SceneAny<'a> {
    rays: &'a [Ray],
    found: &'a mut [bool],
    scratch: &'a mut Scratch,
    batch: ObjectRays,
}

impl SceneQuery for SceneAny<'_> {
    fn tmax(&self, ray: usize) -> Option<f32> {
        (!self.found[ray]).then(|| self.rays[ray].tmax)
    }
    fn trace(&mut self, round: &Round<'_>, object: &ObjectView<'_>, visits: &[Visit]) {
        if visits.len() < object::MIN_BATCH {
            for &visit in visits {
                let i = visit.ray as usize;
                let (ray, from) = (round.object_ray(visit, self.rays[i].tmax), round.hint(i, visit.instance));
                self.found[i] |= object::any(object, &ray.ray, from);
            }
            return;
        }
        self.batch.fill(round, object, visits, |ray| round.rays[ray].tmax);
        let scene = SceneRays { rays: round.rays, visits, t_scale: &self.batch.t_scale };
        let mut to = Sink::<query::Any>::of_scene(object.triangle_ids, self.found, scene);
        object::trace_batch(object, &self.batch.rays, self.batch.hints(), self.scratch, &mut to);
    }
}

struct SceneCounted<'a> {
    ray: &'a Ray,
    best: Hit,
    steps: Steps,
}

impl SceneQuery for SceneCounted<'_> {
    fn tmax(&self, _: usize) -> Option<f32> {
        Some(self.ray.tmax.min(self.best.t))
    }
    fn trace(&mut self, round: &Round<'_>, object: &ObjectView<'_>, visits: &[Visit]) {
        for &visit in visits {
            let object_ray = round.object_ray(visit, self.ray.tmax.min(self.best.t));
            let from = round.hint(visit.ray as usize, visit.instance);
            let (hit, more) = object::nearest_counted(object, &object_ray.ray, from, visit.instance);
            self.steps += more;
            self.best = better(self.ray, &self.best, &hit, object_ray.t_scale).unwrap_or(self.best);
        }
    }
}

#[cfg(test)]
#[path = "batch_tests.rs"]
mod tests;
