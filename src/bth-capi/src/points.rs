//! Closest points, points inside of closed meshes, and triangles in boxes and balls, in float and
//! double.

use crate::query::queries;
use crate::{ERROR_ARGUMENT, ERROR_INTERNAL, OK, fail};
use runtime::rays::PrimitiveRef;
use runtime::{Closest64, Scene};
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

/// `bth_closest64` of `bth.h`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Closest64C {
    distance: f64,
    point: [f64; 3],
    u: f64,
    v: f64,
    primitive: PrimitiveRef,
    feature: u32,
    reserved: u32,
}

const _: () = assert!(size_of::<Closest64C>() == 64);

impl Closest64C {
    const NONE: Closest64C = Closest64C {
        distance: f64::INFINITY,
        point: [0.0; 3],
        u: 0.0,
        v: 0.0,
        primitive: PrimitiveRef::NONE,
        feature: 0,
        reserved: 0,
    };

    fn new(closest: Option<Closest64>) -> Closest64C {
        closest.map_or(Closest64C::NONE, |c| Closest64C {
            distance: c.distance,
            point: c.point,
            u: c.u,
            v: c.v,
            primitive: c.primitive,
            feature: c.feature.code(),
            reserved: 0,
        })
    }
}

queries! {
    /// Closest points; see `bth.h`.
    fn bth_closest_points([f32; 3], radius: f32) -> Closest = |points| {
        points.store_as(None, |scene, at, found| scene.closest_batch(at, radius, found), Closest::new)
    };
    /// The same in double.
    fn bth_closest_points_f64([f64; 3], radius: f64) -> Closest64C = |points| {
        points.store_as(None, |scene, at, found| scene.closest_batch_f64(at, radius, found), Closest64C::new)
    };
    /// Signed distances; see `bth.h`.
    fn bth_signed_distances([f32; 3]) -> f32 = |points| points.store(f32::NAN, Scene::signed_distance_batch);
    /// The same in double.
    fn bth_signed_distances_f64([f64; 3]) -> f64 =
        |points| points.store(f64::NAN, Scene::signed_distance_batch_f64);
    /// Winding numbers of points; see `bth.h`.
    fn bth_winding([f32; 3]) -> i32 = |points| points.store(0, Scene::winding_batch);
    /// The same in double.
    fn bth_winding_f64([f64; 3]) -> i32 = |points| points.store(0, Scene::winding_batch_f64);
    /// Stores which points lie inside; see `bth.h`.
    fn bth_contains([f32; 3]) -> u8 = |points| points.store_as(false, Scene::contains_batch, u8::from);
    /// The same in double.
    fn bth_contains_f64([f64; 3]) -> u8 = |points| points.store_as(false, Scene::contains_batch_f64, u8::from);
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
unsafe fn in_box<T: Copy>(
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
unsafe fn in_ball<T: Copy>(
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

/// Defines functions of C that store the triangles in a box and in a ball.
macro_rules! found_in {
    ($number:ty, $in_box:ident = $find_in_box:expr, $in_ball:ident = $find_in_ball:expr) => {
        /// Triangles in a box; see `bth.h`.
        ///
        /// # Safety
        /// `scene` is null or open, `lower` and `upper` are null or point to three numbers,
        /// `triangles` is null or valid for writes of `capacity` elements, and `count` is null or
        /// valid for writes.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $in_box(
            scene: *const Scene,
            lower: *const [$number; 3],
            upper: *const [$number; 3],
            triangles: *mut PrimitiveRef,
            capacity: usize,
            count: *mut usize,
        ) -> i32 {
            let (name, ends) = (stringify!($in_box), [lower, upper]);
            // SAFETY: the contract is the same.
            unsafe { in_box(name, scene, ends, (triangles, capacity), count, $find_in_box) }
        }

        /// Triangles in a ball; see `bth.h`.
        ///
        /// # Safety
        /// The contract for boxes, with `center` for `lower` and `upper`.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $in_ball(
            scene: *const Scene,
            center: *const [$number; 3],
            radius: $number,
            triangles: *mut PrimitiveRef,
            capacity: usize,
            count: *mut usize,
        ) -> i32 {
            let (name, ball) = (stringify!($in_ball), (center, radius));
            // SAFETY: the contract is the same.
            unsafe { in_ball(name, scene, ball, (triangles, capacity), count, $find_in_ball) }
        }
    };
}

found_in!(
    f32,
    bth_triangles_in_box = Scene::triangles_in_box,
    bth_triangles_in_sphere = Scene::triangles_in_sphere
);
found_in!(
    f64,
    bth_triangles_in_box_f64 = Scene::triangles_in_box_f64,
    bth_triangles_in_sphere_f64 = Scene::triangles_in_sphere_f64
);
