//! The part of the C interface that sets the time of scenes and returns their instances.

use crate::query::attempt;
use crate::{ERROR_ARGUMENT, OK, fail};

use runtime::{Error, Scene};

/// `bth_instance` of `bth.h`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Instance {
    to_world: [[f64; 4]; 3],
    object: u32,
    node: u32,
    visible: u32,
    reserved: u32,
}

const _: () = assert!(size_of::<Instance>() == 112);

/// Max number of rows on the way to an instance.
const MAX_PATH: usize = 16;

/// Frames and rate of a scene; see `bth.h`.
///
/// # Safety
/// `scene` is null or open; each of the other pointers is null or valid for writes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_frames(scene: *const Scene, first: *mut i32, last: *mut i32, rate: *mut f64) {
    // SAFETY: by contract it is null or open, hence valid for reads.
    let view = unsafe { scene.as_ref() }.and_then(Scene::description);
    let found =
        view.map_or((0, 0, 1.0), |v| (v.scene[0].first_frame, v.scene[0].last_frame, v.scene[0].rate));
    // SAFETY: by contract each pointer is null, and then skipped, or valid for writes.
    unsafe {
        first.as_mut().into_iter().for_each(|out| *out = found.0);
        last.as_mut().into_iter().for_each(|out| *out = found.1);
        rate.as_mut().into_iter().for_each(|out| *out = found.2);
    }
}

/// Time of a scene; see `bth.h`.
///
/// # Safety
/// `scene` is null or open.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_seconds(scene: *const Scene) -> f64 {
    // SAFETY: by contract it is null or open, hence valid for reads.
    unsafe { scene.as_ref() }.map_or(0.0, Scene::seconds)
}

/// Moves a scene to a time; see `bth.h`.
///
/// # Safety
/// `scene` is null or open, and no other call uses it at the same time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_set_seconds(scene: *mut Scene, seconds: f64) -> i32 {
    if !seconds.is_finite() {
        return fail(ERROR_ARGUMENT, format!("bth_set_seconds: expected a finite time, found {seconds}"));
    }
    // SAFETY: the contract of this function is the contract of `update`.
    unsafe { update(scene, "bth_set_seconds", |scene| scene.set_seconds(seconds).map(drop)) }
}

/// Moves a scene to a frame; see `bth.h`.
///
/// # Safety
/// The contract of [`bth_set_seconds`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_set_frame(scene: *mut Scene, frame: i32) -> i32 {
    // SAFETY: the contract of this function is the contract of `update`.
    unsafe { update(scene, "bth_set_frame", |scene| scene.set_frame(frame).map(drop)) }
}

/// Calls `set_time` with the scene. Returns its error or panic as a code. `name` is the name of the
/// C function, for error messages.
///
/// # Safety
/// The contract of [`bth_set_seconds`].
unsafe fn update(
    scene: *mut Scene,
    name: &str,
    set_time: impl FnOnce(&mut Scene) -> Result<(), Error>,
) -> i32 {
    // SAFETY: by contract it is null or open, and not used by another call at the same time.
    let Some(scene) = (unsafe { scene.as_mut() }) else {
        return fail(ERROR_ARGUMENT, format!("{name}: scene must not be null"));
    };
    attempt(name, || set_time(scene)).map_or_else(|code| code, |()| OK)
}

/// Number of instances; see `bth.h`.
///
/// # Safety
/// `scene` is null or open.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_instance_count(scene: *const Scene) -> u32 {
    // SAFETY: by contract it is null or open, hence valid for reads.
    unsafe { scene.as_ref() }.map_or(0, Scene::instance_count)
}

/// The way to an instance; see `bth.h`.
///
/// # Safety
/// `scene` is null or open; `rows` is null or valid for writes of 16 numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_instance_path(
    scene: *const Scene,
    instance: u32,
    rows: *mut [u32; MAX_PATH],
) -> u32 {
    // SAFETY: by contract `scene` is null or open, and `rows` is null or valid for writes.
    let (Some(scene), Some(rows)) = (unsafe { scene.as_ref() }, unsafe { rows.as_mut() }) else { return 0 };
    if instance >= scene.instance_count() {
        return 0;
    }
    let path = scene.instance_path(instance);
    rows[..path.len()].copy_from_slice(&path);
    path.len() as u32
}

/// An instance; see `bth.h`.
///
/// # Safety
/// `scene` is null or open; `instance` is null or valid for writes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_get_instance(scene: *const Scene, row: u32, instance: *mut Instance) -> i32 {
    // SAFETY: by contract `scene` is null or open, and `instance` is null or valid for writes.
    let (Some(scene), Some(out)) = (unsafe { scene.as_ref() }, unsafe { instance.as_mut() }) else {
        return fail(ERROR_ARGUMENT, "bth_get_instance: scene and instance must not be null".into());
    };
    if row >= scene.instance_count() {
        let count = scene.instance_count();
        return fail(ERROR_ARGUMENT, format!("bth_get_instance: expected a row below {count}, found {row}"));
    }
    let view = scene.instance(row);
    *out = Instance {
        to_world: view.to_world,
        object: view.object,
        node: view.node,
        visible: view.visible.into(),
        reserved: 0,
    };
    OK
}
