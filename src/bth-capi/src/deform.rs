//! The part of the C interface that gives objects new positions.

use crate::builder::{UpdateC, with};
use crate::query::attempt;
use crate::{ERROR_ARGUMENT, OK, fail};
use runtime::{Error, Scene, SceneBuilder, Update};

/// Number of vertices of an object; see `bth.h`.
///
/// # Safety
/// `scene` is null or open.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_vertex_count(scene: *const Scene, object: u32) -> usize {
    // SAFETY: by contract it is null or open, hence valid for reads.
    let scene = unsafe { scene.as_ref() }.filter(|scene| object < scene.object_count());
    scene.and_then(|scene| scene.vertex_count(object)).unwrap_or(0)
}

/// Gives an object new positions; see `bth.h`.
///
/// # Safety
/// `scene` is null or open, and no other call uses it at the same time. `positions` is null or
/// points to `count` positions. `update` is null or valid for writes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_set_positions(
    scene: *mut Scene,
    object: u32,
    positions: *const [f32; 3],
    count: usize,
    update: *mut UpdateC,
) -> i32 {
    const NAME: &str = "bth_set_positions";
    // SAFETY: by contract they are null or valid, and the scene is not used by another call at the
    // same time.
    let (Some(scene), Some(positions)) = (unsafe { scene.as_mut() }, unsafe { slice(positions, count) })
    else {
        return fail(ERROR_ARGUMENT, format!("{NAME}: scene and positions must not be null"));
    };
    // SAFETY: the contract of this function includes the contract of `finish`.
    unsafe { finish(NAME, update, || scene.set_positions(object, positions)) }
}

/// Gives an object positions between those at two times; see `bth.h`.
///
/// # Safety
/// The contract of [`bth_set_positions`]; `ends` is null or points to two pointers, each of them as
/// `positions` there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_set_positions_between(
    scene: *mut Scene,
    object: u32,
    ends: *const [*const [f32; 3]; 2],
    count: usize,
    share: f64,
    update: *mut UpdateC,
) -> i32 {
    const NAME: &str = "bth_set_positions_between";
    // SAFETY: by contract they are null or valid, and the scene is not used by another call at the
    // same time.
    let (Some(scene), Some(ends)) = (unsafe { scene.as_mut() }, unsafe { both(ends, count) }) else {
        return fail(ERROR_ARGUMENT, format!("{NAME}: scene and positions must not be null"));
    };
    // SAFETY: the contract of this function includes the contract of `finish`.
    unsafe { finish(NAME, update, || scene.set_positions_between(object, ends, share)) }
}

/// Calls a function and hands its result on to C.
///
/// # Safety
/// `update` is null or valid for writes.
unsafe fn finish(name: &str, update: *mut UpdateC, change: impl FnOnce() -> Result<Update, Error>) -> i32 {
    match attempt(name, change) {
        Ok(done) => {
            if !update.is_null() {
                // SAFETY: it is not null, so it is valid for writes by the contract of this
                // function.
                unsafe { update.write(UpdateC::new(&done)) };
            }
            OK
        }
        Err(code) => code,
    }
}

/// Stages new positions of an object of a builder; see `bth.h`.
///
/// # Safety
/// `builder` is null or was not freed, and no other call uses it or its scene at the same time.
/// `positions` is null or points to `count` positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_builder_set_positions(
    builder: *mut SceneBuilder,
    object: u32,
    positions: *const [f32; 3],
    count: usize,
) -> i32 {
    const NAME: &str = "bth_builder_set_positions";
    // SAFETY: the contract of this function includes the contract of `slice`.
    let Some(positions) = (unsafe { slice(positions, count) }) else {
        return fail(ERROR_ARGUMENT, format!("{NAME}: positions must not be null"));
    };
    // SAFETY: the contract of this function includes the contract of `with`.
    unsafe { with(builder, NAME, |builder| builder.set_positions(object, positions)) }
}

/// Stages positions of an object of a builder between those at two times; see `bth.h`.
///
/// # Safety
/// The contract of [`bth_builder_set_positions`]; `ends` is null or points to two pointers, each of
/// them as `positions` there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_builder_set_positions_between(
    builder: *mut SceneBuilder,
    object: u32,
    ends: *const [*const [f32; 3]; 2],
    count: usize,
    share: f64,
) -> i32 {
    const NAME: &str = "bth_builder_set_positions_between";
    // SAFETY: the contract of this function includes the contract of `both`.
    let Some(ends) = (unsafe { both(ends, count) }) else {
        return fail(ERROR_ARGUMENT, format!("{NAME}: positions must not be null"));
    };
    // SAFETY: the contract of this function includes the contract of `with`.
    unsafe { with(builder, NAME, |builder| builder.set_positions_between(object, ends, share)) }
}

/// Positions at two times from C; `None` if a pointer is null.
///
/// # Safety
/// `ends` is null or points to two pointers, each as [`slice`] expects it.
unsafe fn both<'a>(ends: *const [*const [f32; 3]; 2], count: usize) -> Option<[&'a [[f32; 3]]; 2]> {
    // SAFETY: by contract it is null or valid for reads.
    let [open, close] = *unsafe { ends.as_ref() }?;
    // SAFETY: the contract of this function includes the contract of `slice`.
    Some([unsafe { slice(open, count) }?, unsafe { slice(close, count) }?])
}

/// Positions from C; `None` if the pointer is null.
///
/// # Safety
/// `positions` is null or points to `count` positions that do not change as long as the slice is
/// used.
unsafe fn slice<'a>(positions: *const [f32; 3], count: usize) -> Option<&'a [[f32; 3]]> {
    // SAFETY: it is not null, so it points to that many positions by the contract of this function.
    (!positions.is_null()).then(|| unsafe { std::slice::from_raw_parts(positions, count) })
}
