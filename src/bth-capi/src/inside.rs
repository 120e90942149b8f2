//! Crossings of surfaces, and points inside of closed meshes.

use crate::query::Arguments;
use runtime::rays::Ray;
use runtime::{Crossings, Scene};

const _: () = assert!(size_of::<Crossings>() == 8);

/// Crossings of surfaces by rays; see `bth.h`.
///
/// # Safety
/// `scene` is null or open. `rays` and `crossings` are each null or point to `count` elements. The
/// elements of `crossings` are valid for writes and do not overlap the others.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_crossings(
    scene: *const Scene,
    rays: *const Ray,
    crossings: *mut Crossings,
    count: usize,
) -> i32 {
    let arguments = Arguments { scene, asked: rays, answers: crossings, count };
    // SAFETY: the contract of this function includes the contract of `store`.
    unsafe { arguments.store(Crossings::default(), Scene::crossings_batch) }
}

/// Winding numbers of points; see `bth.h`.
///
/// # Safety
/// `scene` is null or open. `at` is null or points to `count` points, and `winding` is null or
/// points to `count` numbers, which are valid for writes and do not overlap the others.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_winding(
    scene: *const Scene,
    at: *const [f32; 3],
    winding: *mut i32,
    count: usize,
) -> i32 {
    // SAFETY: the contract of this function includes the contract of `store`.
    unsafe { Arguments { scene, asked: at, answers: winding, count }.store(0, Scene::winding_batch) }
}

/// Stores which points lie inside; see `bth.h`.
///
/// # Safety
/// The contract of [`bth_winding`], with `inside` for `winding`: it is null or points to `count`
/// bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_contains(
    scene: *const Scene,
    at: *const [f32; 3],
    inside: *mut u8,
    count: usize,
) -> i32 {
    let arguments = Arguments { scene, asked: at, answers: inside, count };
    // SAFETY: the contract of this function includes the contract of `store_as`.
    unsafe { arguments.store_as(false, Scene::contains_batch, u8::from) }
}
