//! What another library holds of a geometry or a scene that bth does not answer alone.
#![allow(unsafe_code)] // Calls the other library.

use crate::abi::*;
use crate::fallback::{Fallback, Functions};
use crate::geometry::Geometry;
use crate::handles::Shared;
use crate::scene::Scene;
use crate::transform::Transform;
use std::collections::BTreeMap;
use std::sync::atomic::Ordering::Relaxed;

/// A geometry of the other library.
#[derive(Debug)]
pub(crate) struct TwinGeometry {
    pub(crate) functions: &'static Functions,
    pub(crate) handle: Handle,
    /// The commit of the geometry that it shows.
    version: u64,
    /// The scenes that it instances, each with the number of its commits.
    scenes: Vec<(Handle, u64)>,
}

// SAFETY: a geometry may be used from any thread, and is changed under the lock of its owner.
unsafe impl Send for TwinGeometry {}

impl Drop for TwinGeometry {
    fn drop(&mut self) {
        // SAFETY: the reference is ours and released once.
        unsafe { (self.functions.rtcReleaseGeometry)(self.handle) };
    }
}

impl TwinGeometry {
    /// A new geometry; `None` if the library makes none of this kind.
    pub(crate) fn new(fallback: &Fallback, kind: u32) -> Option<TwinGeometry> {
        let functions = fallback.functions;
        // SAFETY: the device lives.
        let handle = unsafe { (functions.rtcNewGeometry)(fallback.device, kind) };
        (!handle.is_null()).then_some(TwinGeometry { functions, handle, version: 0, scenes: Vec::new() })
    }
}

impl Geometry {
    /// Calls the other library with its geometry, if it has one.
    pub(crate) fn forward<T>(&self, call: impl FnOnce(&Functions, Handle) -> T) -> Option<T> {
        let twin = self.state().twin.as_ref().map(|twin| (twin.functions, twin.handle));
        twin.map(|(functions, handle)| call(functions, handle))
    }

    /// The geometry of the other library, as it was last committed here; null if there is none.
    /// `whole`: an instance shows whole scenes there, not only what bth does not hold.
    pub(crate) fn twin(&self, whole: bool) -> Handle {
        let Some(fallback) = &self.device.fallback else { return std::ptr::null_mut() };
        let mut state = self.state();
        if !self.is_known() {
            return state.twin.as_ref().map_or(std::ptr::null_mut(), |twin| twin.handle);
        }
        if state.twin.is_none() {
            state.twin = TwinGeometry::new(fallback, self.kind);
        }
        let version = state.version;
        let scenes: Vec<(Handle, u64)> =
            state.scenes.iter().map(|scene| twin_scene(scene.as_deref(), whole)).collect();
        let Some(twin) = &state.twin else { return std::ptr::null_mut() };
        let (f, handle) = (twin.functions, twin.handle);
        if twin.version == version && twin.scenes == scenes {
            return handle;
        }
        let mut handles: Vec<Handle> = scenes.iter().map(|scene| scene.0).collect();
        let first = handles.first().copied().unwrap_or(std::ptr::null_mut());
        // SAFETY: the geometry lives; buffers are as the program declared them, and it keeps them
        // as long as the geometry uses them.
        unsafe {
            (f.rtcSetGeometryTimeStepCount)(handle, state.time_steps);
            if state.time_steps > 1 {
                (f.rtcSetGeometryTimeRange)(handle, state.time_range[0], state.time_range[1]);
            }
            if state.attributes > 0 {
                (f.rtcSetGeometryVertexAttributeCount)(handle, state.attributes);
            }
            for (kind, slot, view) in state.views() {
                let set = f.rtcSetSharedGeometryBuffer;
                set(handle, *kind, *slot, view.format, view.data(), 0, view.stride, view.count);
            }
            match self.kind {
                INSTANCE => {
                    (f.rtcSetGeometryInstancedScene)(handle, first);
                    for (step, transform) in (0..).zip(&state.transforms) {
                        match transform {
                            Transform::Matrix(rows) => {
                                let rows = rows.as_ptr().cast();
                                (f.rtcSetGeometryTransform)(handle, step, FORMAT_3X4_ROWS, rows);
                            }
                            Transform::Quaternion(numbers) => {
                                #[repr(align(16))]
                                struct Aligned([f32; 16]);
                                let numbers = Aligned(*numbers);
                                let numbers = numbers.0.as_ptr().cast();
                                (f.rtcSetGeometryTransformQuaternion)(handle, step, numbers);
                            }
                        }
                    }
                }
                INSTANCE_ARRAY if state.view(BUFFER_INDEX, 0).is_none() => {
                    (f.rtcSetGeometryInstancedScene)(handle, first);
                }
                INSTANCE_ARRAY => {
                    (f.rtcSetGeometryInstancedScenes)(handle, handles.as_mut_ptr(), handles.len());
                }
                _ => {
                    (f.rtcSetGeometryIntersectFilterFunction)(handle, self.intersect_filter.get());
                    (f.rtcSetGeometryOccludedFilterFunction)(handle, self.occluded_filter.get());
                }
            }
            (f.rtcSetGeometryMask)(handle, self.mask.load(Relaxed));
            (f.rtcSetGeometryBuildQuality)(handle, state.quality);
            (f.rtcSetGeometryUserData)(handle, self.user.load(Relaxed));
            (f.rtcSetGeometryPointQueryFunction)(handle, self.point_query.get());
            let takes = self.takes_argument_filter.load(Relaxed);
            (f.rtcSetGeometryEnableFilterFunctionFromArguments)(handle, takes);
            (f.rtcCommitGeometry)(handle);
        }
        if let Some(twin) = &mut state.twin {
            (twin.version, twin.scenes) = (version, scenes);
        }
        handle
    }
}

/// The scene of the other library that shows an instanced scene, with the number of its commits.
fn twin_scene(scene: Option<&Shared<Scene>>, whole: bool) -> (Handle, u64) {
    scene.map_or((std::ptr::null_mut(), 0), |scene| match whole {
        true => scene.whole_twin(),
        false => scene.twin(),
    })
}

/// A scene of the other library.
#[derive(Debug)]
pub(crate) struct TwinScene {
    functions: &'static Functions,
    pub(crate) handle: Handle,
    /// The geometries that it shows, by id.
    attached: BTreeMap<u32, Handle>,
    /// Number of its commits.
    pub(crate) commits: u64,
}

// SAFETY: a scene may be used from any thread, and is changed under the lock of its owner.
unsafe impl Send for TwinScene {}

impl Drop for TwinScene {
    fn drop(&mut self) {
        // SAFETY: the reference is ours and released once.
        unsafe { (self.functions.rtcReleaseScene)(self.handle) };
    }
}

impl TwinScene {
    pub(crate) fn new(fallback: &Fallback) -> TwinScene {
        let functions = fallback.functions;
        // SAFETY: the device lives.
        let handle = unsafe { (functions.rtcNewScene)(fallback.device) };
        TwinScene { functions, handle, attached: BTreeMap::new(), commits: 0 }
    }

    /// Shows just these geometries, by id, and commits.
    pub(crate) fn show(&mut self, geometries: BTreeMap<u32, Handle>, flags: u32, quality: u32) {
        let f = self.functions;
        // SAFETY: the scene and the geometries live; a scene keeps those that are attached.
        unsafe {
            for (id, handle) in &self.attached {
                if geometries.get(id) != Some(handle) {
                    (f.rtcDetachGeometry)(self.handle, *id);
                }
            }
            for (id, handle) in &geometries {
                if self.attached.get(id) != Some(handle) {
                    (f.rtcAttachGeometryByID)(self.handle, *handle, *id);
                }
            }
            (f.rtcSetSceneFlags)(self.handle, flags);
            (f.rtcSetSceneBuildQuality)(self.handle, quality);
            (f.rtcCommitScene)(self.handle);
        }
        self.attached = geometries;
        self.commits += 1;
    }

    /// Its bounds, empty without geometry.
    pub(crate) fn bounds(&self) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        // SAFETY: the scene lives and was committed; the box is aligned.
        unsafe { (self.functions.rtcGetSceneBounds)(self.handle, &mut bounds) };
        bounds
    }
}
