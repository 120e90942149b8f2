//! Tracing of one object by batches of rays. Coherent rays are traced in packets, the others
//! interleaved through the BVH. An object that is one special leaf is entered without it.

use super::scratch::Scratch;
use super::single::{RayOfBatch, any_in_scalar, nearest_in_scalar};
use crate::bvh::interleaved::Interleaved;
use crate::bvh::nodes::is_large;
use crate::bvh::packet::{MinimumUse, Packets};
use crate::intersect::exact_ray::Lines;
use crate::query::sink::{Answers, Sink};
use crate::query::with_batch_goal;
use crate::rays::{Ray, StartRay};
use crate::shortcuts::{self, RAYS_PER_PART, SpecialLeaf};
use crate::simd::Isa;
use crate::starts::prepare::PreparedStarts;
use bth_format::layout::NONE;
use bth_format::object::ObjectView;

/// Smallest number of rays of a batch; fewer rays are traced one after the other.
pub(crate) const MIN_BATCH: usize = 4;
/// Where at most one in this many rays has ended, all are traced: packets without gaps save more.
const FEW_ENDED: usize = 8;

/// Stores in `sink` the answers of those rays in object space that hit anything: all of them, or
/// those whose indices are in `order`.
pub(crate) fn trace_batch(
    object: &ObjectView<'_>,
    rays: &[Ray],
    order: Option<&[u32]>,
    scratch: &mut Scratch,
    sink: &mut Sink<'_>,
) {
    if object.header.root == NONE {
        return;
    }
    let (lines, mut with_starts) = (sink.lines(), None);
    let object = match lines {
        // The caller has set the bounds of lines in world space.
        Lines::Rays | Lines::World(..) => object,
        Lines::Starts(_) => with_starts.insert(ObjectView { bounds: object.start_bounds, ..*object }),
    };
    // Packets and interleaved rays are not compiled for scalar code, where they would be the
    // largest part of the library.
    let isa = Isa::chosen();
    if isa == Isa::Scalar {
        return one_by_one(object, rays, order, sink);
    }
    if order.is_some() {
        // Too few rays are left of most packets.
        through_bvh(isa, object, rays, order, (scratch, sink));
    } else if let (Some(leaf), true) = (shortcuts::whole(object), lines.are_rays()) {
        through_leaf(isa, object, leaf, rays, (scratch, sink));
    } else {
        let packet_rays = in_packets(isa, object, rays, scratch, sink);
        if packet_rays < rays.len() {
            let rest = std::mem::take(&mut scratch.packets.rest);
            let order = (packet_rays > 0).then_some(&rest[..]);
            through_bvh(isa, object, rays, order, (scratch, sink));
            scratch.packets.rest = rest;
        }
    }
}

/// Traces rays through the special leaf that is the whole object.
#[cold]
#[inline(never)]
fn through_leaf(
    isa: Isa,
    object: &ObjectView<'_>,
    leaf: SpecialLeaf,
    rays: &[Ray],
    (scratch, sink): (&mut Scratch, &mut Sink<'_>),
) {
    let mut special = std::mem::take(&mut scratch.special);
    for (part, rays) in rays.chunks(RAYS_PER_PART).enumerate() {
        let sink = &mut sink.part(part * RAYS_PER_PART);
        leaf.trace(object, rays, &mut special, sink);
        if !special.rest.is_empty() {
            through_bvh(isa, object, rays, Some(&special.rest), (scratch, sink));
        }
    }
    scratch.special = special;
}

/// Traces coherent rays in packets and returns their number. If it is not 0, the indices of the
/// other rays are stored in `scratch.packets.rest`.
fn in_packets(
    isa: Isa,
    object: &ObjectView<'_>,
    rays: &[Ray],
    scratch: &mut Scratch,
    sink: &mut Sink<'_>,
) -> usize {
    let (least, scratch) = (MinimumUse::of(object), &mut scratch.packets);
    with_batch_goal!(isa, sink.goal(), goal => {
        isa.run(Packets { object, rays, scratch, least, goal, sink }).rays
    })
}

/// Traces rays through the BVH, interleaved.
fn through_bvh(
    isa: Isa,
    object: &ObjectView<'_>,
    rays: &[Ray],
    order: Option<&[u32]>,
    (scratch, sink): (&mut Scratch, &mut Sink<'_>),
) {
    let (stacks, entry_nodes) = (&mut scratch.stacks, is_large(object));
    with_batch_goal!(isa, sink.goal(), goal => {
        isa.run(Interleaved { object, rays, order, stacks, sink, goal, entry_nodes });
    });
}

/// Implements [`trace_batch`] in scalar code, one ray after the other.
fn one_by_one(object: &ObjectView<'_>, rays: &[Ray], order: Option<&[u32]>, sink: &mut Sink<'_>) {
    let (is_any, lines) = (sink.goal().is_any, sink.lines());
    let trace = |index: usize, sink: &mut Sink<'_>| {
        let ray = RayOfBatch { ray: &rays[index], line: lines.of(index) };
        if !is_any {
            sink.answer(index, nearest_in_scalar(object, &ray, sink.instance_of(index)));
        } else if any_in_scalar(object, &ray) {
            sink.accepted(index);
        }
    };
    match order {
        Some(order) => order.iter().for_each(|&index| trace(index as usize, sink)),
        None => (0..rays.len()).for_each(|index| trace(index, sink)),
    }
}

/// Stores the answers of rays that start on triangles of an object, in the instance with the given
/// index: they become rays of the object, with the exact points at which they start.
pub(crate) fn trace_starts(
    object: &ObjectView<'_>,
    rays: &[StartRay],
    instance: u32,
    scratch: &mut Scratch,
    mut answers: Answers<'_>,
) {
    let mut prepared = std::mem::take(&mut scratch.starts);
    prepared.fill(object, rays, instance);
    let PreparedStarts { rays: object_rays, points, order } = &mut prepared;
    let ended = rays.len() - order.len();
    let sink =
        |answers, points| Sink::new(object.triangle_ids, answers, instance).with_lines(Lines::Starts(points));
    if answers.goal().is_any && ended * FEW_ENDED > rays.len() {
        // Most short rays go in packets, also those that are left. No ray is before its place among
        // those that are left.
        for (i, &ray) in order.iter().enumerate() {
            (object_rays[i], points[i]) = (object_rays[ray as usize], points[ray as usize]);
        }
        let (object_rays, points) = (&object_rays[..order.len()], &points[..order.len()]);
        trace_batch(object, object_rays, None, scratch, &mut sink(answers.reborrow(), points));
        // For the same reason the last answers can move first.
        for (i, &ray) in order.iter().enumerate().rev() {
            answers.swap(i, ray as usize);
        }
    } else {
        let order = (ended * FEW_ENDED > rays.len()).then_some(&order[..]);
        trace_batch(object, object_rays, order, scratch, &mut sink(answers, points));
    }
    scratch.starts = prepared;
}
