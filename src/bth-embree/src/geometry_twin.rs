//! Geometries in the other library: made and brought up to date when a scene needs them.
#![allow(unsafe_code)] // Calls the other library.

use crate::abi::*;
use crate::fallback::Functions;
use crate::geometry::{Geometry, Instanced};
use crate::transform::Transform;
use crate::twin::TwinGeometry;
use std::sync::atomic::Ordering::Relaxed;

impl Geometry {
    /// Calls the other library with its geometry, if there is one.
    pub(crate) fn forward<T>(&self, call: impl FnOnce(&Functions, Handle) -> T) -> Option<T> {
        let twin = self.state().twin.as_ref().map(|twin| (twin.functions, twin.handle));
        twin.map(|(functions, handle)| call(functions, handle))
    }

    /// The geometry of the other library, as it was last committed here; null without a library.
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
fn twin_scene(scene: Option<&dyn Instanced>, whole: bool) -> (Handle, u64) {
    scene.map_or((std::ptr::null_mut(), 0), |scene| match whole {
        true => scene.whole_twin(),
        false => scene.twin(),
    })
}
