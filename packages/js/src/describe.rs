//! What a scene holds, and its time.

use crate::fail;
use bth::Scene;

/// Numbers of [`bth_describe`].
const NUMBERS: usize = 14;

/// Writes 14 numbers: objects, instances, triangles of all objects, lower and upper end of the
/// bounds in world space (3 each, NaN if nothing is visible), whether the file is a scene (0 or 1),
/// first frame, last frame, frames per second, seconds.
///
/// # Safety
/// `scene` is open, and `numbers` points to 14 numbers at a multiple of 4 bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_describe(scene: *const Scene, numbers: *mut [u8; 8]) {
    // SAFETY: by contract the scene is open, and `numbers` points to an array of this length;
    // bytes need no alignment.
    let (scene, to) = unsafe { (&*scene, std::slice::from_raw_parts_mut(numbers, NUMBERS)) };
    let objects = scene.object_count();
    // From +0 on: the sum of no numbers is -0.
    let triangles = (0..objects).fold(0.0, |sum, i| sum + f64::from(scene.object(i).header.triangles));
    let (lower, upper) = scene.bounds().unwrap_or(([f32::NAN; 3], [f32::NAN; 3]));
    let mut out = [0.0; NUMBERS];
    out[..3].copy_from_slice(&[f64::from(objects), f64::from(scene.instance_count()), triangles]);
    out[3..6].copy_from_slice(&lower.map(f64::from));
    out[6..9].copy_from_slice(&upper.map(f64::from));
    if let Some(view) = scene.description() {
        let row = view.scene[0];
        out[9..13].copy_from_slice(&[1.0, f64::from(row.first_frame), f64::from(row.last_frame), row.rate]);
    }
    out[13] = scene.seconds();
    for (to, number) in to.iter_mut().zip(out) {
        *to = number.to_le_bytes();
    }
}

/// Sets the time of the scene; returns 0 for an error, after which the scene is unchanged.
///
/// # Safety
/// `scene` is open, and no query runs.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_set_seconds(scene: *mut Scene, seconds: f64) -> u32 {
    // SAFETY: by contract the scene is open, and nothing else uses it.
    match unsafe { &mut *scene }.set_seconds(seconds) {
        Ok(_) => 1,
        Err(error) => {
            fail(error.to_string());
            0
        }
    }
}
