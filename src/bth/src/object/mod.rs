//! Tracing of one object by rays in object space: by one ray or by a batch.

mod batch;
mod scratch;
pub(crate) mod single;

pub(crate) use batch::{MIN_BATCH, trace_batch, trace_starts};
pub(crate) use scratch::{Scratch, with_scratch};

use self::single::{SingleRay, trace};
use crate::query::{AnyHit, Goal, NearestHit, Steps};
use crate::rays::Hit;
use bth_format::object::ObjectView;

/// Nearest hit of a ray in object space; `instance` is reported with a hit.
#[inline(never)]
pub(crate) fn nearest<R: SingleRay>(object: &ObjectView<'_>, ray: &R, instance: u32) -> Hit {
    let mut hit = Hit::MISS;
    store_nearest(object, ray, instance, &mut hit);
    hit
}

/// Like [`nearest`], but stores the hit in `hit`, which avoids a copy.
#[inline(never)]
pub(crate) fn store_nearest<R: SingleRay>(object: &ObjectView<'_>, ray: &R, instance: u32, hit: &mut Hit) {
    trace(object, NearestHit, ray, instance, &mut (), hit);
}

/// Like [`nearest`], with the statistics of the traversal.
pub(crate) fn nearest_counted<R: SingleRay>(object: &ObjectView<'_>, ray: &R, instance: u32) -> (Hit, Steps) {
    let (mut hit, mut steps) = (Hit::MISS, Steps::default());
    trace(object, NearestHit, ray, instance, &mut steps, &mut hit);
    (hit, steps)
}

/// The hit of a ray for a goal with conditions.
#[inline(never)]
pub(crate) fn accepted<G: Goal, R: SingleRay>(
    object: &ObjectView<'_>,
    ray: &R,
    goal: G,
    instance: u32,
) -> Hit {
    let mut hit = Hit::MISS;
    trace(object, goal, ray, instance, &mut (), &mut hit);
    hit
}

/// Returns true if a ray in object space hits anything.
#[inline(never)]
pub(crate) fn any<R: SingleRay>(object: &ObjectView<'_>, ray: &R) -> bool {
    let mut hit = Hit::MISS;
    trace(object, AnyHit, ray, 0, &mut (), &mut hit);
    hit.is_hit()
}
