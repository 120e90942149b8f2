//! Queries of many rays.

use bth::rays::{Hit, Hit64, PrimitiveRef, Ray, Ray64, StartRay};
use bth::{Scene, TraceRay};

/// Rays that are traced together.
const BLOCK: usize = 1024;

/// Numbers of a hit: t, u, v, instance and triangle.
pub(crate) const HIT_COLUMNS: usize = 5;

/// Words of a hit in f64: three numbers of two words each, instance and triangle.
const HIT64_WORDS: usize = 8;

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
    unsafe { nearest(scene, rays, (hits, HIT_COLUMNS * count), count, store_hit) }
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
    unsafe { nearest(scene, rays, (hits, HIT_COLUMNS * count), count, store_hit) }
}

/// Nearest hits of rays in f64: columns of t, u and v, two words a ray, which are the bits of f64
/// numbers, then of instances and triangles, a word a ray.
///
/// # Safety
/// The contract of [`bth_nearest`], with [`HIT64_WORDS`] words a ray.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_nearest_f64(
    scene: *const Scene,
    rays: *const Ray64,
    count: usize,
    hits: *mut u32,
) {
    let store = |scene: &Scene, ray: &Ray64, hit: &Hit, columns: &mut [u32], i: usize| {
        let Hit64 { t, u, v, primitive } = scene.hit_f64(ray, hit);
        store_f64(columns, count, i, [t, u, v]);
        columns[6 * count + i] = primitive.instance;
        columns[7 * count + i] = primitive.triangle;
    };
    // SAFETY: the contract is the same.
    unsafe { nearest(scene, rays, (hits, HIT64_WORDS * count), count, store) }
}

/// Stores the bits of element `i` of the first columns, which have `count` numbers of f64.
pub(crate) fn store_f64<const N: usize>(columns: &mut [u32], count: usize, i: usize, numbers: [f64; N]) {
    for (k, number) in numbers.into_iter().enumerate() {
        let bits = number.to_bits();
        let at = 2 * (k * count + i);
        (columns[at], columns[at + 1]) = (bits as u32, (bits >> 32) as u32);
    }
}

/// Stores the words of hit `i` in columns.
fn store_hit<R>(_scene: &Scene, _ray: &R, hit: &Hit, columns: &mut [u32], i: usize) {
    let count = columns.len() / HIT_COLUMNS;
    let PrimitiveRef { instance, triangle } = hit.primitive;
    let words = [hit.t.to_bits(), hit.u.to_bits(), hit.v.to_bits(), instance, triangle];
    for (k, word) in words.into_iter().enumerate() {
        columns[k * count + i] = word;
    }
}

/// Nearest hits of rays of a kind, which `store` stores in columns of `words`.
///
/// # Safety
/// The contract of [`bth_nearest`], with as many words as `words` says.
unsafe fn nearest<R: TraceRay>(
    scene: *const Scene,
    rays: *const R,
    (words, length): (*mut u32, usize),
    count: usize,
    store: impl Fn(&Scene, &R, &Hit, &mut [u32], usize),
) {
    // SAFETY: by contract the scene is open, and the addresses belong to arrays of these lengths,
    // which do not overlap. All bit patterns are valid for their elements.
    let (scene, rays, columns) = unsafe {
        let columns = std::slice::from_raw_parts_mut(words, length);
        (&*scene, std::slice::from_raw_parts(rays, count), columns)
    };
    let mut block = [Hit::MISS; BLOCK];
    for (first, rays) in rays.chunks(BLOCK).enumerate().map(|(i, rays)| (i * BLOCK, rays)) {
        let hits = &mut block[..rays.len()];
        scene.batch(rays).nearest(hits);
        for (i, (ray, hit)) in rays.iter().zip(&*hits).enumerate() {
            store(scene, ray, hit, columns, first + i);
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

/// Which rays in f64 hit anything, as by [`bth_any`].
///
/// # Safety
/// The contract of [`bth_any`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_any_f64(scene: *const Scene, rays: *const Ray64, count: usize, found: *mut u8) {
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
