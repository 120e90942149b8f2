//! The part of the C interface that builds scenes of several files, whose instances the caller
//! places.

use crate::query::attempt;
use crate::{ERROR_ARGUMENT, OK, Out, fail};
use runtime::{Content, Error, Scene, SceneBuilder, Update};
use std::mem::MaybeUninit;

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
pub(crate) fn with(
    builder: Option<&mut SceneBuilder>,
    name: &str,
    call: impl FnOnce(&mut SceneBuilder) -> Result<(), Error>,
) -> i32 {
    let Some(builder) = builder else { return null(name, "builder") };
    attempt(name, || call(builder)).map_or_else(|code| code, |()| OK)
}

/// The error of a function that was given a null pointer.
fn null(name: &str, what: &str) -> i32 {
    fail(ERROR_ARGUMENT, format!("{name}: {what} must not be null"))
}

/// A scene without objects and instances; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_builder_new() -> Box<SceneBuilder> {
    Box::default()
}

/// Frees a builder, which [`bth_builder_new`] made; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_builder_free(builder: Option<Box<SceneBuilder>>) {
    drop(builder);
}

/// The scene of a builder; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_builder_scene(builder: Option<&SceneBuilder>) -> *const Scene {
    builder.map_or(std::ptr::null(), |builder| std::ptr::from_ref(builder.scene()))
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
    if !scene.is_null() && std::ptr::eq(scene, bth_builder_scene(unsafe { builder.as_ref() })) {
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
    // SAFETY: by contract it is null or valid, and no other call uses it at the same time.
    with(unsafe { builder.as_mut() }, name, add)
}

/// Adds an instance or a subscene; stores its id.
fn add(
    builder: Option<&mut SceneBuilder>,
    name: &str,
    transform: Option<&[f32; 12]>,
    id: Out<'_, u32>,
    call: impl FnOnce(&mut SceneBuilder, &[f32; 12]) -> Result<u32, Error>,
) -> i32 {
    let (Some(transform), Some(out)) = (transform, id) else { return null(name, "transform and id") };
    with(builder, name, |builder| call(builder, transform).map(|id| *out = MaybeUninit::new(id)))
}

/// Adds an instance; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_builder_instance(
    builder: Option<&mut SceneBuilder>,
    object: u32,
    transform: Option<&[f32; 12]>,
    instance: Out<'_, u32>,
) -> i32 {
    add(builder, "bth_builder_instance", transform, instance, |builder, m| builder.instance(object, m))
}

/// Adds a group; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_builder_group(builder: Option<&mut SceneBuilder>, group: Out<'_, u32>) -> i32 {
    let name = "bth_builder_group";
    let Some(out) = group else { return null(name, "group") };
    with(builder, name, |builder| {
        out.write(builder.add_group());
        Ok(())
    })
}

/// Adds an instance of an object or a group in a group; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_builder_place(
    builder: Option<&mut SceneBuilder>,
    kind: u32,
    content: u32,
    within: u32,
    transform: Option<&[f32; 12]>,
    instance: Out<'_, u32>,
) -> i32 {
    let name = "bth_builder_place";
    let content = match kind {
        0 => Content::Object(content),
        1 => Content::Group(content),
        _ => return fail(ERROR_ARGUMENT, format!("{name}: expected a kind of 0 or 1, found {kind}")),
    };
    let within = (within != u32::MAX).then_some(within);
    add(builder, name, transform, instance, |builder, m| builder.place(content, within, m))
}

/// Adds a subscene; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_builder_subscene(
    builder: Option<&mut SceneBuilder>,
    first_object: u32,
    transform: Option<&[f32; 12]>,
    subscene: Out<'_, u32>,
) -> i32 {
    add(builder, "bth_builder_subscene", transform, subscene, |builder, m| builder.subscene(first_object, m))
}

/// Sets the transforms of instances; see `bth.h`.
///
/// # Safety
/// `instances` and `transforms` are each null or point to `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_builder_set_transforms(
    builder: Option<&mut SceneBuilder>,
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
    builder: Option<&mut SceneBuilder>,
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
    builder: Option<&mut SceneBuilder>,
    name: &str,
    instances: *const u32,
    transforms: *const [T; 12],
    count: usize,
) -> i32 {
    if count == 0 {
        return with(builder, name, |_| Ok(()));
    }
    if instances.is_null() || transforms.is_null() {
        return null(name, "instances and transforms");
    }
    // SAFETY: they are not null, so by contract they point to `count` elements.
    let (instances, transforms) = unsafe {
        (std::slice::from_raw_parts(instances, count), std::slice::from_raw_parts(transforms, count))
    };
    with(builder, name, |builder| builder.set_transforms(instances, transforms))
}

/// Defines functions that call a method of the builder and take nothing but numbers.
macro_rules! builder_functions {
    ($($(#[$doc:meta])* fn $name:ident($($argument:ident),+) = |$builder:ident| $call:expr;)+) => { $(
        $(#[$doc])*
        #[unsafe(no_mangle)]
        pub extern "C" fn $name(builder: Option<&mut SceneBuilder>, $($argument: u32),+) -> i32 {
            with(builder, stringify!($name), |$builder| $call)
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
/// `instances` is null or valid for writes of `capacity` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_builder_subscene_instances(
    builder: Option<&mut SceneBuilder>,
    subscene: u32,
    instances: *mut u32,
    capacity: usize,
    count: Out<'_, usize>,
) -> i32 {
    let name = "bth_builder_subscene_instances";
    let Some(count) = count else { return null(name, "count") };
    if instances.is_null() && capacity > 0 {
        return null(name, "instances, with a capacity,");
    }
    let store = |builder: &mut SceneBuilder| {
        let ids = builder.subscene_instances(subscene)?;
        count.write(ids.len());
        for (i, id) in ids.iter().take(capacity).enumerate() {
            // SAFETY: it is not null where the capacity is not 0, so by contract it is valid for
            // `capacity` writes.
            unsafe { instances.add(i).write(*id) };
        }
        Ok(())
    };
    with(builder, name, store)
}

/// Places a subscene; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_builder_set_subscene_transform(
    builder: Option<&mut SceneBuilder>,
    subscene: u32,
    transform: Option<&[f32; 12]>,
) -> i32 {
    place_subscene(builder, "bth_builder_set_subscene_transform", subscene, transform)
}

/// Places a subscene in double; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_builder_set_subscene_transform_f64(
    builder: Option<&mut SceneBuilder>,
    subscene: u32,
    transform: Option<&[f64; 12]>,
) -> i32 {
    place_subscene(builder, "bth_builder_set_subscene_transform_f64", subscene, transform)
}

/// Places a subscene.
fn place_subscene<T: Copy + Into<f64>>(
    builder: Option<&mut SceneBuilder>,
    name: &str,
    subscene: u32,
    transform: Option<&[T; 12]>,
) -> i32 {
    let Some(transform) = transform else { return null(name, "transform") };
    with(builder, name, |builder| builder.set_subscene_transform(subscene, transform))
}

/// Sets the time of a subscene; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_builder_set_subscene_seconds(
    builder: Option<&mut SceneBuilder>,
    subscene: u32,
    seconds: f64,
) -> i32 {
    let name = "bth_builder_set_subscene_seconds";
    if !seconds.is_finite() {
        return fail(ERROR_ARGUMENT, format!("{name}: expected a finite time, found {seconds}"));
    }
    with(builder, name, |builder| builder.set_subscene_seconds(subscene, seconds))
}

/// Makes all changes visible; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_builder_commit(builder: Option<&mut SceneBuilder>, update: Out<'_, UpdateC>) -> i32 {
    with(builder, "bth_builder_commit", |builder| {
        let done = UpdateC::new(&builder.commit()?);
        update.into_iter().for_each(|out| *out = MaybeUninit::new(done));
        Ok(())
    })
}
