//! Tracing of one object by batches of rays that start on its triangles: they become rays of the object, with the exact points at which
//! they start.

use super::batch::trace_batch;
use super::scratch::Scratch;
use crate::intersect::start_point::Starts;
use crate::query::sink::Sink;
use crate::query::{Answers, AnswersOf, Any, Goal, Nearest, Query};
use crate::rays::{Hit, StartRay};
use crate::starts::prepare::PreparedStarts;
use bth_format::object::ObjectView;

/// Where at most one in this many rays has ended, all are traced: packets without gaps save more.
const FEW_ENDED: usize = 8;

/// Stores the nearest hits of rays that hit anything, in the space of the instance with the given index, which is world space.
pub(crate) fn nearest_from_starts(
    object: &ObjectView<'_>,
    rays: &[StartRay],
    instance: u32,
    scratch: &mut Scratch,
    hits: &mut [Hit],
) {
    trace::<Nearest>(object, rays, instance, scratch, hits);
}

/// Stores which rays hit anything; parameters as for [`nearest_from_starts`].
pub(crate) fn any_from_starts(
    object: &ObjectView<'_>,
    rays: &[StartRay],
    instance: u32,
    scratch: &mut Scratch,
    found: &mut [bool],
) {
    trace::<Any>(object, rays, instance, scratch, found);
}

fn trace<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[StartRay],
    instance: u32,
    scratch: &mut Scratch,
    mut answers: AnswersOf<'_, Q>,
) {
    let mut prepared = std::mem::take(&mut scratch.starts);
    prepared.fill(object, rays, instance);
    let PreparedStarts { rays: object_rays, points, order } = &mut prepared;
    let ended = rays.len() - order.len();
    if answers.goal().is_any() && ended * FEW_ENDED > rays.len() {
        // Most short rays go in packets, also those that are left. No ray is before its place among those that are left.
        for (i, &ray) in order.iter().enumerate() {
            (object_rays[i], points[i]) = (object_rays[ray as usize], points[ray as usize]);
        }
        let (object_rays, points) = (&object_rays[..order.len()], &points[..order.len()]);
        let sink = Sink::<Q>::new(object.triangle_ids, Q::Goal::reborrow(&mut answers), instance);
        trace_batch(object, object_rays, None, scratch, &mut sink.with_starts(Starts(points)));
        // For the same reason the last answers can move first.
        for (i, &ray) in order.iter().enumerate().rev() {
            answers.swap(i, ray as usize);
        }
    } else {
        let order = (ended * FEW_ENDED > rays.len()).then_some(&order[..]);
        let sink = Sink::<Q>::new(object.triangle_ids, Q::Goal::reborrow(&mut answers), instance);
        trace_batch(object, object_rays, order, scratch, &mut sink.with_starts(Starts(points)));
    }
    scratch.starts = prepared;
}
