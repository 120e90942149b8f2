//! What moves: new positions of objects, and instances that a program places.

use crate::fail;
use bth::{Error, Scene, SceneBuilder};
use std::cell::RefCell;

/// Numbers of an instance: the rows of its transform.
const TRANSFORM: usize = 12;

thread_local! {
    /// Positions or transforms that the caller writes, before a call that reads them.
    static ROOM: RefCell<Vec<f64>> = const { RefCell::new(Vec::new()) };
}

/// Address of room for this number of bytes, at a multiple of 8, until the next call.
#[unsafe(no_mangle)]
pub extern "C" fn bth_room(bytes: usize) -> *mut f64 {
    ROOM.with_borrow_mut(|room| {
        room.resize(bytes.div_ceil(8), 0.0);
        room.as_mut_ptr()
    })
}

/// Returns 1, or 0 after keeping the text of an error.
fn done<T>(result: Result<T, Error>) -> u32 {
    result.map_err(|error| fail(error.to_string())).is_ok().into()
}

/// The number of vertices that [`bth_set_positions`] expects; 2^32 - 1 if the object does not
/// deform.
///
/// # Safety
/// `scene` is open, and has the object.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_vertex_count(scene: *const Scene, object: u32) -> u32 {
    // SAFETY: by contract the scene is open.
    let scene = unsafe { &*scene };
    scene.vertex_count(object).map_or(u32::MAX, |count| count as u32)
}

/// Gives an object the first `count` positions of f32 in the room ([`bth_room`]); returns 0 for an
/// error.
///
/// # Safety
/// `scene` is open, and no query runs.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_set_positions(scene: *mut Scene, object: u32, count: usize) -> u32 {
    ROOM.with_borrow(|room| {
        if count > room.len() * 2 / 3 {
            fail(format!("expected room for {count} positions"));
            return 0;
        }
        // SAFETY: by contract the scene is open and nothing else uses it. The room holds as many
        // numbers of f32, for which all bit patterns are valid, and nobody writes to it meanwhile.
        let (scene, positions) =
            unsafe { (&mut *scene, std::slice::from_raw_parts(room.as_ptr().cast::<[f32; 3]>(), count)) };
        done(scene.set_positions(object, positions))
    })
}

/// A scene of instances, at first without any.
#[unsafe(no_mangle)]
pub extern "C" fn bth_builder_new() -> *mut SceneBuilder {
    Box::into_raw(Box::default())
}

/// Adds the objects of a scene; returns the index of the first.
///
/// # Safety
/// `builder` comes from [`bth_builder_new`], and `scene` is open.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_builder_add(builder: *mut SceneBuilder, scene: *const Scene) -> u32 {
    // SAFETY: by contract both are valid and different.
    unsafe { (&mut *builder).add(&*scene) }
}

/// Places instances from `first` on, with the `count` transforms in the room, each followed by the
/// index of its object. Instances that are not there are added; the object of others stays. One
/// whose transform is all zeros but for the translation is hidden. Returns 0 for an error, after
/// which the scene is unchanged.
///
/// # Safety
/// `builder` comes from [`bth_builder_new`], and no query of its scene runs.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_builder_place(builder: *mut SceneBuilder, first: u32, count: usize) -> u32 {
    // SAFETY: by contract it is valid, and nothing else uses it.
    let builder = unsafe { &mut *builder };
    ROOM.with_borrow(|room| {
        let rows = room.chunks_exact(TRANSFORM + 1).take(count);
        done(
            (first..)
                .zip(rows)
                .try_for_each(|(id, row)| place(builder, id, row))
                .and_then(|()| builder.commit()),
        )
    })
}

/// Places one instance.
fn place(builder: &mut SceneBuilder, id: u32, row: &[f64]) -> Result<(), Error> {
    let transform: [f64; TRANSFORM] = std::array::from_fn(|i| row[i]);
    let has_size = (0..TRANSFORM).any(|i| i % 4 != 3 && transform[i] != 0.0);
    if builder.set_transform(id, &transform).is_err() {
        builder.instance(row[TRANSFORM] as u32, &transform)?;
    }
    builder.set_visible(id, has_size)
}

/// The scene of a builder. Its address stays the same; it is closed with the builder.
///
/// # Safety
/// `builder` comes from [`bth_builder_new`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_builder_scene(builder: *const SceneBuilder) -> *const Scene {
    // SAFETY: by contract it is valid.
    unsafe { &*builder }.scene()
}

/// Frees a builder and its scene.
///
/// # Safety
/// `builder` comes from [`bth_builder_new`] and is not used any more, nor is its scene.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_builder_close(builder: *mut SceneBuilder) {
    // SAFETY: by contract the pointer comes from `Box::into_raw`, and the caller gives it up.
    drop(unsafe { Box::from_raw(builder) });
}
