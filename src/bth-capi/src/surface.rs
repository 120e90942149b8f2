//! The part of the C interface that describes what hits lead to: surfaces, triangles, bounds and
//! names.

use crate::{ERROR_ARGUMENT, ERROR_INTERNAL, ERROR_MISSING, OK, Out, fail};
use runtime::Scene;
use runtime::rays::{Hit, PrimitiveRef};
use std::ffi::c_char;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// The version of the library with a zero at its end, for C.
const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "\0");

const HAS_UV: u32 = 1;

/// `bth_surface_point` of `bth.h`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct SurfacePointC {
    position: [f64; 3],
    geometric_normal: [f64; 3],
    normal: [f64; 3],
    uv: [f32; 2],
    object: u32,
    group: u32,
    material: u32,
    flags: u32,
}

const _: () = assert!(size_of::<SurfacePointC>() == 96);

/// Calls a function with the scene and stores its result; returns a code. The function returns an
/// error's code and text.
pub(crate) fn store<T>(
    name: &str,
    scene: Option<&Scene>,
    out: Out<'_, T>,
    find: impl FnOnce(&Scene) -> Result<T, (i32, String)>,
) -> i32 {
    let Some(scene) = scene else {
        return fail(ERROR_ARGUMENT, format!("{name}: scene must not be null"));
    };
    let Some(out) = out else {
        return fail(ERROR_ARGUMENT, format!("{name}: the result must not be null"));
    };
    match catch_unwind(AssertUnwindSafe(|| find(scene))) {
        Ok(Ok(found)) => {
            out.write(found);
            OK
        }
        Ok(Err((code, text))) => fail(code, format!("{name}: {text}")),
        Err(_) => fail(ERROR_INTERNAL, format!("{name}: internal error")),
    }
}

/// The error for a triangle that does not exist.
pub(crate) fn check_triangle(scene: &Scene, primitive: PrimitiveRef) -> Result<(), (i32, String)> {
    let PrimitiveRef { instance, triangle } = primitive;
    if instance >= scene.instance_count() {
        return Err((ERROR_ARGUMENT, format!("there is no instance {instance}")));
    }
    let object = scene.object_of(instance);
    if object >= scene.object_count() {
        return Err((ERROR_ARGUMENT, format!("instance {instance} was removed")));
    }
    if triangle >= scene.object(object).header.triangles {
        return Err((ERROR_ARGUMENT, format!("there is no triangle {triangle} of instance {instance}")));
    }
    Ok(())
}

/// Why a scene has no vertices of a triangle.
fn no_triangle(scene: &Scene, primitive: PrimitiveRef) -> (i32, String) {
    if let Err(error) = check_triangle(scene, primitive) {
        return error;
    }
    let PrimitiveRef { instance, triangle } = primitive;
    if !scene.object(scene.object_of(instance)).has_corners() {
        let text = "the file has no positions of triangles; compile it again".to_owned();
        return (ERROR_MISSING, text);
    }
    (ERROR_MISSING, format!("instance {instance} is hidden, or triangle {triangle} has no area"))
}

/// Version of the library; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_version() -> *const c_char {
    VERSION.as_ptr().cast()
}

/// World box of a scene; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_bounds(scene: Option<&Scene>, bounds: Out<'_, [[f32; 3]; 2]>) -> i32 {
    let nothing = || (ERROR_MISSING, "nothing is visible".to_owned());
    store("bth_bounds", scene, bounds, |scene| scene.bounds().map(Into::into).ok_or_else(nothing))
}

/// Number of objects; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_object_count(scene: Option<&Scene>) -> u32 {
    scene.map_or(0, Scene::object_count)
}

/// The scene, if it has an object of this number.
fn with_object(scene: Option<&Scene>, object: u32) -> Option<&Scene> {
    scene.filter(|scene| object < scene.object_count())
}

/// Number of groups of an object; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_group_count(scene: Option<&Scene>, object: u32) -> u32 {
    with_object(scene, object).map_or(0, |scene| scene.group_count(object))
}

/// Number of materials of an object; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_material_count(scene: Option<&Scene>, object: u32) -> u32 {
    with_object(scene, object).map_or(0, |scene| scene.material_count(object))
}

/// Vertices of a triangle in world space; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_triangle_positions(
    scene: Option<&Scene>,
    triangle: PrimitiveRef,
    positions: Out<'_, [[f64; 3]; 3]>,
) -> i32 {
    store("bth_triangle_positions", scene, positions, |scene| {
        scene.triangle_in_world(triangle).ok_or_else(|| no_triangle(scene, triangle))
    })
}

/// The surface at a hit; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_surface_at(
    scene: Option<&Scene>,
    hit: Option<&Hit>,
    point: Out<'_, SurfacePointC>,
) -> i32 {
    let Some(hit) = hit else {
        return fail(ERROR_ARGUMENT, "bth_surface_at: hit must not be null".into());
    };
    store("bth_surface_at", scene, point, |scene| {
        let found = scene.surface(hit).ok_or_else(|| no_triangle(scene, hit.primitive))?;
        Ok(SurfacePointC {
            position: found.position,
            geometric_normal: found.geometric_normal,
            normal: found.normal,
            uv: found.uv.unwrap_or_default(),
            object: found.object,
            group: found.group,
            material: found.material.unwrap_or(u32::MAX),
            flags: if found.uv.is_some() { HAS_UV } else { 0 },
        })
    })
}

/// Copies a name with a zero behind it to a buffer, as much of it as fits; returns its length in
/// bytes without the zero.
///
/// # Safety
/// `buffer` is null or points to `capacity` bytes that are valid for writes.
unsafe fn copy_name(name: Option<&str>, buffer: *mut c_char, capacity: usize) -> usize {
    let name = name.unwrap_or_default();
    if !buffer.is_null() && capacity > 0 {
        let stored = name.floor_char_boundary(capacity - 1);
        // SAFETY: it is not null, so by contract it points to `capacity` bytes. `stored + 1` are
        // written.
        unsafe {
            buffer.cast::<u8>().copy_from_nonoverlapping(name.as_ptr(), stored);
            buffer.add(stored).write(0);
        }
    }
    name.len()
}

/// Name of an object; see `bth.h`.
///
/// # Safety
/// `name` is null or points to `capacity` bytes that are valid for writes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_object_name(
    scene: Option<&Scene>,
    object: u32,
    name: *mut c_char,
    capacity: usize,
) -> usize {
    // SAFETY: the contract is the same.
    unsafe { copy_name(scene.map(|scene| scene.object_name(object)), name, capacity) }
}

/// Name of a group; see `bth.h`.
///
/// # Safety
/// The contract of [`bth_object_name`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_group_name(
    scene: Option<&Scene>,
    object: u32,
    group: u32,
    name: *mut c_char,
    capacity: usize,
) -> usize {
    let found = with_object(scene, object).map(|scene| scene.group_name(object, group));
    // SAFETY: the contract is the same.
    unsafe { copy_name(found, name, capacity) }
}

/// Name of a material; see `bth.h`.
///
/// # Safety
/// The contract of [`bth_object_name`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_material_name(
    scene: Option<&Scene>,
    object: u32,
    material: u32,
    name: *mut c_char,
    capacity: usize,
) -> usize {
    let found = with_object(scene, object).map(|scene| scene.material_name(object, material));
    // SAFETY: the contract is the same.
    unsafe { copy_name(found, name, capacity) }
}
