//! Queries of many rays.

use bth::rays::{Hit, PrimitiveRef, Ray, StartRay};
use bth::{Scene, TraceRay};

/// Rays that are traced together.
const BLOCK: usize = 1024;

/// Numbers of a hit: t, u, v, instance and triangle.
pub(crate) const HIT_COLUMNS: usize = 5;

/// Numbers of [`bth_steps`]: nodes, leaves, triangles and tetrahedra.
const STEP_COLUMNS: usize = 4;

/// The hit of ray `i`, of the columns that [`bth_nearest`] wrote.
pub(crate) fn hit(columns: &[u32], count: usize, i: usize) -> Hit {
    let [t, u, v, instance, triangle] = std::array::from_fn(|k| columns[k * count + i]);
    let [t, u, v] = [t, u, v].map(f32::from_bits);
    Hit { t, u, v, primitive: PrimitiveRef { instance, triangle } }
}

/// Nearest hits: columns of [`HIT_COLUMNS`] words a ray. t, u and v are the bits of f32 numbers.
///
/// # Safety
/// `scene` is open, `rays` points to `count` rays, and `hits` to as many words as stated, which
/// overlap nothing else.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_nearest(scene: *const Scene, rays: *const Ray, count: usize, hits: *mut u32) {
    // SAFETY: the contract is the same.
    unsafe { nearest(scene, rays, count, hits) }
}

/// Nearest hits of rays that start on surfaces, as by [`bth_nearest`].
///
/// # Safety
/// The contract of [`bth_nearest`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_nearest_starts(
    scene: *const Scene,
    rays: *const StartRay,
    count: usize,
    hits: *mut u32,
) {
    // SAFETY: the contract is the same.
    unsafe { nearest(scene, rays, count, hits) }
}

/// Nearest hits of rays of a kind.
///
/// # Safety
/// The contract of [`bth_nearest`].
unsafe fn nearest<R: TraceRay>(scene: *const Scene, rays: *const R, count: usize, hits: *mut u32) {
    // SAFETY: by contract the scene is open, and the addresses belong to arrays of these lengths,
    // which do not overlap. All bit patterns are valid for their elements.
    let (scene, rays, columns) = unsafe {
        let columns = std::slice::from_raw_parts_mut(hits, HIT_COLUMNS * count);
        (&*scene, std::slice::from_raw_parts(rays, count), columns)
    };
    let mut block = [Hit::MISS; BLOCK];
    for (first, rays) in rays.chunks(BLOCK).enumerate().map(|(i, rays)| (i * BLOCK, rays)) {
        let hits = &mut block[..rays.len()];
        scene.batch(rays).nearest(hits);
        for (i, hit) in hits.iter().enumerate() {
            let PrimitiveRef { instance, triangle } = hit.primitive;
            let words = [hit.t.to_bits(), hit.u.to_bits(), hit.v.to_bits(), instance, triangle];
            for (k, word) in words.into_iter().enumerate() {
                columns[k * count + first + i] = word;
            }
        }
    }
}

/// Which rays hit anything: a byte a ray, 0 or 1.
///
/// # Safety
/// The contract of [`bth_nearest`], with `count` bytes at `found`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_any(scene: *const Scene, rays: *const Ray, count: usize, found: *mut u8) {
    // SAFETY: the contract is the same.
    unsafe { any(scene, rays, count, found) }
}

/// Which rays that start on surfaces hit anything, as by [`bth_any`].
///
/// # Safety
/// The contract of [`bth_any`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_any_starts(
    scene: *const Scene,
    rays: *const StartRay,
    count: usize,
    found: *mut u8,
) {
    // SAFETY: the contract is the same.
    unsafe { any(scene, rays, count, found) }
}

/// Which rays of a kind hit anything.
///
/// # Safety
/// The contract of [`bth_any`].
unsafe fn any<R: TraceRay>(scene: *const Scene, rays: *const R, count: usize, found: *mut u8) {
    // SAFETY: as in `nearest`.
    let (scene, rays, found) = unsafe {
        let found = std::slice::from_raw_parts_mut(found, count);
        (&*scene, std::slice::from_raw_parts(rays, count), found)
    };
    let mut block = [false; BLOCK];
    for (rays, found) in rays.chunks(BLOCK).zip(found.chunks_mut(BLOCK)) {
        let block = &mut block[..rays.len()];
        scene.batch(rays).any(block);
        for (found, any) in found.iter_mut().zip(block) {
            *found = (*any).into();
        }
    }
}

/// Steps of the search for nearest hits: columns of [`STEP_COLUMNS`] words a ray.
///
/// # Safety
/// The contract of [`bth_nearest`], with as many words at `steps` as stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_steps(scene: *const Scene, rays: *const Ray, count: usize, steps: *mut u32) {
    // SAFETY: as in `nearest`.
    let (scene, rays, columns) = unsafe {
        let columns = std::slice::from_raw_parts_mut(steps, STEP_COLUMNS * count);
        (&*scene, std::slice::from_raw_parts(rays, count), columns)
    };
    for (i, ray) in rays.iter().enumerate() {
        let (_, steps) = scene.nearest_counted(ray);
        let words = [steps.nodes, steps.leaves, steps.triangles, steps.cells];
        for (k, word) in words.into_iter().enumerate() {
            columns[k * count + i] = word;
        }
    }
}
