//! Rays that start on surfaces.

use crate::query::{CHUNK, attempt, guarded};
use crate::{ERROR_ARGUMENT, OK, fail, null_argument};
use runtime::Scene;
use runtime::rays::{Hit, PrimitiveRef, Start, StartRay};

/// The arguments of a query by rays that start on surfaces.
///
/// `scene` is null or open. The others are each null or point to `count` elements. Nobody writes to
/// any of them during the call.
struct StartArguments {
    scene: *const Scene,
    starts: *const Start,
    directions: *const [f32; 3],
    /// Ends of the rays; null if they have none.
    tmax: *const f32,
    count: usize,
}

impl StartArguments {
    /// Stores the answers of a query; returns its code. After a panic the answers of a chunk are
    /// `none`. The query gets at most [`CHUNK`] rays, and stores their answers in place.
    ///
    /// # Safety
    /// The arguments are as in [`StartArguments`]. `answers` is null or points to `count` elements,
    /// which are valid for writes and do not overlap the others. All bit patterns are valid for
    /// them.
    #[inline(always)]
    unsafe fn store<A: Copy>(
        self,
        answers: *mut A,
        none: A,
        query: impl Fn(&Scene, &[StartRay], &mut [A]),
    ) -> i32 {
        let StartArguments { scene, starts, directions, tmax, count } = self;
        if count == 0 {
            return OK;
        }
        if scene.is_null() || starts.is_null() || directions.is_null() || answers.is_null() {
            return null_argument();
        }
        // SAFETY: the pointers are not null, so by contract `scene` is an open scene and the others
        // point to `count` elements. `Start` has the layout of `bth_start`, and all bit patterns
        // are valid for it and for numbers. The elements of `answers` are valid for writes and
        // overlap nothing.
        let (scene, starts, directions, tmax, answers) = unsafe {
            let tmax = (!tmax.is_null()).then(|| std::slice::from_raw_parts(tmax, count));
            let starts = std::slice::from_raw_parts(starts, count);
            let directions = std::slice::from_raw_parts(directions, count);
            (&*scene, starts, directions, tmax, std::slice::from_raw_parts_mut(answers, count))
        };
        let ray = |i: usize| {
            let tmax = tmax.map_or(f32::INFINITY, |tmax| tmax[i]);
            // Number by number: an array would be copied once more, and loading it at once stalls.
            let [x, y, z] = directions[i];
            let Start { primitive: PrimitiveRef { instance, triangle }, u, v } = starts[i];
            let start = Start { primitive: PrimitiveRef { instance, triangle }, u, v };
            StartRay { start, direction: [x, y, z], tmax }
        };
        // With nothing but the kernel behind it, no registers are saved for what only batches need.
        if count == 1 {
            let rays = [ray(0)];
            return guarded(|| query(scene, &rays, answers)).unwrap_or_else(|code| {
                answers.fill(none);
                code
            });
        }
        in_chunks(answers, none, ray, |rays, answers| query(scene, rays, answers))
    }
}

/// Stores the answers of a query for the rays of each chunk; returns its code.
#[inline(never)]
fn in_chunks<A: Copy>(
    answers: &mut [A],
    none: A,
    ray: impl Fn(usize) -> StartRay,
    query: impl Fn(&[StartRay], &mut [A]),
) -> i32 {
    let (mut rays, mut code) = (Vec::with_capacity(CHUNK.min(answers.len())), OK);
    for (first, answers) in answers.chunks_mut(CHUNK).enumerate() {
        let first = first * CHUNK;
        rays.clear();
        rays.extend((first..first + answers.len()).map(&ray));
        if let Err(failed) = guarded(|| query(&rays, answers)) {
            code = failed;
            answers.fill(none);
        }
    }
    code
}

/// Nearest hits of rays that start on surfaces; see `bth.h`.
///
/// # Safety
/// `scene` is null or open. `starts`, `directions`, `tmax` and `hits` are each null or point to
/// `count` elements. The elements of `hits` are valid for writes and do not overlap the others.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_nearest_starts(
    scene: *const Scene,
    starts: *const Start,
    directions: *const [f32; 3],
    tmax: *const f32,
    hits: *mut Hit,
    count: usize,
) -> i32 {
    let arguments = StartArguments { scene, starts, directions, tmax, count };
    // SAFETY: the contract of this function includes the contract of `store`.
    unsafe { arguments.store(hits, Hit::MISS, |scene, rays, hits| scene.batch(rays).nearest(hits)) }
}

/// Stores which rays that start on surfaces hit anything; see `bth.h`.
///
/// # Safety
/// The contract of [`bth_nearest_starts`], with `hit` for `hits`: it is null or points to `count`
/// bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_any_starts(
    scene: *const Scene,
    starts: *const Start,
    directions: *const [f32; 3],
    tmax: *const f32,
    hit: *mut u8,
    count: usize,
) -> i32 {
    let arguments = StartArguments { scene, starts, directions, tmax, count };
    let query = |scene: &Scene, rays: &[StartRay], hit: &mut [u8]| {
        if let ([ray], [hit]) = (rays, &mut *hit) {
            *hit = scene.any(ray).into();
            return;
        }
        let mut found = [false; CHUNK];
        scene.batch(rays).any(&mut found[..rays.len()]);
        hit.iter_mut().zip(found).for_each(|(hit, found)| *hit = found.into());
    };
    // SAFETY: the contract of this function includes the contract of `store`.
    unsafe { arguments.store(hit, 0, query) }
}

/// Checks that rays can start at a point; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_check_start(scene: Option<&Scene>, start: Option<&Start>) -> i32 {
    let (Some(scene), Some(start)) = (scene, start) else {
        return fail(ERROR_ARGUMENT, "bth_check_start: scene and start must not be null".into());
    };
    attempt("bth_check_start", || scene.check_start(start)).map_or_else(|code| code, |()| OK)
}
