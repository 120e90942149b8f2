//! Geometries that bth holds, and what all kinds have.
#![allow(unsafe_code)] // Functions take pointers of the program.

use super::exports;
use crate::abi::*;
use crate::buffer::{Buffer, View};
use crate::device::{Device, report_without_device};
use crate::error::{Result, argument, operation, unsupported};
use crate::geometry::{Geometry, Instanced};
use crate::handles::{Shared, borrow, give, is_ours, release, retain};
use crate::interpolate;
use crate::scene::Scene;
use crate::transform::{Transform, float_count};
use std::ffi::c_void;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;

/// Adds a reference to a geometry.
///
/// # Safety
/// The handle is null or lives.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub unsafe extern "C" fn rtcRetainGeometry(geometry: Handle) {
    // SAFETY: the contract is the same.
    unsafe { retain::<Geometry>(geometry) }.unwrap_or_else(|failure| report_without_device(&failure));
}

/// Removes a reference to a geometry.
///
/// # Safety
/// The handle is null or lives, and the program owns a reference.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub unsafe extern "C" fn rtcReleaseGeometry(geometry: Handle) {
    // SAFETY: the contract is the same.
    unsafe { release::<Geometry>(geometry) }.unwrap_or_else(|failure| report_without_device(&failure));
}

/// Shows a view to the other library, where that holds the geometry.
fn forward_buffer(geometry: &Geometry, kind: u32, slot: u32, view: &View) {
    if !geometry.is_known() {
        geometry.forward(|f, twin| {
            let (data, stride, count) = (view.data(), view.stride, view.count);
            // SAFETY: the geometry lives; the buffer is as the program declared it.
            unsafe { (f.rtcSetSharedGeometryBuffer)(twin, kind, slot, view.format, data, 0, stride, count) };
        });
    }
}

/// Makes a new buffer for a geometry.
fn new_buffer(
    geometry: &Geometry,
    (kind, slot, format): (u32, u32, u32),
    stride: usize,
    count: usize,
) -> Result<*mut c_void> {
    let bytes = stride.checked_mul(count).filter(|bytes| *bytes <= isize::MAX as usize);
    let Some(bytes) = bytes else { return argument("buffer too large") };
    let buffer = Shared::new(Buffer::new(&geometry.device, bytes)?);
    let view = geometry.set_buffer((kind, slot, format), &buffer, [0, stride, count])?;
    forward_buffer(geometry, kind, slot, &view);
    Ok(buffer.data())
}

/// Sets the program's memory as a buffer of a geometry.
fn share_buffer(
    geometry: &Geometry,
    (kind, slot, format): (u32, u32, u32),
    data: *const c_void,
    place: [usize; 3],
) -> Result<()> {
    let buffer =
        Shared::new(Buffer::shared(&geometry.device, data.cast_mut(), place[0] + place[1] * place[2]));
    let view = geometry.set_buffer((kind, slot, format), &buffer, place)?;
    forward_buffer(geometry, kind, slot, &view);
    Ok(())
}

/// A change of something that meshes of both libraries have.
macro_rules! set {
    ($geometry:ident, $function:ident($($argument:expr),*)) => {
        if !$geometry.is_known() {
            // SAFETY: the geometry lives; the arguments are the program's.
            $geometry.forward(|f, twin| unsafe { (f.$function)(twin $(, $argument)*) });
        }
    };
}

exports! {
    /// Makes a geometry.
    fn rtcNewGeometry(device: Device, kind: u32) -> Handle {
        Ok(give(Shared::new(Geometry::new(device, kind)?)))
    }

    /// Commits a geometry.
    fn rtcCommitGeometry(geometry: Geometry) {
        set!(geometry, rtcCommitGeometry());
        geometry.commit()
    }

    /// Lets rays hit a geometry.
    fn rtcEnableGeometry(geometry: Geometry) {
        geometry.enabled.store(true, Relaxed);
        Ok(())
    }

    /// Keeps rays from hitting a geometry, from the next commit of the scene on.
    fn rtcDisableGeometry(geometry: Geometry) {
        geometry.enabled.store(false, Relaxed);
        Ok(())
    }

    /// Sets the number of time steps.
    fn rtcSetGeometryTimeStepCount(geometry: Geometry, count: u32) {
        if count == 0 || count > MAX_TIME_STEPS {
            return argument(format!("number of time steps is out of range: 1 to {MAX_TIME_STEPS}, found {count}"));
        }
        set!(geometry, rtcSetGeometryTimeStepCount(count));
        let mut state = geometry.change();
        state.time_steps = count;
        state.transforms.resize(count as usize, Transform::IDENTITY);
        Ok(())
    }

    /// Sets the range of times of the time steps.
    fn rtcSetGeometryTimeRange(geometry: Geometry, start: f32, end: f32) {
        // NaN is refused, too.
        if start <= end {
            set!(geometry, rtcSetGeometryTimeRange(start, end));
            geometry.change().time_range = [start, end];
            return Ok(());
        }
        argument("startTime has to be smaller or equal to the endTime")
    }

    /// Sets the number of attributes of vertices.
    fn rtcSetGeometryVertexAttributeCount(geometry: Geometry, count: u32) {
        set!(geometry, rtcSetGeometryVertexAttributeCount(count));
        geometry.change().attributes = count;
        Ok(())
    }

    /// Sets the mask that is compared with the masks of rays.
    fn rtcSetGeometryMask(geometry: Geometry, mask: u32) {
        set!(geometry, rtcSetGeometryMask(mask));
        let _changed = geometry.change();
        geometry.mask.store(mask, Relaxed);
        Ok(())
    }

    /// Sets how much building may take.
    fn rtcSetGeometryBuildQuality(geometry: Geometry, quality: u32) {
        if quality > QUALITY_REFIT {
            return operation("invalid build quality");
        }
        set!(geometry, rtcSetGeometryBuildQuality(quality));
        geometry.change().quality = quality;
        Ok(())
    }

    /// Sets a part of a buffer as a buffer of a geometry.
    fn rtcSetGeometryBuffer(geometry: Geometry, kind: u32, slot: u32, format: u32, buffer: Handle, offset: usize, stride: usize, count: usize) {
        // SAFETY: by contract the handle is null or lives.
        let buffer = unsafe { borrow::<Buffer>(buffer)? };
        if !Arc::ptr_eq(&buffer.device, &geometry.device) {
            return argument("inputs are from different devices");
        }
        let view = geometry.set_buffer((kind, slot, format), &buffer, [offset, stride, count])?;
        forward_buffer(geometry, kind, slot, &view);
        Ok(())
    }

    /// Sets memory of the program as a buffer of a geometry.
    fn rtcSetSharedGeometryBuffer(geometry: Geometry, kind: u32, slot: u32, format: u32, data: *const c_void, offset: usize, stride: usize, count: usize) {
        share_buffer(geometry, (kind, slot, format), data, [offset, stride, count])
    }

    /// Sets memory of the program as a buffer of a geometry.
    fn rtcSetSharedGeometryBufferHostDevice(geometry: Geometry, kind: u32, slot: u32, format: u32, data: *const c_void, on_device: *const c_void, offset: usize, stride: usize, count: usize) {
        if !on_device.is_null() {
            return argument("the device has no memory of its own: the pointer to it must be null");
        }
        share_buffer(geometry, (kind, slot, format), data, [offset, stride, count])
    }

    /// Makes a buffer of a geometry.
    fn rtcSetNewGeometryBuffer(geometry: Geometry, kind: u32, slot: u32, format: u32, stride: usize, count: usize) -> *mut c_void {
        new_buffer(geometry, (kind, slot, format), stride, count)
    }

    /// Makes a buffer of a geometry.
    fn rtcSetNewGeometryBufferHostDevice(geometry: Geometry, kind: u32, slot: u32, format: u32, stride: usize, count: usize, data: *mut *mut c_void, on_device: *mut *mut c_void) {
        let made = new_buffer(geometry, (kind, slot, format), stride, count)?;
        for out in [data, on_device] {
            // SAFETY: by contract it is null or valid for writes.
            if let Some(out) = unsafe { out.as_mut() } {
                *out = made;
            }
        }
        Ok(())
    }

    /// The memory of a buffer of a geometry.
    fn rtcGetGeometryBufferData(geometry: Geometry, kind: u32, slot: u32) -> *mut c_void {
        let data = geometry.state().view(kind, slot).map(|view| view.data().cast_mut());
        data.map_or_else(|| argument(format!("no buffer {kind} in slot {slot}")), Ok)
    }

    /// The memory of a buffer of a geometry.
    fn rtcGetGeometryBufferDataDevice(geometry: Geometry, kind: u32, slot: u32) -> *mut c_void {
        let data = geometry.state().view(kind, slot).map(|view| view.data().cast_mut());
        data.map_or_else(|| argument(format!("no buffer {kind} in slot {slot}")), Ok)
    }

    /// Says that the program wrote to a buffer.
    fn rtcUpdateGeometryBuffer(geometry: Geometry, kind: u32, slot: u32) {
        if geometry.is_known() && geometry.state().view(kind, slot).is_none() {
            return argument(format!("no buffer {kind} in slot {slot}"));
        }
        set!(geometry, rtcUpdateGeometryBuffer(kind, slot));
        let _changed = geometry.change();
        Ok(())
    }

    /// Sets the filter of nearest hits.
    fn rtcSetGeometryIntersectFilterFunction(geometry: Geometry, filter: *const c_void) {
        if geometry.is_instance() {
            return operation("filter functions not supported for this geometry");
        }
        set!(geometry, rtcSetGeometryIntersectFilterFunction(filter));
        geometry.intersect_filter.set(filter);
        Ok(())
    }

    /// Sets the filter of any hits.
    fn rtcSetGeometryOccludedFilterFunction(geometry: Geometry, filter: *const c_void) {
        if geometry.is_instance() {
            return operation("filter functions not supported for this geometry");
        }
        set!(geometry, rtcSetGeometryOccludedFilterFunction(filter));
        geometry.occluded_filter.set(filter);
        Ok(())
    }

    /// Lets filters in the arguments of queries apply to a geometry.
    fn rtcSetGeometryEnableFilterFunctionFromArguments(geometry: Geometry, enable: bool) {
        set!(geometry, rtcSetGeometryEnableFilterFunctionFromArguments(enable));
        geometry.takes_argument_filter.store(enable, Relaxed);
        Ok(())
    }

    /// Keeps a pointer of the program.
    fn rtcSetGeometryUserData(geometry: Geometry, data: *mut c_void) {
        set!(geometry, rtcSetGeometryUserData(data));
        geometry.user.store(data, Relaxed);
        Ok(())
    }

    /// The pointer that the program keeps in a geometry.
    fn rtcGetGeometryUserData(geometry: Geometry) -> *mut c_void { Ok(geometry.user.load(Relaxed)) }

    /// Sets the function of point queries.
    fn rtcSetGeometryPointQueryFunction(geometry: Geometry, function: *const c_void) {
        set!(geometry, rtcSetGeometryPointQueryFunction(function));
        geometry.point_query.set(function);
        Ok(())
    }

    /// Sets the scene of an instance.
    fn rtcSetGeometryInstancedScene(geometry: Geometry, scene: Handle) {
        set_scenes(geometry, &[scene])
    }

    /// Sets the scenes of an array of instances.
    fn rtcSetGeometryInstancedScenes(geometry: Geometry, scenes: *mut Handle, count: usize) {
        if scenes.is_null() {
            return argument("scenes must not be null");
        }
        // SAFETY: it is not null, so by contract it has `count` elements.
        set_scenes(geometry, unsafe { std::slice::from_raw_parts(scenes, count) })
    }

    /// Sets the transform of an instance at a time step.
    fn rtcSetGeometryTransform(geometry: Geometry, step: u32, format: u32, numbers: *const c_void) {
        if format == FORMAT_QUATERNION || numbers.is_null() {
            return operation("invalid matrix format");
        }
        // SAFETY: by contract the numbers of the format are there.
        let read = |i: usize| unsafe { numbers.cast::<f32>().add(i).read_unaligned() };
        set_transform(geometry, step, Transform::read(format, read))
    }

    /// Sets the transform of an instance at a time step, decomposed.
    fn rtcSetGeometryTransformQuaternion(geometry: Geometry, step: u32, numbers: *const c_void) {
        if numbers.is_null() {
            return argument("the decomposition must not be null");
        }
        // SAFETY: by contract its numbers are there.
        let read = |i: usize| unsafe { numbers.cast::<f32>().add(i).read_unaligned() };
        set_transform(geometry, step, Transform::read(FORMAT_QUATERNION, read))
    }

    /// The transform of an instance at a time.
    fn rtcGetGeometryTransform(geometry: Geometry, time: f32, format: u32, numbers: *mut c_void) {
        get_transform(geometry, 0, time, format, numbers)
    }

    /// The transform of an instance of an array at a time.
    fn rtcGetGeometryTransformEx(geometry: Geometry, index: u32, time: f32, format: u32, numbers: *mut c_void) {
        get_transform(geometry, index, time, format, numbers)
    }

    /// The transform of an instance of a scene at a time.
    fn rtcGetGeometryTransformFromScene(scene: Scene, id: u32, time: f32, format: u32, numbers: *mut c_void) {
        match scene.geometry(id) {
            Some(geometry) => get_transform(&geometry, 0, time, format, numbers),
            None => argument(format!("invalid geometry ID {id}")),
        }
    }

    /// The transform of an instance of a scene at a time.
    fn rtcGetGeometryTransformFromTraversable(scene: Scene, id: u32, time: f32, format: u32, numbers: *mut c_void) {
        match scene.geometry(id) {
            Some(geometry) => get_transform(&geometry, 0, time, format, numbers),
            None => argument(format!("invalid geometry ID {id}")),
        }
    }
}

fn set_scenes(geometry: &Geometry, handles: &[Handle]) -> Result<()> {
    if !geometry.is_instance() {
        return operation("operation only allowed for instances");
    }
    let mut scenes = Vec::with_capacity(handles.len());
    for handle in handles {
        if handle.is_null() {
            scenes.push(None);
            continue;
        }
        // SAFETY: by contract the handle lives.
        let scene: Arc<Shared<Scene>> = Arc::clone(&*unsafe { borrow::<Scene>(*handle)? });
        scenes.push(Some(scene as Arc<dyn Instanced>));
    }
    geometry.change().scenes = scenes;
    Ok(())
}

fn set_transform(geometry: &Geometry, step: u32, transform: Option<Transform>) -> Result<()> {
    if geometry.kind != INSTANCE {
        return operation("operation only allowed for instances");
    }
    let Some(transform) = transform else { return operation("invalid matrix format") };
    let mut state = geometry.change();
    match state.transforms.get_mut(step as usize) {
        Some(slot) => {
            *slot = transform;
            Ok(())
        }
        None => operation(format!("invalid time step {step}")),
    }
}

fn get_transform(geometry: &Geometry, index: u32, time: f32, format: u32, out: *mut c_void) -> Result<()> {
    if !geometry.is_instance() {
        return operation("operation only allowed for instances");
    }
    if geometry.state().time_steps > 1 {
        let twin = geometry.twin(true);
        let (Some(fallback), false) = (&geometry.device.fallback, twin.is_null()) else {
            return unsupported("a transform that moves");
        };
        // SAFETY: the geometry lives, and by contract the numbers have room.
        unsafe { (fallback.functions.rtcGetGeometryTransformEx)(twin, index, time, format, out) };
        return Ok(());
    }
    let rows = geometry.transform(index).map(|transform| transform.rows());
    let Some(rows) = rows else { return argument(format!("no instance {index}")) };
    let Some(numbers) = Transform::write(&rows, format) else { return operation("invalid matrix format") };
    debug_assert_eq!(Some(numbers.len()), float_count(format));
    // SAFETY: by contract there is room for the numbers of the format.
    unsafe { std::ptr::copy_nonoverlapping(numbers.as_ptr(), out.cast(), numbers.len()) };
    Ok(())
}

/// Interpolates what vertices have.
///
/// # Safety
/// The structure is as the documentation of Embree 4 asks.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub unsafe extern "C" fn rtcInterpolate(arguments: *const InterpolateArguments) {
    // SAFETY: the contract is the same.
    unsafe {
        let Some(arguments) = arguments.as_ref() else { return };
        super::call::<Geometry, _>(arguments.geometry, |geometry| {
            interpolate_one(geometry, arguments);
            Ok(())
        });
    }
}

/// Interpolates for one point, in the other library where that holds the geometry.
///
/// # Safety
/// The structure is as the documentation of Embree 4 asks.
unsafe fn interpolate_one(geometry: &Geometry, arguments: &InterpolateArguments) {
    if geometry.is_known() {
        // SAFETY: the contract is the same.
        return unsafe { interpolate::interpolate(geometry, arguments) };
    }
    geometry.forward(|f, twin| {
        let &InterpolateArguments { primitive, u, v, buffer, slot, out, count, .. } = arguments;
        let moved = InterpolateArguments { geometry: twin, primitive, u, v, buffer, slot, out, count };
        // SAFETY: the geometry lives; the rest is the program's.
        unsafe { (f.rtcInterpolate)(&moved) };
    });
}

/// Interpolates for many points.
///
/// # Safety
/// The structure is as the documentation of Embree 4 asks.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub unsafe extern "C" fn rtcInterpolateN(arguments: *const InterpolateManyArguments) {
    // SAFETY: the contract is the same.
    unsafe {
        let Some(arguments) = arguments.as_ref() else { return };
        super::call::<Geometry, _>(arguments.geometry, |geometry| {
            if arguments.count > 256 {
                return operation("maximally 256 floating point values can be interpolated per vertex");
            }
            interpolate::many(arguments, |one| interpolate_one(geometry, one));
            Ok(())
        });
    }
}

/// The pointer that the program keeps in a geometry of a scene.
///
/// # Safety
/// The handle lives and is one of a committed scene.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub unsafe extern "C" fn rtcGetGeometryUserDataFromScene(scene: Handle, id: u32) -> *mut c_void {
    // SAFETY: by contract the handle lives.
    if !unsafe { is_ours::<Scene>(scene) } {
        return std::ptr::null_mut();
    }
    // SAFETY: it is one of ours and lives.
    let scene = unsafe { crate::handles::object::<Scene>(scene) };
    // Programs call this with every hit.
    let known =
        scene.committed().filter(|_| !scene.is_changed()).and_then(|committed| committed.geometry(id));
    let user = |geometry: &Arc<Shared<Geometry>>| geometry.user.load(Relaxed);
    known.map_or_else(|| scene.geometry(id).as_ref().map_or(std::ptr::null_mut(), user), user)
}

/// The pointer that the program keeps in a geometry of a scene.
///
/// # Safety
/// The handle lives and is one of a committed scene.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub unsafe extern "C" fn rtcGetGeometryUserDataFromTraversable(scene: Handle, id: u32) -> *mut c_void {
    // SAFETY: the contract is the same.
    unsafe { rtcGetGeometryUserDataFromScene(scene, id) }
}
