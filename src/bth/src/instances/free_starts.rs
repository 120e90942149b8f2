//! Rays that certainly do not meet the instance on which they start, decided before they go through the top level.
//!
//! Such a ray leaves its triangle in a direction that is free for the instance's object ([`crate::free`]). It never enters that instance,
//! and it ends where it meets no other instance's box. The ray that is looked up is the one that would be traced in the instance, with all its
//! rounding, so the answer is the same.

use super::World;
use super::enter_object::ObjectRays;
use super::progress::Progress;
use super::scene_batch::SceneBatch;
use super::visit_queue::VisitQueue;
use crate::SMALL;
use crate::free::{self, Rest};
use crate::object::Hinted;
use crate::objects::Objects;
use crate::query::sink::Visit;
use crate::rays::{PrimitiveRef, Ray};
use bth_format::layout::{Child, NONE};
use std::ops::Range;

/// For each ray of a chunk the instance on which it starts and which it certainly does not meet. A thread keeps this memory from one
/// batch to the next.
#[derive(Default)]
pub(super) struct FreeStarts {
    /// By index in the chunk; `NONE` if the ray may meet all instances. Empty if that is so for all rays.
    not_met: Vec<u32>,
    /// Rays that hit the instance on which they start only behind their `tmin`: by index in the chunk that instance, or `NONE`, and the t
    /// in its space from which on. Empty if that is known of none.
    later: Vec<(u32, f32)>,
    /// Index in the batch of the first ray of the chunk.
    first: usize,
    visits: VisitQueue,
    object_rays: ObjectRays,
    rest: Rest,
}

impl FreeStarts {
    /// The instance that a ray of the chunk does not meet, or `NONE`.
    #[inline(always)]
    pub(super) fn not_met(&self, index: usize) -> u32 {
        if SMALL { NONE } else { self.not_met.get(index).copied().unwrap_or(NONE) }
    }

    /// Of some rays, a bit each from the index `first` on, those that may meet an instance.
    #[inline(always)]
    pub(super) fn that_may_meet(&self, instance: u32, first: usize, rays: u64) -> u64 {
        if SMALL || self.not_met.is_empty() {
            return rays;
        }
        let (mut rest, mut may_meet) = (rays, rays);
        while rest != 0 {
            let bit = rest & rest.wrapping_neg();
            rest ^= bit;
            if self.not_met[first + bit.trailing_zeros() as usize] == instance {
                may_meet ^= bit;
            }
        }
        may_meet
    }

    /// Lets the ranges of rays in the space of an object, given with their visits, begin where they can hit anything.
    pub(super) fn begin_later(&self, visits: &[Visit], rays: &mut [Ray]) {
        if SMALL || self.later.is_empty() {
            return;
        }
        for (visit, ray) in visits.iter().zip(rays) {
            let (instance, begin) = self.later[visit.ray as usize - self.first];
            let is_later = instance == visit.instance && begin > ray.tmin;
            ray.tmin = if is_later { begin } else { ray.tmin };
        }
    }

    /// Decides the rays of a chunk.
    pub(super) fn find(&mut self, batch: &SceneBatch<'_>, chunk: Range<usize>) {
        if SMALL {
            return;
        }
        let FreeStarts { not_met, later, first, visits, object_rays, rest } = self;
        not_met.clear();
        later.clear();
        *first = chunk.start;
        let Some(from) = batch.hints() else { return };
        visits.clear();
        let mut starts = Starts::new(batch.world, batch.objects);
        for ray in chunk.clone() {
            if let Some(instance) = starts.instance(from[ray]).filter(|_| starts.is_looked_up) {
                visits.all.push(Visit { ray: ray as u32, instance });
            }
        }
        if visits.all.is_empty() {
            return;
        }
        not_met.resize(chunk.len(), NONE);
        batch.world.by_object(visits, |object, visits| {
            let object = batch.objects.view(object);
            object_rays.fill(batch, true, visits, Progress::None);
            if free::find_rest(object, &object_rays.rays, &object_rays.from, Hinted::are_forced(), rest) {
                let place = |visit: &Visit| visit.ray as usize - chunk.start;
                for visit in visits {
                    not_met[place(visit)] = visit.instance;
                }
                if later.is_empty() {
                    later.resize(chunk.len(), (NONE, 0.0));
                }
                for index in &rest.order {
                    let visit = &visits[*index as usize];
                    not_met[place(visit)] = NONE;
                    later[place(visit)] = (visit.instance, rest.rays[*index as usize].tmin);
                }
            }
        });
    }
}

/// The instances on which rays start. Neighbouring rays often start on the same one, which is kept.
pub(super) struct Starts<'a> {
    world: &'a World,
    objects: &'a Objects,
    last: Option<u32>,
    /// Whether the object of the last instance has free directions that are worth a look-up.
    is_looked_up: bool,
    /// Whether hints are of any use in that object.
    pub(super) is_of_use: bool,
}

impl<'a> Starts<'a> {
    pub(super) fn new(world: &'a World, objects: &'a Objects) -> Starts<'a> {
        Starts { world, objects, last: None, is_looked_up: false, is_of_use: false }
    }

    /// The instance on which a ray starts, if it is given and visible; then its object is that of the fields.
    #[inline(always)]
    pub(super) fn instance(&mut self, from: PrimitiveRef) -> Option<u32> {
        if self.last != Some(from.instance) {
            self.look_at(from.instance)?;
        }
        self.last
    }

    fn look_at(&mut self, instance: u32) -> Option<()> {
        let placement = self.world.placements.get(instance as usize)?.as_ref()?;
        let object = self.objects.view(placement.object());
        // A ray passes an object of a leaf as quickly as it is looked up.
        let has_nodes =
            matches!(Child::from_code(object.header.root), Some(Child::Node(_) | Child::Packed(_)));
        self.is_looked_up = has_nodes && free::is_known(object);
        self.is_of_use = self.is_looked_up || !object.tet_leaves.is_empty();
        self.last = Some(instance);
        Some(())
    }
}
