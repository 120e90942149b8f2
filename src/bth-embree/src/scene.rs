//! Scenes: the geometries that a program attaches, and what a commit makes of them.
#![allow(unsafe_code)] // Rays read what the last commit made without a lock.

use crate::abi::*;
use crate::committed::Committed;
use crate::device::{Callback, Device, lock};
use crate::error::{Result, operation};
use crate::geometry::{Geometry, Instanced};
use crate::handles::{Shared, Tagged};
use crate::mesh::Mesh;
use crate::twin::TwinScene;
use std::any::Any;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicPtr, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};

/// The geometries of a scene, by id.
pub(crate) type Geometries = BTreeMap<u32, Arc<Shared<Geometry>>>;

/// A scene.
#[derive(Debug)]
pub(crate) struct Scene {
    pub(crate) device: Arc<Shared<Device>>,
    /// `RTC_SCENE_FLAG_*`.
    pub(crate) flags: AtomicU32,
    pub(crate) quality: AtomicU32,
    geometries: Mutex<Geometries>,
    /// True if geometries came or went since the last commit.
    changed: AtomicBool,
    pub(crate) progress: Mutex<Option<Callback<ProgressFunction>>>,
    /// Taken during a commit.
    pub(crate) commit: Mutex<()>,
    committed: AtomicPtr<Committed>,
    /// What the other library has of the scene.
    twins: Mutex<Twins>,
}

/// Scenes of the other library.
#[derive(Debug, Default)]
struct Twins {
    /// What bth does not hold.
    rest: Option<TwinScene>,
    /// All, for instances that move and for callbacks of user geometry.
    whole: Option<TwinScene>,
    /// True if `whole` shows the scene as it was last committed.
    whole_is_fresh: bool,
}

/// A scene of the other library by its handle and the number of its commits.
fn named(twin: Option<&TwinScene>) -> (Handle, u64) {
    twin.map_or((std::ptr::null_mut(), 0), |twin| (twin.handle, twin.commits))
}

impl Tagged for Scene {
    const TAG: u64 = 0x6274_6873_6365_6E01;
}

impl Drop for Scene {
    fn drop(&mut self) {
        self.put(None);
    }
}

impl Scene {
    pub(crate) fn new(device: &Arc<Shared<Device>>) -> Scene {
        Scene {
            device: device.clone(),
            flags: AtomicU32::new(0),
            quality: AtomicU32::new(QUALITY_MEDIUM),
            geometries: Mutex::default(),
            changed: AtomicBool::new(true),
            progress: Mutex::default(),
            commit: Mutex::default(),
            committed: AtomicPtr::default(),
            twins: Mutex::default(),
        }
    }

    /// What the last commit made; `None` before the first.
    ///
    /// Programs must not trace rays during a commit, so it lives for the call that reads it.
    #[inline(always)]
    pub(crate) fn committed(&self) -> Option<&Committed> {
        // SAFETY: it is null or was leaked by `put`, which frees it only during a commit or at the
        // end of the scene; by the documentation nobody uses it then.
        unsafe { self.committed.load(Ordering::Acquire).as_ref() }
    }

    /// Replaces what the last commit made.
    pub(crate) fn put(&self, committed: Option<Box<Committed>>) {
        self.changed.store(false, Ordering::Release);
        let new = committed.map_or(std::ptr::null_mut(), Box::into_raw);
        let old = self.committed.swap(new, Ordering::AcqRel);
        if !old.is_null() {
            // SAFETY: it was leaked by this function, and is not reachable any more.
            let old = unsafe { Box::from_raw(old) };
            self.device.memory(-(old.bytes() as isize), true);
        }
    }

    /// The triangles of the last commit.
    pub(crate) fn mesh(&self) -> Option<Arc<Mesh>> {
        self.committed().map(|committed| committed.own.clone())
    }

    pub(crate) fn has_flag(&self, flag: u32) -> bool {
        self.flags.load(Ordering::Relaxed) & flag != 0
    }

    /// Adds a geometry under an id, or under the lowest free one; returns the id.
    ///
    /// # Errors
    /// If the id is taken, or the geometry is of another device.
    pub(crate) fn attach(&self, geometry: &Arc<Shared<Geometry>>, id: Option<u32>) -> Result<u32> {
        if !Arc::ptr_eq(&self.device, &geometry.device) {
            return crate::error::argument("inputs are from different devices");
        }
        let mut geometries = lock(&self.geometries);
        let free = || (0..INVALID_ID).zip(geometries.keys()).find(|(id, taken)| id != *taken);
        let id = id.unwrap_or_else(|| free().map_or(geometries.len() as u32, |(id, _)| id));
        if id == INVALID_ID || geometries.contains_key(&id) {
            return operation(format!("invalid geometry ID provided: {id} is taken"));
        }
        geometries.insert(id, geometry.clone());
        self.changed.store(true, Ordering::Release);
        Ok(id)
    }

    /// Removes a geometry.
    ///
    /// # Errors
    /// If there is no geometry of this id.
    pub(crate) fn detach(&self, id: u32) -> Result<()> {
        let removed = lock(&self.geometries).remove(&id);
        self.changed.store(true, Ordering::Release);
        removed.map_or_else(|| operation(format!("invalid geometry ID {id}")), |_| Ok(()))
    }

    /// Returns true if geometries came or went since the last commit.
    pub(crate) fn is_changed(&self) -> bool {
        self.changed.load(Ordering::Acquire)
    }

    /// A geometry by its id.
    pub(crate) fn geometry(&self, id: u32) -> Option<Arc<Shared<Geometry>>> {
        lock(&self.geometries).get(&id).cloned()
    }

    /// The enabled geometries.
    pub(crate) fn enabled(&self) -> Geometries {
        let mut enabled = lock(&self.geometries).clone();
        enabled.retain(|_, geometry| geometry.is_enabled());
        enabled
    }

    /// Shows the other library what bth does not hold; returns its scene, or null.
    pub(crate) fn show_rest(&self, rest: BTreeMap<u32, Handle>) -> Handle {
        let Some(fallback) = &self.device.fallback else { return std::ptr::null_mut() };
        let (flags, quality) = (self.flags.load(Ordering::Relaxed), self.quality.load(Ordering::Relaxed));
        let mut twins = lock(&self.twins);
        twins.whole_is_fresh = false;
        if rest.is_empty() {
            twins.rest = None;
            return std::ptr::null_mut();
        }
        let twin = twins.rest.get_or_insert_with(|| TwinScene::new(fallback));
        twin.show(rest, flags, quality);
        twin.handle
    }

    /// The bounds of what the other library shows.
    pub(crate) fn twin_bounds(&self) -> Bounds {
        lock(&self.twins).rest.as_ref().map_or(Bounds::EMPTY, TwinScene::bounds)
    }
}

impl Instanced for Shared<Scene> {
    fn triangles(&self) -> Option<Arc<dyn Any + Send + Sync>> {
        self.mesh().map(|mesh| mesh as Arc<dyn Any + Send + Sync>)
    }

    fn twin(&self) -> (Handle, u64) {
        named(lock(&self.twins).rest.as_ref())
    }

    fn whole_twin(&self) -> (Handle, u64) {
        let Some(fallback) = &self.device.fallback else { return named(None) };
        let known = {
            let twins = lock(&self.twins);
            named(twins.whole.as_ref().filter(|_| twins.whole_is_fresh))
        };
        if !known.0.is_null() {
            return known;
        }
        let all: BTreeMap<u32, Handle> =
            self.enabled().into_iter().map(|(id, geometry)| (id, geometry.twin(true))).collect();
        let (flags, quality) = (self.flags.load(Ordering::Relaxed), self.quality.load(Ordering::Relaxed));
        let mut twins = lock(&self.twins);
        let twin = twins.whole.get_or_insert_with(|| TwinScene::new(fallback));
        twin.show(all, flags, quality);
        let shown = named(Some(twin));
        twins.whole_is_fresh = true;
        shown
    }
}
