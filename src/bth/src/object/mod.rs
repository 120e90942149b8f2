//! Tracing of one object by rays in object space, through its BVH and its tetrahedra: by one ray or by a batch.

mod batch;
mod hinted_batch;
pub(crate) mod hints;
mod scratch;
pub(crate) mod single;
mod strategy;
mod walked_batch;

pub(crate) use batch::{MIN_BATCH, by_hint, fill_misses, trace_batch};
pub(crate) use hinted_batch::{any_batch, nearest_batch};
pub use hints::Hinted;
pub(crate) use scratch::{Scratch, with_scratch};
pub(crate) use strategy::{HintUse, QueryKind, Strategy};

use self::single::trace;
use crate::query::{ANY, Answer, AnyQuery, NEAREST, NearestQuery, Steps, Uncounted};
use crate::rays::{Hit, Ray};
use bth_format::object::ObjectView;

/// Nearest hit of a ray in object space; `from` is the triangle on which it starts, or `NONE`, and `instance` is reported with a
/// hit.
#[inline(never)]
pub(crate) fn nearest(object: &ObjectView<'_>, ray: &Ray, from: u32, instance: u32) -> Hit {
    let mut hit = Hit::MISS;
    store_nearest(object, ray, from, instance, &mut hit);
    hit
}

/// As [`nearest`], but stores the hit in `hit`, which avoids a copy.
#[inline(never)]
pub(crate) fn store_nearest(object: &ObjectView<'_>, ray: &Ray, from: u32, instance: u32, hit: &mut Hit) {
    trace::<NearestQuery, Uncounted>((object, NEAREST), ray, from, instance, &mut Uncounted::default(), hit);
}

/// As [`nearest`], with the statistics of the traversal.
pub(crate) fn nearest_counted(object: &ObjectView<'_>, ray: &Ray, from: u32, instance: u32) -> (Hit, Steps) {
    let (mut hit, mut steps) = (Hit::MISS, Steps::default());
    trace::<NearestQuery, Steps>((object, NEAREST), ray, from, instance, &mut steps, &mut hit);
    (hit, steps)
}

/// Whether a ray in object space hits anything; `from` as for [`nearest`].
#[inline(never)]
pub(crate) fn any(object: &ObjectView<'_>, ray: &Ray, from: u32) -> bool {
    let mut found = Answer::MISS;
    trace::<AnyQuery, Uncounted>((object, ANY), ray, from, 0, &mut Uncounted::default(), &mut found);
    Answer::is_hit(&found)
}
