//! Rays that start on a known triangle of an instance, before they go through the top level.
//!
//! Those that leave it in a direction that is free for the instance's object ([`crate::free`]) certainly do not meet the instance. The
//! others are traced in it at once, from where on they can hit anything: it comes first anyway, since its box holds their start, and their hits
//! end them before they meet the boxes of others. So no ray enters the instance on which it starts later on. The ray that is looked up is the
//! one that would be traced in the instance, with all its rounding, so the answer is the same.

use super::World;
use super::enter_object::ObjectRays;
use super::progress::Progress;
use super::scene_batch::SceneBatch;
use super::scene_query::{ObjectVisits, SceneQuery};
use super::visit_queue::VisitQueue;
use crate::SMALL;
use crate::free::{self, Rest};
use crate::object::Hinted;
use crate::objects::Objects;
use crate::query::sink::Visit;
use crate::rays::{PrimitiveRef, Ray};
use bth_format::layout::{Child, NONE};
use std::ops::Range;

/// For each ray of a chunk the instance on which it starts, if it has been traced there or certainly does not meet it. A thread keeps this
/// memory from one batch to the next.
#[derive(Default)]
pub(super) struct FreeStarts {
    /// By index in the chunk that instance; `NONE` if the ray may still meet all. Empty if that is so for all rays.
    not_met: Vec<u32>,
    /// The rays of a chunk, ending at their hits so far, where any are traced before they go through the top level.
    ended: Vec<Ray>,
    /// Visits of an object that are left.
    left: Vec<Visit>,
    visits: VisitQueue,
    object_rays: ObjectRays,
    rest: Rest,
}

impl FreeStarts {
    /// The instance that a ray of the chunk does not meet any more, or `NONE`.
    #[inline(always)]
    pub(super) fn not_met(&self, index: usize) -> u32 {
        if SMALL { NONE } else { self.not_met.get(index).copied().unwrap_or(NONE) }
    }

    /// Of some rays, a bit each from the index `first` on, those that may still meet an instance.
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

    /// Whether any rays may have been traced before they go through the top level.
    pub(super) fn are_any_traced(&self) -> bool {
        !SMALL && !self.not_met.is_empty()
    }

    /// The rays of a chunk, ending at their hits so far, and by index the instances that they do not meet.
    pub(super) fn ended<'a>(&'a mut self, rays: &'a [Ray], progress: Progress<'_>) -> (&'a [Ray], &'a [u32]) {
        if !self.are_any_traced() {
            return (rays, &[]);
        }
        // Rays that any hit ends are not among those that go on.
        if let Progress::Any(_) = progress {
            return (rays, &self.not_met);
        }
        self.ended.clear();
        // Not `f32::min`, which would replace a `tmax` of NaN by a number.
        let ended = rays.iter().enumerate().map(|(i, ray)| {
            let so_far = progress.tmax(i);
            Ray { tmax: if so_far < ray.tmax { so_far } else { ray.tmax }, ..*ray }
        });
        self.ended.extend(ended);
        (&self.ended, &self.not_met)
    }

    /// Decides the rays of a chunk, and traces those that may meet the instance on which they start.
    pub(super) fn find(&mut self, batch: &SceneBatch<'_>, chunk: Range<usize>, query: &mut dyn SceneQuery) {
        if SMALL {
            return;
        }
        let FreeStarts { not_met, left, visits, object_rays, rest, .. } = self;
        not_met.clear();
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
        batch.world.by_object(visits, |object, visits| {
            let view = batch.objects.view(object);
            object_rays.fill(batch, true, visits, Progress::None);
            if !free::find_rest(view, &object_rays.rays, &object_rays.from, Hinted::are_forced(), rest) {
                return;
            }
            not_met.resize(chunk.len(), NONE);
            for visit in visits {
                not_met[visit.ray as usize - chunk.start] = visit.instance;
            }
            if rest.order.is_empty() {
                return;
            }
            left.clear();
            left.extend(rest.order.iter().map(|index| visits[*index as usize]));
            object_rays.keep(&rest.order, &rest.rays, !view.tet_leaves.is_empty());
            batch.world.mark_traced(object);
            query.trace_placed(ObjectVisits { batch, object: view, visits: left }, object_rays);
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
