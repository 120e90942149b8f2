//! Tracing rays through one object: BVH walk, tet walk, and what both share.
// Closures and iterators over lanes are compiled without the instructions that these need.
#![allow(clippy::needless_range_loop)]

mod batch;
mod bvh;
mod candidate;
mod choice;
mod hinted;
mod intersection;
mod intersections;
mod line;
mod packets;
mod prepare;
mod query;
mod sight;
mod single;
mod sink;
mod slabs;
mod tets;

pub(crate) use batch::{any_batch, miss_all, nearest_batch, trace_batch};
pub(crate) use bvh::flight::KEY_SLACK;
pub(crate) use bvh::stack::{BOTTOM, Place, Stacks};
pub use hinted::Hinted;
pub(crate) use packets::coherence::{Guard, Span, is_same_octant};
pub(crate) use packets::group::Group;
pub(crate) use packets::hull::{Beam, Hull};
pub(crate) use packets::packet::PACKET;
pub(crate) use prepare::Prepared;
pub use query::Steps;
pub(crate) use query::{Any, Nearest, better};
pub(crate) use sink::{SceneRays, Sink, Visit};
pub(crate) use slabs::Slabs;

use crate::rays::{Hit, Ray};
use bth_format::object::ObjectView;
use choice::Choices;
use packets::PacketScratch;
use single::trace;
use std::cell::Cell;

/// Fewer rays than these are traced one after the other.
pub(crate) const FEW: usize = 4;

/// Memory that traversals need, kept from one batch to the next.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    stacks: Stacks,
    packets: PacketScratch,
    choices: Choices,
}

/// Lends the thread's scratch memory.
#[inline(always)]
pub(crate) fn with_scratch<R>(work: impl FnOnce(&mut Scratch) -> R) -> R {
    thread_local! {
        static SCRATCH: Cell<Option<Box<Scratch>>> = const { Cell::new(None) };
    }
    // Taken out while it is in use, so that a panic leaves nothing half done behind.
    SCRATCH.with(|lent| {
        let mut scratch = lent.take().unwrap_or_default();
        let result = work(&mut scratch);
        lent.set(Some(scratch));
        result
    })
}

/// Nearest hit of a ray in object space; `from` is the triangle it starts on, or `NONE`.
#[inline(never)]
pub(crate) fn nearest(object: &ObjectView<'_>, ray: &Ray, from: u32, instance: u32) -> Hit {
    let mut hit = Hit::MISS;
    nearest_to(object, ray, from, instance, &mut hit);
    hit
}

/// As [`nearest`], written to `to`.
#[inline(always)]
pub(crate) fn nearest_to(object: &ObjectView<'_>, ray: &Ray, from: u32, instance: u32, to: &mut Hit) {
    trace::<Nearest, ()>(object, ray, from, instance, &mut (), to);
}

/// As [`nearest`], with a count of the work.
pub(crate) fn nearest_counted(object: &ObjectView<'_>, ray: &Ray, from: u32, instance: u32) -> (Hit, Steps) {
    let (mut hit, mut steps) = (Hit::MISS, Steps::default());
    trace::<Nearest, Steps>(object, ray, from, instance, &mut steps, &mut hit);
    (hit, steps)
}

/// Whether a ray in object space hits anything.
#[inline(always)]
pub(crate) fn any(object: &ObjectView<'_>, ray: &Ray, from: u32) -> bool {
    let mut found = false;
    trace::<Any, ()>(object, ray, from, 0, &mut (), &mut found);
    found
}
