//! The part of the C interface that builds scenes of several files, whose instances the caller
//! places.

use crate::query::attempt;
use crate::{ERROR_ARGUMENT, OK, fail};
use runtime::{Content, Error, Scene, SceneBuilder, Update};

/// `bth_update` of `bth.h`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct UpdateC {
    nodes: u64,
    placed: u64,
    visible: u64,
    cost_ratio: f64,
    top_level_seconds: f64,
    rebuilt: u32,
    deformed: u32,
    deformed_cost_ratio: f64,
    refit_seconds: f64,
}

const _: () = assert!(size_of::<UpdateC>() == 64);

impl UpdateC {
    pub(crate) fn new(update: &Update) -> UpdateC {
        UpdateC {
            nodes: update.nodes as u64,
            placed: update.placed as u64,
            visible: update.visible as u64,
            cost_ratio: update.cost_ratio,
            top_level_seconds: update.top_level.as_secs_f64(),
            rebuilt: update.rebuilt.into(),
            deformed: update.deformed as u32,
            deformed_cost_ratio: update.deformed_cost_ratio,
            refit_seconds: update.refit.as_secs_f64(),
        }
    }
}

/// Calls a function with the builder. Returns its error or panic as a code. `name` is the name of
/// the C function, for error messages.
///
/// # Safety
/// `builder` is null or was not freed, and no other call uses it or its scene at the same time.
pub(crate) unsafe fn with(
    builder: *mut SceneBuilder,
    name: &str,
    call: impl FnOnce(&mut SceneBuilder) -> Result<(), Error>,
) -> i32 {
    // SAFETY: by contract it is null or valid, and not used by another call at the same time.
    let Some(builder) = (unsafe { builder.as_mut() }) else {
        return fail(ERROR_ARGUMENT, format!("{name}: builder must not be null"));
    };
    attempt(name, || call(builder)).map_or_else(|code| code, |()| OK)
}

/// The error of a function that was given a null pointer.
fn null(name: &str, what: &str) -> i32 {
    fail(ERROR_ARGUMENT, format!("{name}: {what} must not be null"))
}

/// A scene without objects and instances; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_builder_new() -> *mut SceneBuilder {
    Box::into_raw(Box::new(SceneBuilder::new()))
}

/// Frees a builder; see `bth.h`.
///
/// # Safety
/// `builder` is null, or it comes from [`bth_builder_new`], was not freed, and no other call uses
/// it or its scene now or later.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_builder_free(builder: *mut SceneBuilder) {
    if !builder.is_null() {
        // SAFETY: `bth_builder_new` obtained the pointer from `Box::into_raw`, and by the contract
        // of this function it has not been freed and is not used by another call.
        drop(unsafe { Box::from_raw(builder) });
    }
}

/// The scene of a builder; see `bth.h`.
///
/// # Safety
/// `builder` is null or was not freed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_builder_scene(builder: *const SceneBuilder) -> *const Scene {
    // SAFETY: by contract it is null or valid for reads.
    unsafe { builder.as_ref() }.map_or(std::ptr::null(), |builder| std::ptr::from_ref(builder.scene()))
}

/// Adds the objects of a scene; see `bth.h`.
///
/// # Safety
/// `builder` is null or was not freed, and no other call uses it or its scene at the same time.
/// `scene` is null or open; `first_object` is null or valid for writes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_builder_add(
    builder: *mut SceneBuilder,
    scene: *const Scene,
    first_object: *mut u32,
) -> i32 {
    let name = "bth_builder_add";
    // Its objects would be read from memory that is freed while they are added.
    // SAFETY: by contract the builder is null or valid.
    if !scene.is_null() && std::ptr::eq(scene, unsafe { bth_builder_scene(builder) }) {
        return fail(ERROR_ARGUMENT, format!("{name}: expected another scene than that of the builder"));
    }
    // SAFETY: by contract they are null or valid.
    let (Some(scene), Some(out)) = (unsafe { scene.as_ref() }, unsafe { first_object.as_mut() }) else {
        return null(name, "scene and first_object");
    };
    let add = |builder: &mut SceneBuilder| {
        *out = builder.add(scene);
        Ok(())
    };
    // SAFETY: the contract of this function includes the contract of `with`.
    unsafe { with(builder, name, add) }
}

/// Adds an instance or a subscene; stores its id.
///
/// # Safety
/// `builder` is as for [`with`]. `transform` is null or points to 12 numbers, `id` is null or valid
/// for writes.
unsafe fn add(
    builder: *mut SceneBuilder,
    name: &str,
    transform: *const [f32; 12],
    id: *mut u32,
    call: impl FnOnce(&mut SceneBuilder, &[f32; 12]) -> Result<u32, Error>,
) -> i32 {
    // SAFETY: by contract they are null or valid.
    let (Some(transform), Some(out)) = (unsafe { transform.as_ref() }, unsafe { id.as_mut() }) else {
        return null(name, "transform and id");
    };
    // SAFETY: the contract of this function includes the contract of `with`.
    unsafe { with(builder, name, |builder| call(builder, transform).map(|id| *out = id)) }
}

/// Adds an instance; see `bth.h`.
///
/// # Safety
/// `builder` is null or was not freed, and no other call uses it or its scene at the same time.
/// `transform` is null or points to 12 numbers, `instance` is null or valid for writes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_builder_instance(
    builder: *mut SceneBuilder,
    object: u32,
    transform: *const [f32; 12],
    instance: *mut u32,
) -> i32 {
    let name = "bth_builder_instance";
    // SAFETY: the contract of this function is the contract of `add`.
    unsafe { add(builder, name, transform, instance, |builder, m| builder.instance(object, m)) }
}

/// Adds a group; see `bth.h`.
///
/// # Safety
/// `builder` is null or was not freed, and no other call uses it or its scene at the same time.
/// `group` is null or valid for writes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_builder_group(builder: *mut SceneBuilder, group: *mut u32) -> i32 {
    let name = "bth_builder_group";
    // SAFETY: by contract it is null or valid for writes.
    let Some(out) = (unsafe { group.as_mut() }) else { return null(name, "group") };
    // SAFETY: the contract of this function includes the contract of `with`.
    unsafe {
        with(builder, name, |builder| {
            *out = builder.add_group();
            Ok(())
        })
    }
}

/// Adds an instance of an object or a group in a group; see `bth.h`.
///
/// # Safety
/// The contract of [`bth_builder_instance`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_builder_place(
    builder: *mut SceneBuilder,
    kind: u32,
    content: u32,
    within: u32,
    transform: *const [f32; 12],
    instance: *mut u32,
) -> i32 {
    let name = "bth_builder_place";
    let content = match kind {
        0 => Content::Object(content),
        1 => Content::Group(content),
        _ => return fail(ERROR_ARGUMENT, format!("{name}: expected a kind of 0 or 1, found {kind}")),
    };
    let within = (within != u32::MAX).then_some(within);
    // SAFETY: the contract of this function is the contract of `add`.
    unsafe { add(builder, name, transform, instance, |builder, m| builder.place(content, within, m)) }
}

/// Adds a subscene; see `bth.h`.
///
/// # Safety
/// The contract of [`bth_builder_instance`], with `subscene` for `instance`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_builder_subscene(
    builder: *mut SceneBuilder,
    first_object: u32,
    transform: *const [f32; 12],
    subscene: *mut u32,
) -> i32 {
    let name = "bth_builder_subscene";
    // SAFETY: the contract of this function is the contract of `add`.
    unsafe { add(builder, name, transform, subscene, |builder, m| builder.subscene(first_object, m)) }
}

/// Sets the transforms of instances; see `bth.h`.
///
/// # Safety
/// `builder` is null or was not freed, and no other call uses it or its scene at the same time.
/// `instances` and `transforms` are each null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_builder_set_transforms(
    builder: *mut SceneBuilder,
    instances: *const u32,
    transforms: *const [f32; 12],
    count: usize,
) -> i32 {
    // SAFETY: the contract of this function is the contract of `set_transforms`.
    unsafe { set_transforms(builder, "bth_builder_set_transforms", instances, transforms, count) }
}

/// Sets the transforms of instances in double; see `bth.h`.
///
/// # Safety
/// The contract of [`bth_builder_set_transforms`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_builder_set_transforms_f64(
    builder: *mut SceneBuilder,
    instances: *const u32,
    transforms: *const [f64; 12],
    count: usize,
) -> i32 {
    // SAFETY: the contract of this function is the contract of `set_transforms`.
    unsafe { set_transforms(builder, "bth_builder_set_transforms_f64", instances, transforms, count) }
}

/// Sets the transforms of instances.
///
/// # Safety
/// The contract of [`bth_builder_set_transforms`].
unsafe fn set_transforms<T: Copy + Into<f64>>(
    builder: *mut SceneBuilder,
    name: &str,
    instances: *const u32,
    transforms: *const [T; 12],
    count: usize,
) -> i32 {
    if count == 0 {
        // SAFETY: the contract of this function includes the contract of `with`.
        return unsafe { with(builder, name, |_| Ok(())) };
    }
    if instances.is_null() || transforms.is_null() {
        return null(name, "instances and transforms");
    }
    // SAFETY: they are not null, so by contract they point to `count` elements.
    let (instances, transforms) = unsafe {
        (std::slice::from_raw_parts(instances, count), std::slice::from_raw_parts(transforms, count))
    };
    // SAFETY: the contract of this function includes the contract of `with`.
    unsafe { with(builder, name, |builder| builder.set_transforms(instances, transforms)) }
}

/// Defines functions that call a method of the builder and take nothing but numbers.
macro_rules! builder_functions {
    ($($(#[$doc:meta])* fn $name:ident($($argument:ident),+) = |$builder:ident| $call:expr;)+) => { $(
        $(#[$doc])*
        ///
        /// # Safety
        /// `builder` is null or was not freed, and no other call uses it or its scene at the same
        /// time.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(builder: *mut SceneBuilder, $($argument: u32),+) -> i32 {
            // SAFETY: the contract of this function is the contract of `with`.
            unsafe { with(builder, stringify!($name), |$builder| $call) }
        }
    )+ };
}

builder_functions! {
    /// Hides or shows an instance; see `bth.h`.
    fn bth_builder_set_visible(instance, visible) = |builder| builder.set_visible(instance, visible != 0);
    /// Removes an instance; see `bth.h`.
    fn bth_builder_remove(instance) = |builder| builder.remove(instance);
    /// Hides or shows a subscene; see `bth.h`.
    fn bth_builder_set_subscene_visible(subscene, visible) =
        |builder| builder.set_subscene_visible(subscene, visible != 0);
    /// Removes a subscene; see `bth.h`.
    fn bth_builder_remove_subscene(subscene) = |builder| builder.remove_subscene(subscene);
    /// Sets the mask of an instance; see `bth.h`.
    fn bth_builder_set_instance_mask(instance, mask) = |builder| builder.set_instance_mask(instance, mask);
    /// Sets the mask of a group; see `bth.h`.
    fn bth_builder_set_group_mask(object, group, mask) = |builder| builder.set_group_mask(object, group, mask);
}

/// Ids of a subscene's instances; see `bth.h`.
///
/// # Safety
/// The contract of [`bth_builder_set_subscene_transform`]. `instances` is null or valid for writes
/// of `capacity` elements, `count` is null or valid for writes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_builder_subscene_instances(
    builder: *mut SceneBuilder,
    subscene: u32,
    instances: *mut u32,
    capacity: usize,
    count: *mut usize,
) -> i32 {
    let name = "bth_builder_subscene_instances";
    // SAFETY: by contract it is null or valid for writes.
    let Some(count) = (unsafe { count.as_mut() }) else { return null(name, "count") };
    if instances.is_null() && capacity > 0 {
        return null(name, "instances, with a capacity,");
    }
    let store = |builder: &mut SceneBuilder| {
        let ids = builder.subscene_instances(subscene)?;
        *count = ids.len();
        for (i, id) in ids.iter().take(capacity).enumerate() {
            // SAFETY: it is not null where the capacity is not 0, so by contract it is valid for
            // `capacity` writes.
            unsafe { instances.add(i).write(*id) };
        }
        Ok(())
    };
    // SAFETY: the contract of this function includes the contract of `with`.
    unsafe { with(builder, name, store) }
}

/// Places a subscene; see `bth.h`.
///
/// # Safety
/// `builder` is null or was not freed, and no other call uses it or its scene at the same time.
/// `transform` is null or points to 12 numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_builder_set_subscene_transform(
    builder: *mut SceneBuilder,
    subscene: u32,
    transform: *const [f32; 12],
) -> i32 {
    // SAFETY: the contract of this function is the contract of `place_subscene`.
    unsafe { place_subscene(builder, "bth_builder_set_subscene_transform", subscene, transform) }
}

/// Places a subscene in double; see `bth.h`.
///
/// # Safety
/// The contract of [`bth_builder_set_subscene_transform`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_builder_set_subscene_transform_f64(
    builder: *mut SceneBuilder,
    subscene: u32,
    transform: *const [f64; 12],
) -> i32 {
    // SAFETY: the contract of this function is the contract of `place_subscene`.
    unsafe { place_subscene(builder, "bth_builder_set_subscene_transform_f64", subscene, transform) }
}

/// Places a subscene.
///
/// # Safety
/// The contract of [`bth_builder_set_subscene_transform`].
unsafe fn place_subscene<T: Copy + Into<f64>>(
    builder: *mut SceneBuilder,
    name: &str,
    subscene: u32,
    transform: *const [T; 12],
) -> i32 {
    // SAFETY: by contract it is null or points to 12 numbers.
    let Some(transform) = (unsafe { transform.as_ref() }) else { return null(name, "transform") };
    // SAFETY: the contract of this function includes the contract of `with`.
    unsafe { with(builder, name, |builder| builder.set_subscene_transform(subscene, transform)) }
}

/// Sets the time of a subscene; see `bth.h`.
///
/// # Safety
/// The contract of [`bth_builder_set_subscene_transform`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_builder_set_subscene_seconds(
    builder: *mut SceneBuilder,
    subscene: u32,
    seconds: f64,
) -> i32 {
    let name = "bth_builder_set_subscene_seconds";
    if !seconds.is_finite() {
        return fail(ERROR_ARGUMENT, format!("{name}: expected a finite time, found {seconds}"));
    }
    // SAFETY: the contract of this function is the contract of `with`.
    unsafe { with(builder, name, |builder| builder.set_subscene_seconds(subscene, seconds)) }
}

/// Makes all changes visible; see `bth.h`.
///
/// # Safety
/// The contract of [`bth_builder_set_subscene_transform`]. `update` is null or valid for writes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_builder_commit(builder: *mut SceneBuilder, update: *mut UpdateC) -> i32 {
    let commit = |builder: &mut SceneBuilder| {
        let done = UpdateC::new(&builder.commit()?);
        if !update.is_null() {
            // SAFETY: it is not null, so it is valid for writes by the contract of this function.
            unsafe { update.write(done) };
        }
        Ok(())
    };
    // SAFETY: the contract of this function includes the contract of `with`.
    unsafe { with(builder, "bth_builder_commit", commit) }
}
