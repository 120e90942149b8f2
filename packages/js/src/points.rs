//! Queries of many points.

use crate::queries::store_f64;
use bth::Scene;
use bth::rays::PrimitiveRef;

/// Numbers of f64 of a closest point: x, y, z, distance, u and v.
const CLOSEST_NUMBERS: usize = 6;

/// Words of a closest point: its numbers, instance, triangle and feature.
const CLOSEST_WORDS: usize = 2 * CLOSEST_NUMBERS + 3;

/// Closest points: columns of numbers, two words a point, then of indices, a word a point. If
/// no surface is within the radius, the distance is infinite, the other numbers are NaN and the
/// indices 2^32 - 1.
///
/// # Safety
/// `scene` is open, `points` points to `count` points, and `closest` to as many words as stated,
/// which overlap nothing else.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_closest(
    scene: *const Scene,
    points: *const [f64; 3],
    count: usize,
    radius: f64,
    closest: *mut u32,
) {
    // SAFETY: by contract the scene is open, and the addresses belong to arrays of these lengths,
    // which do not overlap. All bit patterns are valid for their elements.
    let (scene, points, columns) = unsafe {
        let columns = std::slice::from_raw_parts_mut(closest, CLOSEST_WORDS * count);
        (&*scene, std::slice::from_raw_parts(points, count), columns)
    };
    let mut found = vec![None; count];
    scene.closest_batch_f64(points, radius, &mut found);
    for (i, found) in found.into_iter().enumerate() {
        let (mut numbers, mut indices) = ([f64::NAN; CLOSEST_NUMBERS], [u32::MAX; 3]);
        numbers[3] = f64::INFINITY;
        if let Some(bth::Closest64 { distance, point: [x, y, z], u, v, primitive, feature }) = found {
            let PrimitiveRef { instance, triangle } = primitive;
            numbers = [x, y, z, distance, u, v];
            indices = [instance, triangle, feature.code()];
        }
        store_f64(columns, count, i, numbers);
        for (k, index) in indices.into_iter().enumerate() {
            columns[(2 * CLOSEST_NUMBERS + k) * count + i] = index;
        }
    }
}

/// Winding numbers of points.
///
/// # Safety
/// The contract of [`bth_closest`], with `count` numbers at `winding`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_winding(
    scene: *const Scene,
    points: *const [f64; 3],
    count: usize,
    winding: *mut i32,
) {
    // SAFETY: as in `bth_closest`.
    let (scene, points, winding) = unsafe {
        let winding = std::slice::from_raw_parts_mut(winding, count);
        (&*scene, std::slice::from_raw_parts(points, count), winding)
    };
    scene.winding_batch_f64(points, winding);
}
