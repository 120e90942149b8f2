//! The part of the C interface that reports several hits, hits under conditions and crossings, in
//! float and double, and that sets masks.

use crate::query::{Arguments, CHUNK, queries};
use crate::surface::{check_triangle, store};
use crate::{ERROR_ARGUMENT, OK, Out, fail};
use runtime::rays::{Hit, Hit64, Ray, Ray64};
use runtime::{Accept, Crossings, Cull, Filter, Scene, TraceRay};
use std::ffi::c_void;

const _: () = assert!(size_of::<Crossings>() == 8);

/// `bth_filter` of `bth.h`.
type FilterFunction = unsafe extern "C" fn(user: *mut c_void, ray: *const Ray, hit: *const Hit) -> i32;

/// `bth_accept` of `bth.h`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct AcceptC {
    mask: u32,
    cull: u32,
    filter: Option<FilterFunction>,
    user: *mut c_void,
}

/// `bth_hit_list` and `bth_hit64_list` of `bth.h`.
#[derive(Debug)]
#[repr(C)]
pub struct HitList<H> {
    offsets: *mut u64,
    hits: *mut H,
    capacity: u64,
    needed: u64,
}

/// A ray of C, and the hits that answer it.
trait CallerRay: TraceRay {
    /// A hit in C.
    type Hit: Copy;
    /// No hit.
    const MISS: Self::Hit;
    /// The answer for a hit or a miss of this ray.
    fn answer(&self, scene: &Scene, hit: &Hit) -> Self::Hit;
    /// Stores the nearest hit of each ray that is accepted.
    fn nearest(scene: &Scene, rays: &[Self], accept: &Accept<'_>, hits: &mut [Self::Hit]);
}

impl CallerRay for Ray {
    type Hit = Hit;
    const MISS: Hit = Hit::MISS;

    fn answer(&self, _scene: &Scene, hit: &Hit) -> Hit {
        *hit
    }

    fn nearest(scene: &Scene, rays: &[Ray], accept: &Accept<'_>, hits: &mut [Hit]) {
        scene.nearest_accepted_batch(rays, accept, hits);
    }
}

impl CallerRay for Ray64 {
    type Hit = Hit64;
    const MISS: Hit64 = Hit64::MISS;

    fn answer(&self, scene: &Scene, hit: &Hit) -> Hit64 {
        scene.hit_f64(self, hit)
    }

    fn nearest(scene: &Scene, rays: &[Ray64], accept: &Accept<'_>, hits: &mut [Hit64]) {
        let mut buffer = [Hit::MISS; CHUNK];
        for (rays, hits) in rays.chunks(CHUNK).zip(hits.chunks_mut(CHUNK)) {
            let found = &mut buffer[..rays.len()];
            scene.nearest_accepted_batch(rays, accept, found);
            for ((ray, found), hit) in rays.iter().zip(found).zip(hits) {
                *hit = ray.answer(scene, found);
            }
        }
    }
}

/// A function of the caller that decides about hits, with its argument.
struct CallerFilter {
    function: FilterFunction,
    user: *mut c_void,
}

// SAFETY: the pointer is only passed to the function. By the contract in `bth.h` the function may
// be called on any thread, and on several at the same time.
unsafe impl Sync for CallerFilter {}

impl CallerFilter {
    fn accepts(&self, ray: &Ray, hit: &Hit) -> bool {
        // SAFETY: by the contract in `bth.h` the function may be called with the argument that was
        // given with it and with pointers that are valid during the call.
        unsafe { (self.function)(self.user, ray, hit) != 0 }
    }
}

/// Calls `query` with what rays may hit. Returns its result, or the code of an error. Nothing is
/// called without rays.
///
/// # Safety
/// `accept` is null, for a query that accepts everything, or points to a valid struct that is not
/// written to during the call.
unsafe fn with_accept(
    name: &str,
    accept: *const AcceptC,
    count: usize,
    query: impl FnOnce(&Accept<'_>) -> i32,
) -> i32 {
    if count == 0 {
        return OK;
    }
    // SAFETY: by contract it is null or points to a valid struct.
    let conditions = unsafe { accept.as_ref() };
    let (mask, cull) = conditions.map_or((u32::MAX, 0), |accept| (accept.mask, accept.cull));
    let cull = match cull {
        0 => Cull::None,
        1 => Cull::Back,
        2 => Cull::Front,
        _ => return fail(ERROR_ARGUMENT, format!("{name}: expected a cull of 0, 1 or 2, found {cull}")),
    };
    let filter =
        conditions.and_then(|accept| Some(CallerFilter { function: accept.filter?, user: accept.user }));
    let accepts = filter.as_ref().map(|filter| move |ray: &Ray, hit: &Hit| filter.accepts(ray, hit));
    query(&Accept { mask, cull, filter: accepts.as_ref().map(|accepts| accepts as &Filter<'_>) })
}

/// Stores the nearest hit of each ray that is accepted; returns a code. `name` is the name of the C
/// function, for error messages.
///
/// # Safety
/// The arguments are as in [`Arguments`]. `accept` is null or points to a struct whose filter is
/// null or keeps the contract in `bth.h`.
unsafe fn nearest<R: CallerRay>(name: &str, arguments: Arguments<R, R::Hit>, accept: *const AcceptC) -> i32 {
    // SAFETY: the contract of this function includes the contracts of `with_accept` and `store`.
    unsafe {
        with_accept(name, accept, arguments.count, |accept| {
            arguments.store(R::MISS, |scene, rays, hits| R::nearest(scene, rays, accept, hits))
        })
    }
}

/// Stores which rays have a hit that is accepted, like [`nearest`].
///
/// # Safety
/// The contract of [`nearest`].
unsafe fn any<R: CallerRay>(name: &str, arguments: Arguments<R, u8>, accept: *const AcceptC) -> i32 {
    // SAFETY: the contract of this function includes the contracts of `with_accept` and `store_as`.
    unsafe {
        with_accept(name, accept, arguments.count, |accept| {
            let query = |scene: &Scene, rays: &[R], found: &mut [bool]| {
                scene.any_accepted_batch(rays, accept, found);
            };
            arguments.store_as(false, query, u8::from)
        })
    }
}

/// Stores the number of hits of each ray that are accepted, like [`nearest`].
///
/// # Safety
/// The contract of [`nearest`].
unsafe fn count<R: CallerRay>(name: &str, arguments: Arguments<R, u64>, accept: *const AcceptC) -> i32 {
    // SAFETY: the contract of this function includes the contracts of `with_accept` and `store_as`.
    unsafe {
        with_accept(name, accept, arguments.count, |accept| {
            let query = |scene: &Scene, rays: &[R], counts: &mut [usize]| {
                scene.count_hits_batch(rays, accept, counts);
            };
            arguments.store_as(0, query, |count| count as u64)
        })
    }
}

/// Stores the `most` nearest hits of each ray that are accepted, like [`nearest`].
///
/// # Safety
/// The contract of [`nearest`], but for the answers: they are null or point to one struct whose
/// `offsets` is null or points to one more number than there are rays, and whose `hits` is null or
/// points to `capacity` elements, all valid for writes.
unsafe fn all<R: CallerRay>(
    name: &str,
    arguments: Arguments<R, HitList<R::Hit>>,
    accept: *const AcceptC,
    most: u64,
) -> i32 {
    let Arguments { scene, asked, answers, count } = arguments;
    // SAFETY: by contract it is null or valid for reads and writes.
    let list = match unsafe { answers.as_mut() } {
        Some(list) => list,
        None if count == 0 => return OK,
        None => return fail(ERROR_ARGUMENT, format!("{name}: list must not be null")),
    };
    let no_offsets = list.offsets.is_null() && count > 0;
    if no_offsets || (list.hits.is_null() && list.capacity > 0 && count > 0) {
        return fail(ERROR_ARGUMENT, format!("{name}: the arrays of the list must not be null"));
    }
    list.needed = 0;
    if !list.offsets.is_null() {
        // SAFETY: it is not null, so by contract it points to one more number than there are rays.
        unsafe { list.offsets.write(0) };
    }
    // The first offset is 0; the others are the answers.
    let arguments = Arguments { scene, asked, answers: list.offsets.wrapping_add(1), count };
    let most = usize::try_from(most).unwrap_or(usize::MAX);
    let mut store = |scene: &Scene, rays: &[R], accept: &Accept<'_>, offsets: &mut [u64]| {
        let mut hits = Vec::new();
        let mut needed = 0u64;
        for (ray, offset) in rays.iter().zip(offsets) {
            if most == usize::MAX {
                scene.all_hits(ray, accept, &mut hits);
            } else {
                scene.nearest_hits(ray, most, accept, &mut hits);
            }
            for hit in &hits {
                if needed < list.capacity {
                    // SAFETY: `hits` is not null, because `capacity` is greater than 0, so by
                    // contract it points to `capacity` elements.
                    unsafe { list.hits.add(needed as usize).write(ray.answer(scene, hit)) };
                }
                needed += 1;
            }
            *offset = needed;
        }
        list.needed = needed;
    };
    // SAFETY: the contract of this function includes the contracts of `with_accept` and `store`.
    // After its first number `offsets` has one for each ray.
    unsafe {
        with_accept(name, accept, count, |accept| {
            arguments.store(0, |scene, rays, offsets| store(scene, rays, accept, offsets))
        })
    }
}

queries! {
    /// The nearest hit of each ray that is accepted; see `bth.h`.
    fn bth_nearest_accepted(Ray, accept: *const AcceptC) -> Hit =
        |arguments| nearest("bth_nearest_accepted", arguments, accept);
    /// The same in double.
    fn bth_nearest_f64(Ray64, accept: *const AcceptC) -> Hit64 =
        |arguments| nearest("bth_nearest_f64", arguments, accept);
    /// Stores which rays have a hit that is accepted; see `bth.h`.
    fn bth_any_accepted(Ray, accept: *const AcceptC) -> u8 =
        |arguments| any("bth_any_accepted", arguments, accept);
    /// The same in double.
    fn bth_any_f64(Ray64, accept: *const AcceptC) -> u8 = |arguments| any("bth_any_f64", arguments, accept);
    /// Number of hits of each ray that are accepted; see `bth.h`.
    fn bth_count_hits(Ray, accept: *const AcceptC) -> u64 =
        |arguments| self::count("bth_count_hits", arguments, accept);
    /// The same in double.
    fn bth_count_hits_f64(Ray64, accept: *const AcceptC) -> u64 =
        |arguments| self::count("bth_count_hits_f64", arguments, accept);
    /// All hits of each ray that are accepted, or the nearest of them; see `bth.h`.
    fn bth_all_hits(Ray, accept: *const AcceptC, most: u64) -> HitList<Hit> =
        |arguments| all("bth_all_hits", arguments, accept, most);
    /// The same in double.
    fn bth_all_hits_f64(Ray64, accept: *const AcceptC, most: u64) -> HitList<Hit64> =
        |arguments| all("bth_all_hits_f64", arguments, accept, most);
    /// Crossings of surfaces by rays; see `bth.h`.
    fn bth_crossings(Ray) -> Crossings = |rays| rays.store(Crossings::default(), Scene::crossings_batch);
    /// The same in double.
    fn bth_crossings_f64(Ray64) -> Crossings = |rays| rays.store(Crossings::default(), Scene::crossings_batch);
}

/// The numbers of a hit; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_hit_f64(
    scene: Option<&Scene>,
    ray: Option<&Ray64>,
    hit: Option<&Hit>,
    numbers: Out<'_, Hit64>,
) -> i32 {
    let (Some(ray), Some(hit)) = (ray, hit) else {
        return fail(ERROR_ARGUMENT, "bth_hit_f64: ray and hit must not be null".into());
    };
    store("bth_hit_f64", scene, numbers, |scene| {
        if hit.is_hit() {
            check_triangle(scene, hit.primitive)?;
            let instance = hit.primitive.instance;
            if !scene.instance(instance).visible {
                return Err((ERROR_ARGUMENT, format!("instance {instance} is hidden")));
            }
        }
        Ok(scene.hit_f64(ray, hit))
    })
}

/// Sets the mask of an instance; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_set_instance_mask(scene: Option<&mut Scene>, instance: u32, mask: u32) -> i32 {
    let Some(scene) = scene else {
        return fail(ERROR_ARGUMENT, "bth_set_instance_mask: scene must not be null".into());
    };
    let count = scene.row_count();
    if instance >= count {
        let text = format!("bth_set_instance_mask: expected an instance below {count}, found {instance}");
        return fail(ERROR_ARGUMENT, text);
    }
    scene.set_instance_mask(instance, mask);
    OK
}

/// Sets the mask of a group of triangles; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_set_group_mask(scene: Option<&mut Scene>, object: u32, group: u32, mask: u32) -> i32 {
    let Some(scene) = scene else {
        return fail(ERROR_ARGUMENT, "bth_set_group_mask: scene must not be null".into());
    };
    let objects = scene.object_count();
    if object >= objects {
        let text = format!("bth_set_group_mask: expected an object below {objects}, found {object}");
        return fail(ERROR_ARGUMENT, text);
    }
    let groups = scene.group_count(object);
    if group >= groups {
        let text = format!("bth_set_group_mask: expected a group below {groups}, found {group}");
        return fail(ERROR_ARGUMENT, text);
    }
    scene.set_group_mask(object, group, mask);
    OK
}
