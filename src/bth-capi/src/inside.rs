//! The part of the C interface that counts crossings of surfaces and tells whether points lie inside of closed meshes.

use crate::{OK, batch, defect, null_argument};
use runtime::rays::Ray;
use runtime::{Crossings, Scene};
use std::panic::{AssertUnwindSafe, catch_unwind};

const _: () = assert!(size_of::<Crossings>() == 8);

/// Crossings of surfaces by rays; see `bth.h`.
///
/// # Safety
/// `scene` is null or open. `rays` and `crossings` are each null or point to `count` elements; those of `crossings` are valid for
/// writes and do not overlap the others.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_crossings(
    scene: *const Scene,
    rays: *const Ray,
    crossings: *mut Crossings,
    count: usize,
) -> i32 {
    // SAFETY: the contract of `batch` is part of that of this function.
    let (scene, rays) = match unsafe { batch(scene, rays, count) } {
        Ok(batch) => batch,
        Err(code) => return code,
    };
    if crossings.is_null() {
        return null_argument();
    }
    // SAFETY: it is not null, so by contract it points to `count` elements, which are valid for writes and do not overlap the
    // rays. All bit patterns are valid for `Crossings`.
    let crossings = unsafe { std::slice::from_raw_parts_mut(crossings, count) };
    // A panic must not unwind into C. After a panic, which would be a defect of the library, nothing is crossed.
    let counted = catch_unwind(AssertUnwindSafe(|| scene.crossings_batch(rays, crossings)));
    if counted.is_err() {
        crossings.fill(Crossings::default());
        return defect();
    }
    OK
}

/// The arguments of a query for points: the scene, the points, and for each its result.
type Points<'a, T> = (&'a Scene, &'a [[f32; 3]], &'a mut [T]);

/// The arguments of a query for points as slices. `Err` is the result of the query if there are no points, or a pointer is null.
///
/// # Safety
/// `scene` is null or open. `points` and `results` are each null or point to `count` elements; those of `results` are valid for
/// writes, do not overlap the others, and may have any bits. All of them outlive the result and are used by nothing else during its
/// life.
unsafe fn points<'a, T>(
    scene: *const Scene,
    points: *const [f32; 3],
    results: *mut T,
    count: usize,
) -> Result<Points<'a, T>, i32> {
    if count == 0 {
        return Err(OK);
    }
    if scene.is_null() || points.is_null() || results.is_null() {
        return Err(null_argument());
    }
    // SAFETY: the pointers are not null, so by contract `scene` is an open scene and the others point to `count` elements, of which
    // the results are valid for writes and overlap nothing.
    unsafe {
        let results = std::slice::from_raw_parts_mut(results, count);
        Ok((&*scene, std::slice::from_raw_parts(points, count), results))
    }
}

/// Winding numbers of points; see `bth.h`.
///
/// # Safety
/// `scene` is null or open. `at` is null or points to `count` times three numbers, and `winding` is null or points to `count`
/// numbers, which are valid for writes and do not overlap the others.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_winding(
    scene: *const Scene,
    at: *const [f32; 3],
    winding: *mut i32,
    count: usize,
) -> i32 {
    // SAFETY: the contract of `points` is part of that of this function, and all bit patterns are valid for i32.
    let (scene, at, winding) = match unsafe { points(scene, at, winding, count) } {
        Ok(points) => points,
        Err(code) => return code,
    };
    if catch_unwind(AssertUnwindSafe(|| scene.winding_batch(at, winding))).is_err() {
        winding.fill(0);
        return defect();
    }
    OK
}

/// Points for which [`bth_contains`] asks together.
const CHUNK: usize = 1024;

/// Whether points lie inside; see `bth.h`.
///
/// # Safety
/// As for [`bth_winding`], with `inside` in place of `winding`: it is null or points to `count` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_contains(
    scene: *const Scene,
    at: *const [f32; 3],
    inside: *mut u8,
    count: usize,
) -> i32 {
    // SAFETY: the contract of `points` is part of that of this function, and all bit patterns are valid for u8.
    let (scene, at, inside) = match unsafe { points(scene, at, inside, count) } {
        Ok(points) => points,
        Err(code) => return code,
    };
    let mut code = OK;
    let mut buffer = [0; CHUNK];
    for (at, inside) in at.chunks(CHUNK).zip(inside.chunks_mut(CHUNK)) {
        let winding = &mut buffer[..at.len()];
        if catch_unwind(AssertUnwindSafe(|| scene.winding_batch(at, winding))).is_err() {
            winding.fill(0);
            code = defect();
        }
        for (inside, winding) in inside.iter_mut().zip(winding) {
            *inside = u8::from(*winding != 0);
        }
    }
    code
}
