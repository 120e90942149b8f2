//! Scenes.
#![allow(unsafe_code)] // Functions take pointers of the program.

use super::exports;
use crate::abi::*;
use crate::device::{Callback, Device, lock, report_without_device};
use crate::error::{argument, operation};
use crate::geometry::{Geometry, Instanced};
use crate::handles::{Shared, address, borrow, give, release, retain};
use crate::scene::Scene;
use std::ffi::c_void;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;

/// Adds a reference to a scene.
///
/// # Safety
/// The handle is null or lives.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub unsafe extern "C" fn rtcRetainScene(scene: Handle) {
    // SAFETY: the contract is the same.
    unsafe { retain::<Scene>(scene) }.unwrap_or_else(|failure| report_without_device(&failure));
}

/// Removes a reference to a scene.
///
/// # Safety
/// The handle is null or lives, and the program owns a reference.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub unsafe extern "C" fn rtcReleaseScene(scene: Handle) {
    // SAFETY: the contract is the same.
    unsafe { release::<Scene>(scene) }.unwrap_or_else(|failure| report_without_device(&failure));
}

exports! {
    /// Makes a scene.
    fn rtcNewScene(device: Device) -> Handle { Ok(give(Shared::new(Scene::new(device)))) }

    /// The device of a scene, with a reference.
    fn rtcGetSceneDevice(scene: Scene) -> Handle { Ok(give(scene.device.clone())) }

    /// What rays are traced through: the scene itself.
    fn rtcGetSceneTraversable(scene: Scene) -> Handle { Ok(address(scene)) }

    /// Adds a geometry to a scene, under the lowest free id, which is returned.
    fn rtcAttachGeometry(scene: Scene, geometry: Handle) -> u32 {
        // SAFETY: by contract the handle is null or lives.
        let geometry = unsafe { borrow::<Geometry>(geometry)? };
        scene.attach(&geometry, None)
    }

    /// Adds a geometry to a scene, under an id.
    fn rtcAttachGeometryByID(scene: Scene, geometry: Handle, id: u32) {
        // SAFETY: by contract the handle is null or lives.
        let geometry = unsafe { borrow::<Geometry>(geometry)? };
        scene.attach(&geometry, Some(id)).map(|_| ())
    }

    /// Removes a geometry from a scene.
    fn rtcDetachGeometry(scene: Scene, id: u32) { scene.detach(id) }

    /// A geometry of a scene, without a reference.
    fn rtcGetGeometry(scene: Scene, id: u32) -> Handle {
        let known = scene.committed().filter(|_| !scene.is_changed());
        match known.and_then(|committed| committed.geometry(id)) {
            Some(geometry) => Ok(address(geometry)),
            None => Ok(scene.geometry(id).as_ref().map_or(std::ptr::null_mut(), address)),
        }
    }

    /// A geometry of a scene, without a reference.
    fn rtcGetGeometryThreadSafe(scene: Scene, id: u32) -> Handle {
        Ok(scene.geometry(id).as_ref().map_or(std::ptr::null_mut(), address))
    }

    /// Commits a scene.
    fn rtcCommitScene(scene: Scene) { scene.commit() }

    /// Commits a scene from several threads: one does the work, the others wait for it.
    fn rtcJoinCommitScene(scene: Scene) { scene.commit() }

    /// Sets the function that hears how far a commit is.
    fn rtcSetSceneProgressMonitorFunction(scene: Scene, function: Option<ProgressFunction>, user: *mut c_void) {
        *lock(&scene.progress) = function.map(|function| Callback { function, user });
        Ok(())
    }

    /// Sets how much building may take.
    fn rtcSetSceneBuildQuality(scene: Scene, quality: u32) {
        if quality > QUALITY_HIGH {
            return operation("invalid build quality");
        }
        scene.quality.store(quality, Relaxed);
        Ok(())
    }

    /// Sets the flags of a scene.
    fn rtcSetSceneFlags(scene: Scene, flags: u32) {
        scene.flags.store(flags, Relaxed);
        Ok(())
    }

    /// The flags of a scene.
    fn rtcGetSceneFlags(scene: Scene) -> u32 { Ok(scene.flags.load(Relaxed)) }

    /// The bounds of a scene.
    fn rtcGetSceneBounds(scene: Scene, bounds: *mut Bounds) {
        let Some(committed) = scene.committed() else { return operation("scene not committed") };
        // SAFETY: by contract it is null or valid for writes.
        match unsafe { bounds.as_mut() } {
            Some(bounds) => *bounds = committed.bounds,
            None => return argument("bounds must not be null"),
        }
        Ok(())
    }

    /// The bounds of a scene at the start and at the end of its times.
    fn rtcGetSceneLinearBounds(scene: Scene, bounds: *mut [Bounds; 2]) {
        let Some(committed) = scene.committed() else { return operation("scene not committed") };
        // SAFETY: by contract it is null or valid for writes.
        let Some(bounds) = (unsafe { bounds.as_mut() }) else { return operation("invalid destination pointer") };
        *bounds = [committed.still_bounds; 2];
        let mut moving = [Bounds::EMPTY; 2];
        if let (Some(fallback), false) = (&scene.device.fallback, committed.rest.0.is_null()) {
            // SAFETY: the scene of the other library lives and was committed.
            unsafe { (fallback.functions.rtcGetSceneLinearBounds)(committed.rest.0, &mut moving) };
        }
        bounds.iter_mut().zip(&moving).for_each(|(bounds, moving)| bounds.join(moving));
        Ok(())
    }
}

/// Finds what of two scenes touches: by the other library.
///
/// # Safety
/// Handles are null or live, and pointers are as the documentation of Embree 4 asks.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub unsafe extern "C" fn rtcCollide(
    first: Handle,
    second: Handle,
    function: *const c_void,
    user: *mut c_void,
) {
    // SAFETY: the contract is the same.
    unsafe {
        super::call::<Scene, _>(first, |first| {
            let second: Arc<Shared<Scene>> = Arc::clone(&*borrow::<Scene>(second)?);
            let Some(fallback) = &first.device.fallback else {
                return crate::error::unsupported("rtcCollide");
            };
            (fallback.functions.rtcCollide)(first.whole_twin().0, second.whole_twin().0, function, user);
            Ok(())
        });
    }
}
