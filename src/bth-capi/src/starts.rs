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
    /// `none`.
    ///
    /// # Safety
    /// The arguments are as in [`StartArguments`]. `answers` is null or points to `count` elements,
    /// which are valid for writes and do not overlap the others. All bit patterns are valid for
    /// them.
    unsafe fn store<T: Copy, A>(
        self,
        answers: *mut A,
        none: T,
        mut query: impl FnMut(&Scene, &[StartRay], &mut [T]),
        in_c: impl Fn(T) -> A,
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
        if let [answer] = answers {
            let mut found = [none];
            let code = guarded(|| query(scene, &[ray(0)], &mut found));
            *answer = in_c(if code.is_ok() { found[0] } else { none });
            return code.unwrap_or_else(|code| code);
        }
        let (mut rays, mut buffer) = (Vec::with_capacity(CHUNK.min(count)), vec![none; CHUNK.min(count)]);
        let mut code = OK;
        for (first, answers) in (0..count).step_by(CHUNK).zip(answers.chunks_mut(CHUNK)) {
            rays.clear();
            rays.extend((first..first + answers.len()).map(ray));
            let found = &mut buffer[..rays.len()];
            if let Err(failed) = guarded(|| query(scene, &rays, found)) {
                code = failed;
                found.fill(none);
            }
            answers.iter_mut().zip(found).for_each(|(answer, found)| *answer = in_c(*found));
        }
        code
    }
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
    let query = |scene: &Scene, rays: &[StartRay], hits: &mut [Hit]| scene.batch(rays).nearest(hits);
    // SAFETY: the contract of this function includes the contract of `store`.
    unsafe { arguments.store(hits, Hit::MISS, query, |hit| hit) }
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
    let query = |scene: &Scene, rays: &[StartRay], found: &mut [bool]| scene.batch(rays).any(found);
    // SAFETY: the contract of this function includes the contract of `store`.
    unsafe { arguments.store(hit, false, query, u8::from) }
}

/// Checks that rays can start at a point; see `bth.h`.
///
/// # Safety
/// `scene` is null or open. `start` is null or valid for reads.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_check_start(scene: *const Scene, start: *const Start) -> i32 {
    // SAFETY: by contract each is null or valid for reads. `Start` has the layout of `bth_start`,
    // and all bit patterns are valid for it.
    let (Some(scene), Some(start)) = (unsafe { (scene.as_ref(), start.as_ref()) }) else {
        return fail(ERROR_ARGUMENT, "bth_check_start: scene and start must not be null".into());
    };
    attempt("bth_check_start", || scene.check_start(start)).map_or_else(|code| code, |()| OK)
}
