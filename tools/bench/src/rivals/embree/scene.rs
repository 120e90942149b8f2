//! Scenes of Embree: of one mesh, or of instances that can be placed for each frame.
#![allow(unsafe_code)]

use super::Variant;
use super::api::*;
use crate::tracer::{Batch, Starting, Tracer};
use anyhow::{Result, ensure};
use bth::rays::Hit;
use std::ffi::c_void;
use std::sync::atomic::{AtomicI64, AtomicPtr, AtomicUsize, Ordering};

/// A built scene.
pub(crate) struct EmbreeScene {
    api: &'static EmbreeApi,
    device: Handle,
    scene: Handle,
    packets: bool,
    own: bool,
    /// The scenes of the objects that `scene` has instances of.
    objects: Vec<Handle>,
    /// The geometries of `scene` that are instances.
    instances: Vec<Handle>,
    /// The library keeps pointers into these.
    _meshes: Vec<EmbreeMesh>,
    allocated: Box<AtomicI64>,
}

/// Positions and triangles. The positions must end with one more than the triangles use: the
/// library may read 16 bytes at the last.
pub(crate) type EmbreeMesh = (Vec<[f32; 3]>, Vec<[u32; 3]>);

/// The transform from object to world of an instance, in rows of four; `None` for one that is not
/// visible.
pub(crate) type InstancePlace = Option<[[f32; 4]; 3]>;

// SAFETY: the library's queries may run on any number of threads at once, and everything else is
// done by those who have the scene for themselves.
unsafe impl Send for EmbreeScene {}
// SAFETY: as above.
unsafe impl Sync for EmbreeScene {}

/// Called by the library for each allocation and release: adds up the bytes.
///
/// # Safety
/// `total` must point to an `AtomicI64`.
unsafe extern "C" fn count_bytes(total: Handle, bytes: isize, _after: bool) -> bool {
    // SAFETY: by the contract.
    unsafe { &*total.cast::<AtomicI64>() }.fetch_add(bytes as i64, Ordering::Relaxed);
    true
}

/// Builds a scene on `threads` threads; see [`EmbreeMesh`].
pub(crate) fn build(
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    variant: &Variant,
    threads: usize,
) -> Result<EmbreeScene> {
    let mut scene = EmbreeScene::new(vec![(positions, triangles)], variant, threads)?;
    scene.scene = scene.object(&scene._meshes[0], variant);
    scene.finished()
}

/// Builds the objects of a scene, several at once; instance i is an instance of `object_of[i]`,
/// once it has a transform ([`EmbreeScene::place`]).
pub(crate) fn build_instances(
    objects: Vec<EmbreeMesh>,
    object_of: &[u32],
    variant: &Variant,
    threads: usize,
) -> Result<EmbreeScene> {
    ensure!(object_of.iter().all(|o| (*o as usize) < objects.len()), "an instance of no object");
    let mut scene = EmbreeScene::new(objects, variant, threads)?;
    let handles: Vec<AtomicPtr<c_void>> = scene._meshes.iter().map(|_| AtomicPtr::default()).collect();
    let next = AtomicUsize::new(0);
    std::thread::scope(|scope| {
        let work = || {
            while let Some((mesh, handle)) =
                scene._meshes.iter().zip(&handles).nth(next.fetch_add(1, Ordering::Relaxed))
            {
                handle.store(scene.object(mesh, variant), Ordering::Relaxed);
            }
        };
        (1..threads).for_each(|_| drop(scope.spawn(work)));
        work();
    });
    scene.objects = handles.into_iter().map(AtomicPtr::into_inner).collect();
    let api = scene.api;
    // SAFETY: as for `object`; the objects are committed, and live as long as the scene of their
    // instances.
    unsafe {
        scene.scene = scene.empty(variant);
        for (row, object) in object_of.iter().enumerate() {
            let instance = (api.new_geometry)(scene.device, TYPE_INSTANCE);
            (api.instanced_scene)(instance, scene.objects[*object as usize]);
            (api.commit_geometry)(instance);
            let number = (api.attach_geometry)(scene.scene, instance);
            // The scene keeps it alive.
            (api.release_geometry)(instance);
            ensure!(number as usize == row, "the library numbers instances in another order");
            scene.instances.push(instance);
        }
    }
    scene.finished()
}

impl EmbreeScene {
    /// A device for these meshes, without scenes yet.
    fn new(meshes: Vec<EmbreeMesh>, variant: &Variant, threads: usize) -> Result<EmbreeScene> {
        let api = EmbreeApi::get()?;
        let fits = |(positions, triangles): &EmbreeMesh| {
            let count = positions.len().saturating_sub(1);
            triangles.iter().flatten().all(|v| (*v as usize) < count)
        };
        ensure!(meshes.iter().all(fits), "a triangle uses a position that does not exist");
        let allocated = Box::new(AtomicI64::new(0));
        let total: *const AtomicI64 = &raw const *allocated;
        let isa = variant.isa.map_or_else(String::new, |isa| format!(",max_isa={isa}"));
        let config = std::ffi::CString::new(format!("threads={threads}{isa}"))?;
        // SAFETY: the counter lives in the `EmbreeScene` until after the device is released: moving
        // a `Box` does not move what it points to.
        let device = unsafe {
            let device = (api.new_device)(config.as_ptr());
            ensure!(!device.is_null(), "the library makes no device");
            (api.monitor)(device, count_bytes, total.cast_mut().cast());
            device
        };
        let (scene, packets, own) = (std::ptr::null_mut(), variant.packets, variant.own);
        let (objects, instances) = (Vec::new(), Vec::new());
        Ok(EmbreeScene { api, device, scene, packets, own, objects, instances, _meshes: meshes, allocated })
    }

    /// A scene without geometries.
    ///
    /// # Safety
    /// It must be released before the device.
    unsafe fn empty(&self, variant: &Variant) -> Handle {
        // SAFETY: the device is there; the constants are the library's.
        unsafe {
            let scene = (self.api.new_scene)(self.device);
            (self.api.scene_flags)(scene, variant.flags);
            (self.api.scene_quality)(scene, variant.quality);
            scene
        }
    }

    /// A committed scene of a mesh of this one.
    fn object(&self, (positions, triangles): &EmbreeMesh, variant: &Variant) -> Handle {
        let (api, count_of_positions) = (self.api, positions.len().saturating_sub(1));
        // SAFETY: the calls are in the order and with the constants that the library's
        // documentation requires, which allows them from several threads for different scenes. The
        // buffers hold as many items as the calls pass, plus the padding that it requires, every
        // index is below the number of positions (checked by `new`), and all of it lives in the
        // `EmbreeScene` until after the device is released: moving a `Vec` does not move what it
        // points to.
        unsafe {
            let scene = self.empty(variant);
            let geometry = (api.new_geometry)(self.device, TYPE_TRIANGLE);
            (api.geometry_quality)(geometry, variant.quality);
            let (vertices, indices) = (positions.as_ptr().cast(), triangles.as_ptr().cast());
            let shared = api.shared_buffer;
            shared(geometry, BUFFER_VERTEX, 0, FORMAT_FLOAT3, vertices, 0, 12, count_of_positions);
            shared(geometry, BUFFER_INDEX, 0, FORMAT_UINT3, indices, 0, 12, triangles.len());
            (api.commit_geometry)(geometry);
            (api.attach_geometry)(scene, geometry);
            (api.release_geometry)(geometry);
            (api.commit_scene)(scene);
            scene
        }
    }

    /// Places all instances and builds the scene over them.
    pub(crate) fn place(&mut self, places: &[InstancePlace]) {
        for (instance, place) in self.instances.iter().zip(places) {
            // SAFETY: the instance is a geometry of the scene; the library copies twelve numbers in
            // rows.
            unsafe {
                match place {
                    Some(rows) => {
                        (self.api.transform)(*instance, 0, FORMAT_ROWS, rows.as_flattened().as_ptr());
                        (self.api.enable_geometry)(*instance);
                    }
                    None => (self.api.disable_geometry)(*instance),
                }
                (self.api.commit_geometry)(*instance);
            }
        }
        // SAFETY: no other thread traces, as `self` is borrowed mutably.
        unsafe { (self.api.commit_scene)(self.scene) };
    }

    /// What the library has allocated.
    pub(super) fn bytes(&self) -> Option<u64> {
        u64::try_from(self.allocated.load(Ordering::Relaxed)).ok()
    }

    fn finished(self) -> Result<EmbreeScene> {
        // SAFETY: the device is there.
        let error = unsafe { (self.api.device_error)(self.device) };
        ensure!(error == 0, "the library reports error {error}");
        Ok(self)
    }
}

impl Drop for EmbreeScene {
    fn drop(&mut self) {
        // SAFETY: all were made above and are released once; none is null.
        unsafe {
            for scene in std::iter::once(&self.scene).chain(&self.objects).filter(|s| !s.is_null()) {
                (self.api.release_scene)(*scene);
            }
            (self.api.release_device)(self.device);
        }
    }
}

impl Tracer for EmbreeScene {
    fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit]) {
        let instances = !self.objects.is_empty();
        if self.packets {
            packets(self.scene, batch, self.api.intersect16, |i, lanes, lane| {
                hits[i] = lanes.hit(lane, instances);
            });
        } else {
            singly(self.scene, batch, self.own, self.api.intersect1, |i, lane| {
                hits[i] = lane.hit(0, instances);
            });
        }
    }

    fn any(&self, batch: Batch<'_>, found: &mut [bool]) {
        if self.packets {
            packets(self.scene, batch, self.api.occluded16, |i, lanes, lane| found[i] = lanes.occluded(lane));
        } else {
            singly(self.scene, batch, self.own, self.api.occluded1, |i, lane| found[i] = lane.occluded(0));
        }
    }

    fn starting(&self) -> Starting {
        if self.own { Starting::RejectOwn } else { Starting::AtOrigin }
    }
}
