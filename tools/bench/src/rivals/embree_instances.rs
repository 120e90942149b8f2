//! Embree's instances: a scene for each object, and one of instances that is committed anew for each frame.
#![allow(unsafe_code)]

use super::embree::{self, Api, FORMAT_ROWS, Handle, TYPE_INSTANCE, Variant};
use crate::tracer::{Batch, Tracer};
use anyhow::{Result, ensure};
use bth::rays::Hit;

/// Triangles of an object.
#[derive(Clone, Debug)]
pub struct Object {
    /// Positions, with one more at the end than triangles use (see [`embree::build`]).
    pub positions: Vec<[f32; 3]>,
    /// Rows of the positions.
    pub triangles: Vec<[u32; 3]>,
}

/// From an object to the world: rows of four; `None` where nothing is to be seen.
pub type Place = Option<[[f64; 4]; 3]>;

/// Objects and the instances of a frame.
pub struct Instances {
    api: &'static Api,
    device: Handle,
    scene: Handle,
    objects: Vec<Handle>,
    instances: Vec<Handle>,
    packets: bool,
    /// The library refers to these.
    _triangles: Vec<Object>,
}

// SAFETY: as for `embree::Scene`: queries may run on any number of threads, and all else takes `&mut self`.
unsafe impl Send for Instances {}
// SAFETY: as above.
unsafe impl Sync for Instances {}

impl Instances {
    /// Builds the objects on so many threads; instance i shows the object `object_of[i]`, once it has a place.
    ///
    /// # Errors
    /// If the library is missing or reports an error.
    pub fn new(
        objects: Vec<Object>,
        object_of: &[u32],
        variant: &Variant,
        threads: usize,
    ) -> Result<Instances> {
        let api = Api::get()?;
        for object in &objects {
            let used = object.positions.len().saturating_sub(1);
            let inside = object.triangles.iter().flatten().all(|v| (*v as usize) < used);
            ensure!(inside, "a triangle uses a position that does not exist");
        }
        ensure!(object_of.iter().all(|o| (*o as usize) < objects.len()), "an instance of no object");
        let config = std::ffi::CString::new(format!("threads={threads}"))?;
        // SAFETY: the calls are in the order and with the constants that the library's documentation asks for. The
        // buffers hold as many items as is said and the padding that it asks for, every index is below the number of
        // positions, and they live in the value until after the device is released.
        unsafe {
            let device = (api.new_device)(config.as_ptr());
            ensure!(!device.is_null(), "the library makes no device");
            let mut built = Instances {
                api,
                device,
                scene: (api.new_scene)(device),
                objects: Vec::new(),
                instances: Vec::new(),
                packets: variant.packets,
                _triangles: objects,
            };
            (api.scene_flags)(built.scene, variant.flags);
            for object in &built._triangles {
                let scene = (api.new_scene)(device);
                (api.scene_flags)(scene, variant.flags);
                (api.scene_quality)(scene, variant.quality);
                let geometry = (api.new_geometry)(device, embree::TYPE_TRIANGLE);
                (api.geometry_quality)(geometry, variant.quality);
                let (vertices, indices) = (object.positions.as_ptr(), object.triangles.as_ptr());
                let share = api.shared_buffer;
                let count = object.positions.len() - 1;
                share(
                    geometry,
                    embree::BUFFER_VERTEX,
                    0,
                    embree::FORMAT_FLOAT3,
                    vertices.cast(),
                    0,
                    12,
                    count,
                );
                let count = object.triangles.len();
                share(geometry, embree::BUFFER_INDEX, 0, embree::FORMAT_UINT3, indices.cast(), 0, 12, count);
                (api.commit_geometry)(geometry);
                (api.attach_geometry)(scene, geometry);
                (api.release_geometry)(geometry);
                (api.commit_scene)(scene);
                built.objects.push(scene);
            }
            for (row, object) in object_of.iter().enumerate() {
                let instance = (api.new_geometry)(device, TYPE_INSTANCE);
                (api.instanced_scene)(instance, built.objects[*object as usize]);
                (api.commit_geometry)(instance);
                let number = (api.attach_geometry)(built.scene, instance);
                // The scene keeps it alive.
                (api.release_geometry)(instance);
                ensure!(number as usize == row, "the library numbers instances in another order");
                built.instances.push(instance);
            }
            let error = (api.device_error)(device);
            ensure!(error == 0, "the library reports error {error}");
            Ok(built)
        }
    }

    /// Places all instances and builds the scene over them.
    pub fn place(&mut self, places: &[Place]) {
        for (instance, place) in self.instances.iter().zip(places) {
            // SAFETY: the instance is a geometry of the scene; the library copies twelve numbers.
            unsafe {
                match place {
                    Some(rows) => {
                        let rows = rows.map(|row| row.map(|x| x as f32));
                        (self.api.transform)(*instance, 0, FORMAT_ROWS, rows.as_flattened().as_ptr());
                        (self.api.enable_geometry)(*instance);
                    }
                    None => (self.api.disable_geometry)(*instance),
                }
                (self.api.commit_geometry)(*instance);
            }
        }
        // SAFETY: nobody traces: `self` is borrowed mutably.
        unsafe { (self.api.commit_scene)(self.scene) };
    }
}

impl Drop for Instances {
    fn drop(&mut self) {
        // SAFETY: all were made by `new` and are released once, the device last.
        unsafe {
            (self.api.release_scene)(self.scene);
            self.objects.iter().for_each(|scene| (self.api.release_scene)(*scene));
            (self.api.release_device)(self.device);
        }
    }
}

impl Tracer for Instances {
    fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit]) {
        let api = self.api;
        if self.packets {
            embree::packets(self.scene, batch, api.intersect16, |i, lanes, lane| {
                hits[i] = lanes.placed_hit(lane)
            });
        } else {
            embree::singly(self.scene, batch, api.intersect1, |i, lane| hits[i] = lane.placed_hit(0));
        }
    }

    fn any(&self, batch: Batch<'_>, found: &mut [bool]) {
        let api = self.api;
        if self.packets {
            embree::packets(self.scene, batch, api.occluded16, |i, lanes, lane| {
                found[i] = lanes.occluded(lane)
            });
        } else {
            embree::singly(self.scene, batch, api.occluded1, |i, lane| found[i] = lane.occluded(0));
        }
    }
}
