//! Queries of one ray, box or ball. Nothing is allocated for a single answer; a list is kept until
//! the next list of its kind.

use bth::rays::{Hit, Hit64, PrimitiveRef, Ray64};
use bth::{Accept, Cull, Scene};
use std::cell::RefCell;

thread_local! {
    /// The hits of the last [`bth_all_hits`], and what it wrote for the caller.
    static HITS: RefCell<(Vec<Hit>, Vec<Hit64>)> = const { RefCell::new((Vec::new(), Vec::new())) };
    /// The triangles of the last list of triangles.
    static TRIANGLES: RefCell<Vec<PrimitiveRef>> = const { RefCell::new(Vec::new()) };
}

/// What a ray can hit, by side: 0 both, 1 the front, 2 the back.
fn accepted(side: u32) -> Accept<'static> {
    let cull = [Cull::None, Cull::Back, Cull::Front];
    Accept { cull: cull[side.min(2) as usize], ..Accept::default() }
}

/// The nearest hit of a ray on a side ([`accepted`]). Returns its triangle, or 2^32 - 1 for a miss.
/// Writes the hit, but nothing for a miss.
///
/// # Safety
/// `scene` is open, `ray` points to a ray, and `hit` to room for a hit, which overlap nothing else.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_nearest_one(
    scene: *const Scene,
    ray: *const Ray64,
    side: u32,
    hit: *mut Hit64,
) -> u32 {
    // SAFETY: by contract the scene is open, and the ray and the hit are valid. All bit patterns
    // are valid for them.
    let (scene, ray, hit) = unsafe { (&*scene, &*ray, &mut *hit) };
    let found = match side {
        0 => scene.nearest(ray),
        _ => scene.nearest_accepted(ray, &accepted(side)),
    };
    let Some(found) = found else { return u32::MAX };
    *hit = scene.hit_f64(ray, &found);
    hit.primitive.triangle
}

/// Returns 1 if a ray hits anything on a side ([`accepted`]), else 0.
///
/// # Safety
/// The contract of [`bth_nearest_one`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_any_one(scene: *const Scene, ray: *const Ray64, side: u32) -> u32 {
    // SAFETY: as in `bth_nearest_one`.
    let (scene, ray) = unsafe { (&*scene, &*ray) };
    scene.any_accepted(ray, &accepted(side)).into()
}

/// Finds all hits of a ray on a side ([`accepted`]), in order of t; returns their number.
/// [`bth_hits`] holds them.
///
/// # Safety
/// The contract of [`bth_nearest_one`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_all_hits(scene: *const Scene, ray: *const Ray64, side: u32) -> usize {
    // SAFETY: as in `bth_nearest_one`.
    let (scene, ray) = unsafe { (&*scene, &*ray) };
    HITS.with_borrow_mut(|(hits, wide)| {
        scene.all_hits(ray, &accepted(side), hits);
        wide.clear();
        wide.extend(hits.iter().map(|hit| scene.hit_f64(ray, hit)));
        wide.len()
    })
}

/// Address of the hits of [`bth_all_hits`], 32 bytes each: t, u and v as f64, instance, triangle.
#[unsafe(no_mangle)]
pub extern "C" fn bth_hits() -> *const Hit64 {
    HITS.with_borrow(|(_, wide)| wide.as_ptr())
}

/// Returns 1 if a triangle overlaps a closed box, six numbers, else 0.
///
/// # Safety
/// `scene` is open, and `ends` points to the lower and the upper end.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_overlaps_box(scene: *const Scene, ends: *const [[f64; 3]; 2]) -> u32 {
    // SAFETY: by contract both are valid.
    let (scene, [lower, upper]) = unsafe { (&*scene, *ends) };
    scene.overlaps_box_f64(lower, upper).into()
}

/// Returns 1 if a triangle overlaps a closed ball, else 0.
///
/// # Safety
/// `scene` is open, and `center` points to three numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_overlaps_sphere(
    scene: *const Scene,
    center: *const [f64; 3],
    radius: f64,
) -> u32 {
    // SAFETY: by contract both are valid.
    let (scene, center) = unsafe { (&*scene, *center) };
    scene.overlaps_sphere_f64(center, radius).into()
}

/// Lists the triangles that overlap a box; returns their number. [`bth_triangles`] holds them.
///
/// # Safety
/// The contract of [`bth_overlaps_box`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_triangles_in_box(scene: *const Scene, ends: *const [[f64; 3]; 2]) -> usize {
    // SAFETY: as in `bth_overlaps_box`.
    let (scene, [lower, upper]) = unsafe { (&*scene, *ends) };
    TRIANGLES.with_borrow_mut(|triangles| {
        scene.triangles_in_box_f64(lower, upper, triangles);
        triangles.len()
    })
}

/// Lists the triangles that overlap a ball; returns their number. [`bth_triangles`] holds them.
///
/// # Safety
/// The contract of [`bth_overlaps_sphere`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_triangles_in_sphere(
    scene: *const Scene,
    center: *const [f64; 3],
    radius: f64,
) -> usize {
    // SAFETY: as in `bth_overlaps_sphere`.
    let (scene, center) = unsafe { (&*scene, *center) };
    TRIANGLES.with_borrow_mut(|triangles| {
        scene.triangles_in_sphere_f64(center, radius, triangles);
        triangles.len()
    })
}

/// Address of the triangles of the last list: pairs of an instance and a triangle.
#[unsafe(no_mangle)]
pub extern "C" fn bth_triangles() -> *const PrimitiveRef {
    TRIANGLES.with_borrow(|triangles| triangles.as_ptr())
}
