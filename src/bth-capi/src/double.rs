//! Rays of double precision.

use crate::hits::{self, AcceptC, HitList};
use crate::query::Arguments;
use crate::surface::{check_triangle, store};
use crate::{ERROR_ARGUMENT, fail};
use runtime::rays::{Hit, Hit64, Ray64};
use runtime::{Crossings, Scene};

/// Nearest hits; see `bth.h`.
///
/// # Safety
/// `scene` is null or open. `rays` and `hits` are null or point to `count` elements. The elements
/// of `hits` are valid for writes and do not overlap the others. `accept` is null or points to a
/// struct whose filter is null or keeps the contract in `bth.h`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_nearest_f64(
    scene: *const Scene,
    rays: *const Ray64,
    accept: *const AcceptC,
    hits: *mut Hit64,
    count: usize,
) -> i32 {
    let arguments = Arguments { scene, asked: rays, answers: hits, count };
    // SAFETY: the contract is the same. `Ray64` and `Hit64` have the layout of the C structs.
    unsafe { hits::nearest("bth_nearest_f64", arguments, accept) }
}

/// Stores which rays hit anything; see `bth.h`.
///
/// # Safety
/// The contract of [`bth_nearest_f64`], with `found` for `hits`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_any_f64(
    scene: *const Scene,
    rays: *const Ray64,
    accept: *const AcceptC,
    found: *mut u8,
    count: usize,
) -> i32 {
    let arguments = Arguments { scene, asked: rays, answers: found, count };
    // SAFETY: the contract is the same.
    unsafe { hits::any("bth_any_f64", arguments, accept) }
}

/// Number of hits of each ray; see `bth.h`.
///
/// # Safety
/// The contract of [`bth_nearest_f64`], with `counts` for `hits`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_count_hits_f64(
    scene: *const Scene,
    rays: *const Ray64,
    accept: *const AcceptC,
    counts: *mut u64,
    count: usize,
) -> i32 {
    let arguments = Arguments { scene, asked: rays, answers: counts, count };
    // SAFETY: the contract is the same.
    unsafe { hits::count("bth_count_hits_f64", arguments, accept) }
}

/// All hits of each ray, or the nearest of them; see `bth.h`.
///
/// # Safety
/// The contract of [`bth_nearest_f64`], with `list` for `hits`: it is null or points to a struct
/// whose `offsets` is null or points to `count + 1` numbers, and whose `hits` is null or points to
/// `capacity` elements, all valid for writes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_all_hits_f64(
    scene: *const Scene,
    rays: *const Ray64,
    accept: *const AcceptC,
    most: u64,
    list: *mut HitList<Hit64>,
    count: usize,
) -> i32 {
    let arguments = Arguments { scene, asked: rays, answers: std::ptr::null_mut(), count };
    // SAFETY: the contract is the same.
    unsafe { hits::all("bth_all_hits_f64", arguments, accept, most, list) }
}

/// The numbers of a hit; see `bth.h`.
///
/// # Safety
/// `scene` is null or open. `ray` and `hit` are null or valid for reads. `numbers` is null or valid
/// for writes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_hit_f64(
    scene: *const Scene,
    ray: *const Ray64,
    hit: *const Hit,
    numbers: *mut Hit64,
) -> i32 {
    // SAFETY: by contract both are null, and then rejected, or valid for reads.
    let (Some(ray), Some(hit)) = (unsafe { (ray.as_ref(), hit.as_ref()) }) else {
        return fail(ERROR_ARGUMENT, "bth_hit_f64: ray and hit must not be null".into());
    };
    let find = |scene: &Scene| {
        if hit.is_hit() {
            check_triangle(scene, hit.primitive)?;
            let instance = hit.primitive.instance;
            if !scene.instance(instance).visible {
                return Err((ERROR_ARGUMENT, format!("instance {instance} is hidden")));
            }
        }
        Ok(scene.hit_f64(ray, hit))
    };
    // SAFETY: the contract of this function includes the contract of `store`.
    unsafe { store("bth_hit_f64", scene, numbers, find) }
}

/// Crossings of surfaces by rays; see `bth.h`.
///
/// # Safety
/// The contract of [`bth_nearest_f64`], with `crossings` for `hits`, and without `accept`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_crossings_f64(
    scene: *const Scene,
    rays: *const Ray64,
    crossings: *mut Crossings,
    count: usize,
) -> i32 {
    let arguments = Arguments { scene, asked: rays, answers: crossings, count };
    // SAFETY: the contract of this function includes the contract of `store`.
    unsafe { arguments.store(Crossings::default(), Scene::crossings_batch) }
}
