//! What another library holds of a geometry or a scene that bth does not answer alone.
#![allow(unsafe_code)] // Calls the other library.

use crate::abi::*;
use crate::fallback::{Fallback, Functions};
use std::collections::BTreeMap;

/// A geometry of the other library.
#[derive(Debug)]
pub(crate) struct TwinGeometry {
    pub(crate) functions: &'static Functions,
    pub(crate) handle: Handle,
    /// The commit of the geometry that it shows.
    pub(crate) version: u64,
    /// The scenes that it instances, each with the number of its commits.
    pub(crate) scenes: Vec<(Handle, u64)>,
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
