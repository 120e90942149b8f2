//! Tracing of one object by rays in object space, through its BVH and its tetrahedra: by one ray or by a batch.

mod batch;
mod scratch;
pub(crate) mod single;
pub(crate) mod starts;
mod walked_batch;

pub(crate) use batch::{MIN_BATCH, any_batch, fill_misses, nearest_batch, trace_batch};
pub(crate) use scratch::{Scratch, with_scratch};

use self::single::{SingleRay, trace};
use crate::query::{Answer, Any, AnyHit, Nearest, NearestHit, Steps};
use crate::rays::Hit;
use bth_format::object::ObjectView;

/// Nearest hit of a ray in object space; `instance` is reported with a hit.
#[inline(never)]
pub(crate) fn nearest<R: SingleRay>(object: &ObjectView<'_>, ray: &R, instance: u32) -> Hit {
    let mut hit = Hit::MISS;
    store_nearest(object, ray, instance, &mut hit);
    hit
}

/// As [`nearest`], but stores the hit in `hit`, which avoids a copy.
#[inline(never)]
pub(crate) fn store_nearest<R: SingleRay>(object: &ObjectView<'_>, ray: &R, instance: u32, hit: &mut Hit) {
    trace::<Nearest, (), R>((object, NearestHit), ray, instance, &mut (), hit);
}

/// As [`nearest`], with the statistics of the traversal.
pub(crate) fn nearest_counted<R: SingleRay>(object: &ObjectView<'_>, ray: &R, instance: u32) -> (Hit, Steps) {
    let (mut hit, mut steps) = (Hit::MISS, Steps::default());
    trace::<Nearest, Steps, R>((object, NearestHit), ray, instance, &mut steps, &mut hit);
    (hit, steps)
}

/// Whether a ray in object space hits anything.
#[inline(never)]
pub(crate) fn any<R: SingleRay>(object: &ObjectView<'_>, ray: &R) -> bool {
    let mut found = Answer::MISS;
    trace::<Any, (), R>((object, AnyHit), ray, 0, &mut (), &mut found);
    Answer::is_hit(&found)
}
