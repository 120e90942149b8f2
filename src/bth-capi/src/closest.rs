//! Closest points, and triangles in boxes and balls.

use crate::query::Arguments;
use crate::{ERROR_ARGUMENT, ERROR_INTERNAL, OK, fail};
use runtime::Scene;
use runtime::rays::PrimitiveRef;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr;

/// `bth_closest` of `bth.h`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Closest {
    distance: f32,
    point: [f32; 3],
    u: f32,
    v: f32,
    primitive: PrimitiveRef,
    feature: u32,
}

const _: () = assert!(size_of::<Closest>() == 36);

impl Closest {
    const NONE: Closest = Closest {
        distance: f32::INFINITY,
        point: [0.0; 3],
        u: 0.0,
        v: 0.0,
        primitive: PrimitiveRef::NONE,
        feature: 0,
    };

    fn new(closest: Option<runtime::Closest>) -> Closest {
        closest.map_or(Closest::NONE, |c| Closest {
            distance: c.distance,
            point: c.point,
            u: c.u,
            v: c.v,
            primitive: c.primitive,
            feature: c.feature.code(),
        })
    }
}

/// Closest points; see `bth.h`.
///
/// # Safety
/// `scene` is null or open. `points` and `closest` are each null or point to `count` elements. The
/// elements of `closest` are valid for writes and do not overlap the others.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_closest_points(
    scene: *const Scene,
    points: *const [f32; 3],
    radius: f32,
    closest: *mut Closest,
    count: usize,
) -> i32 {
    let arguments = Arguments { scene, asked: points, answers: closest, count };
    // SAFETY: the contract of this function includes the contract of `store_as`.
    unsafe {
        arguments.store_as(
            None,
            |scene, points, found| scene.closest_batch(points, radius, found),
            Closest::new,
        )
    }
}

/// Signed distances; see `bth.h`.
///
/// # Safety
/// The contract of [`bth_closest_points`], with `distances` for `closest`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_signed_distances(
    scene: *const Scene,
    points: *const [f32; 3],
    distances: *mut f32,
    count: usize,
) -> i32 {
    let arguments = Arguments { scene, asked: points, answers: distances, count };
    // SAFETY: the contract of this function includes the contract of `store`.
    unsafe { arguments.store(f32::NAN, Scene::signed_distance_batch) }
}

/// Stores triangles that a query finds; see `bth.h`.
///
/// # Safety
/// `scene` is null or open, `triangles` is null or valid for writes of `capacity` elements, and
/// `count` is null or valid for writes.
unsafe fn store_found(
    name: &str,
    scene: *const Scene,
    (triangles, capacity): (*mut PrimitiveRef, usize),
    count: *mut usize,
    find: impl FnOnce(&Scene, &mut Vec<PrimitiveRef>),
) -> i32 {
    // SAFETY: by contract both are null, and then rejected, or valid.
    let (Some(scene), Some(count)) = (unsafe { scene.as_ref() }, unsafe { count.as_mut() }) else {
        return fail(ERROR_ARGUMENT, format!("{name}: scene and count must not be null"));
    };
    *count = 0;
    if triangles.is_null() && capacity > 0 {
        return fail(ERROR_ARGUMENT, format!("{name}: triangles must not be null with a capacity"));
    }
    let mut found = Vec::new();
    if catch_unwind(AssertUnwindSafe(|| find(scene, &mut found))).is_err() {
        return fail(ERROR_INTERNAL, format!("{name}: internal error"));
    }
    *count = found.len();
    let stored = found.len().min(capacity);
    if stored > 0 {
        // SAFETY: it is not null as the capacity is not 0, so by contract it is valid for writes of
        // that many elements.
        unsafe { ptr::copy_nonoverlapping(found.as_ptr(), triangles, stored) };
    }
    OK
}

/// Stores the triangles in a box; returns a code.
///
/// # Safety
/// `ends` are null or point to three numbers. The rest is as for [`store_found`].
pub(crate) unsafe fn in_box<T: Copy>(
    name: &str,
    scene: *const Scene,
    ends: [*const [T; 3]; 2],
    triangles: (*mut PrimitiveRef, usize),
    count: *mut usize,
    find: fn(&Scene, [T; 3], [T; 3], &mut Vec<PrimitiveRef>),
) -> i32 {
    // SAFETY: by contract both are null, and then rejected, or valid for reads.
    let [Some(lower), Some(upper)] = ends.map(|end| unsafe { end.as_ref() }) else {
        return fail(ERROR_ARGUMENT, format!("{name}: lower and upper must not be null"));
    };
    // SAFETY: the contract of this function includes the contract of `store_found`.
    unsafe { store_found(name, scene, triangles, count, |scene, found| find(scene, *lower, *upper, found)) }
}

/// Stores the triangles in a ball; returns a code.
///
/// # Safety
/// `center` is null or points to three numbers. The rest is as for [`store_found`].
pub(crate) unsafe fn in_ball<T: Copy>(
    name: &str,
    scene: *const Scene,
    (center, radius): (*const [T; 3], T),
    triangles: (*mut PrimitiveRef, usize),
    count: *mut usize,
    find: fn(&Scene, [T; 3], T, &mut Vec<PrimitiveRef>),
) -> i32 {
    // SAFETY: by contract it is null, and then rejected, or valid for reads.
    let Some(center) = (unsafe { center.as_ref() }) else {
        return fail(ERROR_ARGUMENT, format!("{name}: center must not be null"));
    };
    // SAFETY: the contract of this function includes the contract of `store_found`.
    unsafe { store_found(name, scene, triangles, count, |scene, found| find(scene, *center, radius, found)) }
}

/// Triangles in a box; see `bth.h`.
///
/// # Safety
/// `scene` is null or open, `lower` and `upper` are null or point to three numbers, `triangles` is
/// null or valid for writes of `capacity` elements, and `count` is null or valid for writes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_triangles_in_box(
    scene: *const Scene,
    lower: *const [f32; 3],
    upper: *const [f32; 3],
    triangles: *mut PrimitiveRef,
    capacity: usize,
    count: *mut usize,
) -> i32 {
    let (name, find) = ("bth_triangles_in_box", Scene::triangles_in_box);
    // SAFETY: the contract is the same.
    unsafe { in_box(name, scene, [lower, upper], (triangles, capacity), count, find) }
}

/// Triangles in a ball; see `bth.h`.
///
/// # Safety
/// The contract of [`bth_triangles_in_box`], with `center` for `lower` and `upper`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_triangles_in_sphere(
    scene: *const Scene,
    center: *const [f32; 3],
    radius: f32,
    triangles: *mut PrimitiveRef,
    capacity: usize,
    count: *mut usize,
) -> i32 {
    let (name, find) = ("bth_triangles_in_sphere", Scene::triangles_in_sphere);
    // SAFETY: the contract is the same.
    unsafe { in_ball(name, scene, (center, radius), (triangles, capacity), count, find) }
}
