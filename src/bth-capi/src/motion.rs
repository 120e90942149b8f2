//! The part of the C interface that sets the time of scenes and returns their instances.

use crate::query::attempt;
use crate::{ERROR_ARGUMENT, OK, Out, fail};
use runtime::{Error, Scene};
use std::mem::MaybeUninit;

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
#[unsafe(no_mangle)]
pub extern "C" fn bth_seconds(scene: Option<&Scene>) -> f64 {
    scene.map_or(0.0, Scene::seconds)
}

/// Moves a scene to a time; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_set_seconds(scene: Option<&mut Scene>, seconds: f64) -> i32 {
    if !seconds.is_finite() {
        return fail(ERROR_ARGUMENT, format!("bth_set_seconds: expected a finite time, found {seconds}"));
    }
    update(scene, "bth_set_seconds", |scene| scene.set_seconds(seconds).map(drop))
}

/// Moves a scene to a frame; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_set_frame(scene: Option<&mut Scene>, frame: i32) -> i32 {
    update(scene, "bth_set_frame", |scene| scene.set_frame(frame).map(drop))
}

/// Calls `set_time` with the scene. Returns its error or panic as a code. `name` is the name of the
/// C function, for error messages.
fn update(
    scene: Option<&mut Scene>,
    name: &str,
    set_time: impl FnOnce(&mut Scene) -> Result<(), Error>,
) -> i32 {
    let Some(scene) = scene else {
        return fail(ERROR_ARGUMENT, format!("{name}: scene must not be null"));
    };
    attempt(name, || set_time(scene)).map_or_else(|code| code, |()| OK)
}

/// Number of instances; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_instance_count(scene: Option<&Scene>) -> u32 {
    scene.map_or(0, Scene::instance_count)
}

/// The way to an instance; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_instance_path(
    scene: Option<&Scene>,
    instance: u32,
    rows: Option<&mut [MaybeUninit<u32>; MAX_PATH]>,
) -> u32 {
    let (Some(scene), Some(rows)) = (scene, rows) else { return 0 };
    if instance >= scene.instance_count() {
        return 0;
    }
    let path = scene.instance_path(instance);
    rows.iter_mut().zip(&path[..]).for_each(|(row, of_path)| *row = MaybeUninit::new(*of_path));
    path.len() as u32
}

/// An instance; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_get_instance(scene: Option<&Scene>, row: u32, instance: Out<'_, Instance>) -> i32 {
    let (Some(scene), Some(out)) = (scene, instance) else {
        return fail(ERROR_ARGUMENT, "bth_get_instance: scene and instance must not be null".into());
    };
    if row >= scene.instance_count() {
        let count = scene.instance_count();
        return fail(ERROR_ARGUMENT, format!("bth_get_instance: expected a row below {count}, found {row}"));
    }
    let view = scene.instance(row);
    out.write(Instance {
        to_world: view.to_world,
        object: view.object,
        node: view.node,
        visible: view.visible.into(),
        reserved: 0,
    });
    OK
}
