//! Rays that start on surfaces.

use crate::{ERROR_ARGUMENT, ERROR_INTERNAL, OK, code_of, defect, fail, null_argument};
use runtime::Scene;
use runtime::rays::{Hit, PrimitiveRef, Start, StartRay};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Number of rays that are traced together.
const CHUNK: usize = 1024;

/// The arguments of a query as slices: starts, directions and, if given, ends of rays.
#[derive(Clone, Copy)]
struct Parts<'a> {
    starts: &'a [Start],
    directions: &'a [[f32; 3]],
    tmax: Option<&'a [f32]>,
}

impl Parts<'_> {
    #[inline(always)]
    fn ray(&self, i: usize) -> StartRay {
        let tmax = self.tmax.map_or(f32::INFINITY, |tmax| tmax[i]);
        // Number by number: an array would be copied once more, and loading it at once stalls.
        let [x, y, z] = self.directions[i];
        let Start { primitive: PrimitiveRef { instance, triangle }, u, v } = self.starts[i];
        let start = Start { primitive: PrimitiveRef { instance, triangle }, u, v };
        StartRay { start, direction: [x, y, z], tmax }
    }

    /// Calls `trace` with the rays of each chunk and the index of the first.
    /// Returns the code of the query.
    fn in_chunks(&self, mut trace: impl FnMut(usize, &[StartRay])) -> i32 {
        let mut rays = Vec::with_capacity(CHUNK.min(self.starts.len()));
        let mut code = OK;
        for first in (0..self.starts.len()).step_by(CHUNK) {
            let count = CHUNK.min(self.starts.len() - first);
            rays.clear();
            rays.extend((first..first + count).map(|i| self.ray(i)));
            // A panic must not unwind into C. It would be a defect of the library.
            // The rays of its chunk are then misses.
            if catch_unwind(AssertUnwindSafe(|| trace(first, &rays))).is_err() {
                code = defect();
            }
        }
        code
    }
}

/// # Safety
/// `scene` is null or open. `starts`, `directions` and `tmax` are each null or point to `count`
/// elements. All of them outlive the result and are not written to during its life.
unsafe fn parts<'a>(
    scene: *const Scene,
    starts: *const Start,
    directions: *const [f32; 3],
    tmax: *const f32,
    count: usize,
) -> Option<(&'a Scene, Parts<'a>)> {
    if scene.is_null() || starts.is_null() || directions.is_null() {
        return None;
    }
    // SAFETY: the pointers are not null, so by contract `scene` is an open scene and the others
    // point to `count` elements. `Start` has the layout of `bth_start`, and all bit patterns are
    // valid for it and for numbers.
    unsafe {
        let starts = std::slice::from_raw_parts(starts, count);
        let directions = std::slice::from_raw_parts(directions, count);
        let tmax = (!tmax.is_null()).then(|| std::slice::from_raw_parts(tmax, count));
        Some((&*scene, Parts { starts, directions, tmax }))
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
    if count == 0 {
        return OK;
    }
    // SAFETY: the contract of this function includes the contract of `parts`.
    let Some((scene, parts)) = (unsafe { parts(scene, starts, directions, tmax, count) }) else {
        return null_argument();
    };
    if hits.is_null() {
        return null_argument();
    }
    // SAFETY: it is not null, so by contract it points to `count` elements, which are valid for
    // writes and do not overlap the slices above. All bit patterns are valid for `Hit`.
    let hits = unsafe { std::slice::from_raw_parts_mut(hits, count) };
    if let [hit] = hits {
        let ray = parts.ray(0);
        let traced =
            catch_unwind(AssertUnwindSafe(|| scene.batch(&[ray]).nearest(std::slice::from_mut(hit))));
        return traced.map_or_else(
            |_| {
                *hit = Hit::MISS;
                defect()
            },
            |()| OK,
        );
    }
    parts.in_chunks(|first, rays| {
        let hits = &mut hits[first..first + rays.len()];
        hits.fill(Hit::MISS);
        scene.batch(rays).nearest(hits);
    })
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
    if count == 0 {
        return OK;
    }
    // SAFETY: the contract of this function includes the contract of `parts`.
    let Some((scene, parts)) = (unsafe { parts(scene, starts, directions, tmax, count) }) else {
        return null_argument();
    };
    if hit.is_null() {
        return null_argument();
    }
    // SAFETY: it is not null, so by contract it points to `count` bytes, which are valid for writes
    // and do not overlap the slices above.
    let hit = unsafe { std::slice::from_raw_parts_mut(hit, count) };
    if let [hit] = hit {
        let (ray, mut found) = (parts.ray(0), [false]);
        let traced = catch_unwind(AssertUnwindSafe(|| scene.batch(&[ray]).any(&mut found)));
        *hit = (traced.is_ok() && found[0]).into();
        return traced.map_or_else(|_| defect(), |()| OK);
    }
    let mut found = [false; CHUNK];
    parts.in_chunks(|first, rays| {
        let (found, hit) = (&mut found[..rays.len()], &mut hit[first..first + rays.len()]);
        hit.fill(0);
        scene.batch(rays).any(found);
        hit.iter_mut().zip(found).for_each(|(hit, found)| *hit = (*found).into());
    })
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
    match catch_unwind(AssertUnwindSafe(|| scene.check_start(start))) {
        Ok(Ok(())) => OK,
        Ok(Err(error)) => fail(code_of(&error), format!("bth_check_start: {error}")),
        Err(_) => fail(ERROR_INTERNAL, "bth_check_start: internal error".into()),
    }
}
