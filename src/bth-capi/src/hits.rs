//! The part of the C interface that reports several hits and hits under conditions, and that sets masks.

use crate::{ERROR_ARGUMENT, ERROR_INTERNAL, OK, fail};
use runtime::rays::{Hit, Ray};
use runtime::{Accept, Cull, Filter, Scene};
use std::ffi::c_void;
use std::panic::{AssertUnwindSafe, catch_unwind};

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

/// `bth_hit_list` of `bth.h`.
#[derive(Debug)]
#[repr(C)]
pub struct HitList {
    offsets: *mut u64,
    hits: *mut Hit,
    capacity: u64,
    needed: u64,
}

/// A function of the caller that decides about hits, with its argument.
struct CallerFilter {
    function: FilterFunction,
    user: *mut c_void,
}

// SAFETY: the pointer is only passed to the function. By the contract in `bth.h` the function may be called on any thread, and on
// several at the same time.
unsafe impl Sync for CallerFilter {}

impl CallerFilter {
    fn accepts(&self, ray: &Ray, hit: &Hit) -> bool {
        // SAFETY: by the contract in `bth.h` the function may be called with the argument that was given with it and with pointers
        // that are valid during the call.
        unsafe { (self.function)(self.user, ray, hit) != 0 }
    }
}

/// The arguments that queries of this part have in common.
struct Arguments {
    /// Name of the C function, for error messages.
    name: &'static str,
    scene: *const Scene,
    rays: *const Ray,
    /// Null for a query that accepts everything.
    accept: *const AcceptC,
    /// Whether a pointer to results is null.
    no_results: bool,
    count: usize,
}

impl Arguments {
    /// Checks the arguments and calls `query` with them; returns its result, or the code of an error. Nothing is called if there
    /// are no rays.
    ///
    /// # Safety
    /// `scene` is null or open. `rays` is null or points to `count` elements, `accept` is null or points to a valid struct.
    /// They are not written to during the call.
    unsafe fn run(&self, query: impl FnOnce(&Scene, &[Ray], &Accept<'_>)) -> i32 {
        let name = self.name;
        if self.count == 0 {
            return OK;
        }
        // SAFETY: by contract `scene` is null or open, hence valid for reads.
        let Some(scene) = (unsafe { self.scene.as_ref() }) else {
            return fail(ERROR_ARGUMENT, format!("{name}: scene must not be null"));
        };
        if self.rays.is_null() || self.no_results {
            return fail(ERROR_ARGUMENT, format!("{name}: rays and results must not be null"));
        }
        // SAFETY: it is not null, so by contract it points to `count` elements, and all bit patterns are valid for `Ray`.
        let rays = unsafe { std::slice::from_raw_parts(self.rays, self.count) };
        // SAFETY: by contract it is null or points to a valid struct.
        let conditions = unsafe { self.accept.as_ref() };
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
        let accept = Accept { mask, cull, filter: accepts.as_ref().map(|accepts| accepts as &Filter<'_>) };
        // A panic must not unwind into C.
        match catch_unwind(AssertUnwindSafe(|| query(scene, rays, &accept))) {
            Ok(()) => OK,
            Err(_) => fail(ERROR_INTERNAL, format!("{name}: internal error")),
        }
    }
}

/// The nearest hit of each ray that is accepted; see `bth.h`.
///
/// # Safety
/// `scene` is null or open. `rays` and `hits` are null or point to `count` elements; those of `hits` are valid for writes and do not
/// overlap the others. `accept` is null or points to a struct whose filter is null or meets the contract in `bth.h`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_nearest_accepted(
    scene: *const Scene,
    rays: *const Ray,
    accept: *const AcceptC,
    hits: *mut Hit,
    count: usize,
) -> i32 {
    let name = "bth_nearest_accepted";
    let arguments = Arguments { name, scene, rays, accept, no_results: hits.is_null(), count };
    let store = |scene: &Scene, rays: &[Ray], accept: &Accept<'_>| {
        // SAFETY: `run` has checked that it is not null, so by contract it points to as many elements as rays.
        let hits = unsafe { std::slice::from_raw_parts_mut(hits, rays.len()) };
        scene.nearest_accepted_batch(rays, accept, hits);
    };
    // SAFETY: the contract of `run` is part of that of this function.
    unsafe { arguments.run(store) }
}

/// Whether each ray has a hit that is accepted; see `bth.h`.
///
/// # Safety
/// As for [`bth_nearest_accepted`], with `found` in place of `hits`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_any_accepted(
    scene: *const Scene,
    rays: *const Ray,
    accept: *const AcceptC,
    found: *mut u8,
    count: usize,
) -> i32 {
    let arguments =
        Arguments { name: "bth_any_accepted", scene, rays, accept, no_results: found.is_null(), count };
    let store = |scene: &Scene, rays: &[Ray], accept: &Accept<'_>| {
        for (i, ray) in rays.iter().enumerate() {
            // SAFETY: `run` has checked that it is not null, so by contract it points to as many bytes as rays.
            unsafe { found.add(i).write(scene.any_accepted(ray, accept).into()) };
        }
    };
    // SAFETY: the contract of `run` is part of that of this function.
    unsafe { arguments.run(store) }
}

/// Number of hits of each ray that are accepted; see `bth.h`.
///
/// # Safety
/// As for [`bth_nearest_accepted`], with `counts` in place of `hits`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_count_hits(
    scene: *const Scene,
    rays: *const Ray,
    accept: *const AcceptC,
    counts: *mut u64,
    count: usize,
) -> i32 {
    let arguments =
        Arguments { name: "bth_count_hits", scene, rays, accept, no_results: counts.is_null(), count };
    let store = |scene: &Scene, rays: &[Ray], accept: &Accept<'_>| {
        for (i, ray) in rays.iter().enumerate() {
            // SAFETY: `run` has checked that it is not null, so by contract it points to as many numbers as rays.
            unsafe { counts.add(i).write(scene.count_hits(ray, accept) as u64) };
        }
    };
    // SAFETY: the contract of `run` is part of that of this function.
    unsafe { arguments.run(store) }
}

/// All hits of each ray that are accepted, or the nearest of them; see `bth.h`.
///
/// # Safety
/// As for [`bth_nearest_accepted`], with `list` in place of `hits`: it is null or points to a struct whose `offsets` is null or
/// points to `count + 1` numbers, and whose `hits` is null or points to `capacity` elements, all valid for writes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_all_hits(
    scene: *const Scene,
    rays: *const Ray,
    accept: *const AcceptC,
    most: u64,
    list: *mut HitList,
    count: usize,
) -> i32 {
    // SAFETY: by contract it is null or valid for reads and writes.
    let list = unsafe { list.as_mut() };
    if count == 0 {
        if let Some(list) = list {
            list.needed = 0;
            if !list.offsets.is_null() {
                // SAFETY: it is not null, so by contract it points to one number.
                unsafe { list.offsets.write(0) };
            }
        }
        return OK;
    }
    let Some(list) = list else {
        return fail(ERROR_ARGUMENT, "bth_all_hits: list must not be null".into());
    };
    let no_results = list.offsets.is_null() || list.hits.is_null() && list.capacity > 0;
    if no_results {
        return fail(ERROR_ARGUMENT, "bth_all_hits: the arrays of the list must not be null".into());
    }
    let arguments = Arguments { name: "bth_all_hits", scene, rays, accept, no_results, count };
    let most = usize::try_from(most).unwrap_or(usize::MAX);
    let store = |scene: &Scene, rays: &[Ray], accept: &Accept<'_>| {
        let mut hits = Vec::new();
        let mut needed = 0u64;
        // SAFETY: it is not null, so by contract it points to one more number than there are rays.
        let write_offset = |i: usize, offset: u64| unsafe { list.offsets.add(i).write(offset) };
        write_offset(0, 0);
        for (i, ray) in rays.iter().enumerate() {
            if most == usize::MAX {
                scene.all_hits(ray, accept, &mut hits);
            } else {
                scene.nearest_hits(ray, most, accept, &mut hits);
            }
            for hit in &hits {
                if needed < list.capacity {
                    // SAFETY: `hits` is not null, because `capacity` is greater than 0, so by contract it points to `capacity`
                    // elements.
                    unsafe { list.hits.add(needed as usize).write(*hit) };
                }
                needed += 1;
            }
            write_offset(i + 1, needed);
        }
        list.needed = needed;
    };
    // SAFETY: the contract of `run` is part of that of this function.
    unsafe { arguments.run(store) }
}

/// Sets the mask of an instance; see `bth.h`.
///
/// # Safety
/// `scene` is null or open, and no other call uses it at the same time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_set_instance_mask(scene: *mut Scene, instance: u32, mask: u32) -> i32 {
    // SAFETY: by contract it is null or open, and not used by another call at the same time.
    let Some(scene) = (unsafe { scene.as_mut() }) else {
        return fail(ERROR_ARGUMENT, "bth_set_instance_mask: scene must not be null".into());
    };
    let count = scene.instance_count();
    if instance >= count {
        let text = format!("bth_set_instance_mask: expected an instance below {count}, found {instance}");
        return fail(ERROR_ARGUMENT, text);
    }
    scene.set_instance_mask(instance, mask);
    OK
}

/// Sets the mask of a group of triangles; see `bth.h`.
///
/// # Safety
/// As for [`bth_set_instance_mask`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_set_group_mask(scene: *mut Scene, object: u32, group: u32, mask: u32) -> i32 {
    // SAFETY: by contract it is null or open, and not used by another call at the same time.
    let Some(scene) = (unsafe { scene.as_mut() }) else {
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
