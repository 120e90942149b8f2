//! Tracing of one object by batches of rays that may start on known triangles: what the hints are used for, and what is traced then.

use super::batch::{by_hint, through_bvh, trace_batch, trace_with};
use super::hints::Hinted;
use super::scratch::Scratch;
use super::strategy::{HintUse, QueryKind, Strategy, size_of};
use super::walked_batch::{has_subtrees, may_gain_by_walks};
use crate::SMALL;
use crate::bvh::interleaved::RemainingRays;
use crate::free::{self, Rest};
use crate::query::sink::Sink;
use crate::query::{Answers, AnswersOf, AnyQuery, Goal, NearestQuery, Query, any_answers, nearest_answers};
use crate::rays::{Hit, PrimitiveRef, Ray};
use crate::simd::{Isa, Kernel, Simd};
use bth_format::layout::NONE;
use bth_format::object::ObjectView;
use std::ops::Range;

/// Where at most one in this many rays has ended, all are traced: packets without gaps save more.
const FEW_ENDED: usize = 8;

/// Computes the nearest hits of rays in object space, through the instance with the given index. `from` holds for each ray where it
/// starts, on this instance or elsewhere; it affects where the search begins, never the result.
pub(crate) fn nearest_batch(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: Option<&[PrimitiveRef]>,
    instance: u32,
    scratch: &mut Scratch,
    hits: &mut [Hit],
) {
    trace_from::<NearestQuery>(object, rays, from, instance, scratch, nearest_answers(hits));
}

/// Computes whether rays in object space hit anything; parameters as for [`nearest_batch`].
pub(crate) fn any_batch(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: Option<&[PrimitiveRef]>,
    instance: u32,
    scratch: &mut Scratch,
    found: &mut [bool],
) {
    trace_from::<AnyQuery>(object, rays, from, instance, scratch, any_answers(found));
}

/// Stores the answers of those rays that hit anything. Rays that leave their triangle in a free direction are not traced, where looking
/// that up was measured to take less time than it saves.
fn trace_from<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: Option<&[PrimitiveRef]>,
    instance: u32,
    scratch: &mut Scratch,
    mut answers: AnswersOf<'_, Q>,
) {
    let trace = |rays: &[Ray], from: Option<&[u32]>, scratch: &mut Scratch, mut answers: AnswersOf<'_, Q>| {
        let answers = Q::Goal::reborrow(&mut answers);
        let mut sink = Sink::<Q>::new(object.triangle_ids, answers, instance);
        trace_batch(object, rays, from, scratch, &mut sink);
    };
    // Only objects with tetrahedra or free directions use hints.
    let has_tets = !object.tet_leaves.is_empty();
    let Some(from) = from.filter(|_| !SMALL && (has_tets || free::is_known(object))) else {
        return trace(rays, None, scratch, answers);
    };
    let is_any = answers.goal().is_any();
    let kind = QueryKind::of(is_any, rays, size_of(object));
    if !free::is_known(object) {
        if !may_walk(object, kind, from, instance) {
            return trace(rays, None, scratch, answers);
        }
        let walk = |range: Range<usize>, scratch: &mut Scratch, mut answers: AnswersOf<'_, Q>| {
            with_hints(&from[range.clone()], instance, scratch, |hints, scratch| {
                let answers = Q::Goal::reborrow(&mut answers);
                let mut sink = Sink::<Q>::new(object.triangle_ids, answers, instance);
                trace_with(object, &rays[range], Some(hints), scratch, &mut sink);
            });
        };
        if !has_subtrees(object) {
            return walk(0..rays.len(), scratch, answers);
        }
        let key = (object.identity, HintUse::Tets.kind(kind));
        return by_hint(key, rays.len(), Strategy::Bvh, scratch, |range, strategy, scratch| {
            let answers = Q::Goal::part(&mut answers, range.clone());
            match strategy {
                Strategy::Bvh => trace(&rays[range], None, scratch, answers),
                Strategy::Hinted => walk(range, scratch, answers),
            }
        });
    }
    // Small batches come before measurements: then the look-up decides by how many of the first rays end.
    let key = (object.identity, HintUse::Free.kind(kind));
    by_hint(key, rays.len(), Strategy::Hinted, scratch, |range, strategy, scratch| {
        let (rays, from) = (&rays[range.clone()], &from[range.clone()]);
        let mut answers = Q::Goal::part(&mut answers, range);
        if strategy == Strategy::Bvh && !has_tets {
            return trace(rays, None, scratch, answers);
        }
        with_hints(from, instance, scratch, |hints, scratch| {
            let mut rest = std::mem::take(&mut scratch.rest);
            if strategy == Strategy::Bvh
                || !free::find_rest(object, rays, hints, Hinted::are_forced(), &mut rest)
            {
                trace(rays, Some(hints), scratch, answers);
            } else if (rays.len() - rest.order.len()) * FEW_ENDED <= rays.len() {
                trace(&rest.rays, None, scratch, answers);
            } else if is_any {
                // Most shorter rays go in packets, also those that are left. Others are faster without moving them.
                trace_gathered::<Q>(object, &mut rest, instance, scratch, answers);
            } else {
                let answers = Q::Goal::reborrow(&mut answers);
                let mut sink = Sink::<Q>::new(object.triangle_ids, answers, instance);
                trace_rest(object, &rest, scratch, &mut sink);
            }
            scratch.rest = rest;
        });
    });
}

/// Whether a batch may be faster if its rays walk through tetrahedra: by the kind of its rays, and by whether those that are sampled
/// start on the instance.
fn may_walk(object: &ObjectView<'_>, kind: QueryKind, from: &[PrimitiveRef], instance: u32) -> bool {
    const SAMPLES: usize = 8;
    let starts = (0..SAMPLES).filter_map(|sample| from.get(sample * from.len() / SAMPLES));
    may_gain_by_walks(object, kind) && starts.into_iter().any(|from| from.triangle_of(instance) != NONE)
}

/// Calls `work` with the triangle of an instance on which each ray starts, or `NONE`.
fn with_hints(
    from: &[PrimitiveRef],
    instance: u32,
    scratch: &mut Scratch,
    work: impl FnOnce(&[u32], &mut Scratch),
) {
    let hints = take_hints(from, instance, scratch);
    work(&hints, scratch);
    scratch.hints = hints;
}

/// The hints of [`with_hints`], in the memory of `scratch`.
#[inline(never)]
fn take_hints(from: &[PrimitiveRef], instance: u32, scratch: &mut Scratch) -> Vec<u32> {
    let mut hints = std::mem::take(&mut scratch.hints);
    hints.resize(from.len(), NONE);
    Isa::chosen().run(TrianglesOf { from, instance, hints: &mut hints });
    hints
}

/// Sets hints to the triangles of an instance on which rays start, or `NONE`.
struct TrianglesOf<'a> {
    from: &'a [PrimitiveRef],
    instance: u32,
    hints: &'a mut [u32],
}

impl Kernel for TrianglesOf<'_> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let TrianglesOf { from, instance, hints } = self;
        // The compiler vectorizes this loop.
        for (hint, from) in hints.iter_mut().zip(from) {
            *hint = from.triangle_of(instance);
        }
    }
}

/// Stores the answers of those of the rays `rest` that hit anything, after moving these rays together. All answers are misses before.
fn trace_gathered<Q: Query>(
    object: &ObjectView<'_>,
    rest: &mut Rest,
    instance: u32,
    scratch: &mut Scratch,
    mut answers: AnswersOf<'_, Q>,
) {
    let Rest { order, rays } = rest;
    // No ray is before its place among those that are left.
    for (i, &ray) in order.iter().enumerate() {
        rays[i] = rays[ray as usize];
    }
    {
        let answers = Q::Goal::reborrow(&mut answers);
        let mut sink = Sink::<Q>::new(object.triangle_ids, answers, instance);
        trace_batch(object, &rays[..order.len()], None, scratch, &mut sink);
    }
    // For the same reason the last answers can move first.
    for (i, &ray) in order.iter().enumerate().rev() {
        answers.swap(i, ray as usize);
    }
}

/// Stores in `sink` the answers of those of the rays `rest` that hit anything.
fn trace_rest<Q: Query>(object: &ObjectView<'_>, rest: &Rest, scratch: &mut Scratch, sink: &mut Sink<'_, Q>) {
    if object.header.root != NONE && !rest.order.is_empty() {
        // Too few rays are left of most packets.
        let remaining = RemainingRays { order: Some(&rest.order), queries: None, walked: None };
        through_bvh(object, &rest.rays, remaining, scratch, sink);
    }
}
