//! The part of the C interface that gives objects new positions.

use crate::builder::{UpdateC, with};
use crate::query::attempt;
use crate::{ERROR_ARGUMENT, OK, Out, fail};
use runtime::{Error, Scene, SceneBuilder, Update};
use std::mem::MaybeUninit;

/// Number of vertices of an object; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_vertex_count(scene: Option<&Scene>, object: u32) -> usize {
    let scene = scene.filter(|scene| object < scene.object_count());
    scene.and_then(|scene| scene.vertex_count(object)).unwrap_or(0)
}

/// Gives an object new positions; see `bth.h`.
///
/// # Safety
/// `positions` is null or points to `count` positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_set_positions(
    scene: Option<&mut Scene>,
    object: u32,
    positions: *const [f32; 3],
    count: usize,
    update: Out<'_, UpdateC>,
) -> i32 {
    const NAME: &str = "bth_set_positions";
    // SAFETY: the contract of this function includes the contract of `slice`.
    let (Some(scene), Some(positions)) = (scene, unsafe { slice(positions, count) }) else {
        return fail(ERROR_ARGUMENT, format!("{NAME}: scene and positions must not be null"));
    };
    finish(NAME, update, || scene.set_positions(object, positions))
}

/// Gives an object positions between those at two times; see `bth.h`.
///
/// # Safety
/// Each of `ends` is as `positions` of [`bth_set_positions`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_set_positions_between(
    scene: Option<&mut Scene>,
    object: u32,
    ends: Option<&[*const [f32; 3]; 2]>,
    count: usize,
    share: f64,
    update: Out<'_, UpdateC>,
) -> i32 {
    const NAME: &str = "bth_set_positions_between";
    // SAFETY: the contract of this function includes the contract of `both`.
    let (Some(scene), Some(ends)) = (scene, unsafe { both(ends, count) }) else {
        return fail(ERROR_ARGUMENT, format!("{NAME}: scene and positions must not be null"));
    };
    finish(NAME, update, || scene.set_positions_between(object, ends, share))
}

/// Calls a function and hands its result on to C.
fn finish(name: &str, update: Out<'_, UpdateC>, change: impl FnOnce() -> Result<Update, Error>) -> i32 {
    match attempt(name, change) {
        Ok(done) => {
            update.into_iter().for_each(|out| *out = MaybeUninit::new(UpdateC::new(&done)));
            OK
        }
        Err(code) => code,
    }
}

/// Stages new positions of an object of a builder; see `bth.h`.
///
/// # Safety
/// `positions` is null or points to `count` positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_builder_set_positions(
    builder: Option<&mut SceneBuilder>,
    object: u32,
    positions: *const [f32; 3],
    count: usize,
) -> i32 {
    const NAME: &str = "bth_builder_set_positions";
    // SAFETY: the contract of this function includes the contract of `slice`.
    let Some(positions) = (unsafe { slice(positions, count) }) else {
        return fail(ERROR_ARGUMENT, format!("{NAME}: positions must not be null"));
    };
    with(builder, NAME, |builder| builder.set_positions(object, positions))
}

/// Stages positions of an object of a builder between those at two times; see `bth.h`.
///
/// # Safety
/// Each of `ends` is as `positions` of [`bth_set_positions`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_builder_set_positions_between(
    builder: Option<&mut SceneBuilder>,
    object: u32,
    ends: Option<&[*const [f32; 3]; 2]>,
    count: usize,
    share: f64,
) -> i32 {
    const NAME: &str = "bth_builder_set_positions_between";
    // SAFETY: the contract of this function includes the contract of `both`.
    let Some(ends) = (unsafe { both(ends, count) }) else {
        return fail(ERROR_ARGUMENT, format!("{NAME}: positions must not be null"));
    };
    with(builder, NAME, |builder| builder.set_positions_between(object, ends, share))
}

/// Positions at two times from C; `None` if a pointer is null.
///
/// # Safety
/// Each of `ends` is as [`slice`] expects it.
unsafe fn both<'a>(ends: Option<&[*const [f32; 3]; 2]>, count: usize) -> Option<[&'a [[f32; 3]]; 2]> {
    let [open, close] = *ends?;
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
