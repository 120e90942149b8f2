//! Points, boxes and balls of double precision.

use crate::closest::{in_ball, in_box};
use crate::query::Arguments;
use runtime::rays::PrimitiveRef;
use runtime::{Closest64, Scene};

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

/// Closest points; see `bth.h`.
///
/// # Safety
/// `scene` is null or open. `points` and `closest` are each null or point to `count` elements. The
/// elements of `closest` are valid for writes and do not overlap the others.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_closest_points_f64(
    scene: *const Scene,
    points: *const [f64; 3],
    radius: f64,
    closest: *mut Closest64C,
    count: usize,
) -> i32 {
    let arguments = Arguments { scene, asked: points, answers: closest, count };
    let query = |scene: &Scene, points: &[[f64; 3]], found: &mut [Option<Closest64>]| {
        scene.closest_batch_f64(points, radius, found);
    };
    // SAFETY: the contract of this function includes the contract of `store_as`.
    unsafe { arguments.store_as(None, query, Closest64C::new) }
}

/// Signed distances; see `bth.h`.
///
/// # Safety
/// The contract of [`bth_closest_points_f64`], with `distances` for `closest`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_signed_distances_f64(
    scene: *const Scene,
    points: *const [f64; 3],
    distances: *mut f64,
    count: usize,
) -> i32 {
    let arguments = Arguments { scene, asked: points, answers: distances, count };
    // SAFETY: the contract of this function includes the contract of `store`.
    unsafe { arguments.store(f64::NAN, Scene::signed_distance_batch_f64) }
}

/// Winding numbers of points; see `bth.h`.
///
/// # Safety
/// The contract of [`bth_closest_points_f64`], with `winding` for `closest`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_winding_f64(
    scene: *const Scene,
    points: *const [f64; 3],
    winding: *mut i32,
    count: usize,
) -> i32 {
    let arguments = Arguments { scene, asked: points, answers: winding, count };
    // SAFETY: the contract of this function includes the contract of `store`.
    unsafe { arguments.store(0, Scene::winding_batch_f64) }
}

/// Stores which points lie inside; see `bth.h`.
///
/// # Safety
/// The contract of [`bth_closest_points_f64`], with `inside` for `closest`: it is null or points to
/// `count` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_contains_f64(
    scene: *const Scene,
    points: *const [f64; 3],
    inside: *mut u8,
    count: usize,
) -> i32 {
    let arguments = Arguments { scene, asked: points, answers: inside, count };
    // SAFETY: the contract of this function includes the contract of `store_as`.
    unsafe { arguments.store_as(false, Scene::contains_batch_f64, u8::from) }
}

/// Triangles in a box; see `bth.h`.
///
/// # Safety
/// `scene` is null or open, `lower` and `upper` are null or point to three numbers, `triangles` is
/// null or valid for writes of `capacity` elements, and `count` is null or valid for writes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_triangles_in_box_f64(
    scene: *const Scene,
    lower: *const [f64; 3],
    upper: *const [f64; 3],
    triangles: *mut PrimitiveRef,
    capacity: usize,
    count: *mut usize,
) -> i32 {
    let (name, find) = ("bth_triangles_in_box_f64", Scene::triangles_in_box_f64);
    // SAFETY: the contract is the same.
    unsafe { in_box(name, scene, [lower, upper], (triangles, capacity), count, find) }
}

/// Triangles in a ball; see `bth.h`.
///
/// # Safety
/// The contract of [`bth_triangles_in_box_f64`], with `center` for `lower` and `upper`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_triangles_in_sphere_f64(
    scene: *const Scene,
    center: *const [f64; 3],
    radius: f64,
    triangles: *mut PrimitiveRef,
    capacity: usize,
    count: *mut usize,
) -> i32 {
    let (name, find) = ("bth_triangles_in_sphere_f64", Scene::triangles_in_sphere_f64);
    // SAFETY: the contract is the same.
    unsafe { in_ball(name, scene, (center, radius), (triangles, capacity), count, find) }
}
