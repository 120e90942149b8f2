//! Embree 4 through its C interface (`embree4/rtcore.h`).
#![allow(unsafe_code)]

use super::library;
use crate::model::Model;
use crate::tracer::{Batch, Contender, Tracer};
use anyhow::{Result, ensure};
use bth::layout::NONE;
use bth::rays::{Hit, Ray, Surface};
use std::ffi::{c_char, c_int, c_void};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicI64, AtomicPtr, AtomicUsize, Ordering};
use std::time::Instant;

pub(super) type Handle = *mut c_void;
type Function = *const c_void;

/// How a scene is built and traced.
#[derive(Clone, Copy, Debug)]
pub struct Variant {
    pub(super) quality: c_int,
    pub(super) flags: c_int,
    pub(super) packets: bool,
}

const QUALITY_MEDIUM: c_int = 1;
const QUALITY_HIGH: c_int = 2;
const FLAG_COMPACT: c_int = 2;
const FLAG_ROBUST: c_int = 4;

/// What a caller gets who sets nothing; one ray a call.
pub const DEFAULT: Variant = Variant { quality: QUALITY_MEDIUM, flags: 0, packets: false };
/// The robust mode, which has no high quality; one ray a call.
pub const ROBUST: Variant = Variant { flags: FLAG_ROBUST, ..DEFAULT };
/// The mode that saves memory; one ray a call.
pub const COMPACT: Variant = Variant { flags: FLAG_COMPACT, ..DEFAULT };
/// High quality (spatial splits); 16 rays a call.
pub const PACKETS: Variant = Variant { quality: QUALITY_HIGH, flags: 0, packets: true };

pub(super) const TYPE_TRIANGLE: c_int = 0;
pub(super) const BUFFER_INDEX: c_int = 0;
pub(super) const BUFFER_VERTEX: c_int = 1;
pub(super) const FORMAT_UINT3: c_int = 0x5003;
pub(super) const FORMAT_FLOAT3: c_int = 0x9003;
pub(super) const TYPE_INSTANCE: c_int = 121;
pub(super) const FORMAT_ROWS: c_int = 0x9134;
const QUERY_COHERENT: c_int = 1 << 16;

/// `RTCRayHit` for one lane and `RTCRayHitN` for more; rays whose `RTCRay` part alone is used too.
#[repr(C, align(64))]
pub(super) struct RayHit<const N: usize> {
    origin: [[f32; N]; 3],
    near: [f32; N],
    direction: [[f32; N]; 3],
    time: [f32; N],
    far: [f32; N],
    mask: [u32; N],
    id: [u32; N],
    flags: [u32; N],
    normal: [[f32; N]; 3],
    u: [f32; N],
    v: [f32; N],
    primitive: [u32; N],
    geometry: [u32; N],
    /// Instance, and row in an instance array in libraries that were built with those.
    instance: [[u32; N]; 2],
}

impl<const N: usize> RayHit<N> {
    const EMPTY: Self = RayHit {
        origin: [[0.0; N]; 3],
        near: [0.0; N],
        direction: [[0.0; N]; 3],
        time: [0.0; N],
        far: [0.0; N],
        mask: [u32::MAX; N],
        id: [0; N],
        flags: [0; N],
        normal: [[0.0; N]; 3],
        u: [0.0; N],
        v: [0.0; N],
        primitive: [NONE; N],
        geometry: [NONE; N],
        instance: [[NONE; N]; 2],
    };

    #[inline(always)]
    fn set(&mut self, lane: usize, ray: &Ray) {
        for k in 0..3 {
            self.origin[k][lane] = ray.origin[k];
            self.direction[k][lane] = ray.direction[k];
        }
        (self.near[lane], self.far[lane]) = (ray.tmin, ray.tmax);
        self.geometry[lane] = NONE;
    }

    #[inline(always)]
    fn hit(&self, lane: usize) -> Hit {
        self.hit_of(lane, 0)
    }

    /// The hit of a lane in the instance that the library names.
    #[inline(always)]
    pub(super) fn placed_hit(&self, lane: usize) -> Hit {
        self.hit_of(lane, self.instance[0][lane])
    }

    #[inline(always)]
    fn hit_of(&self, lane: usize, instance: u32) -> Hit {
        if self.geometry[lane] == NONE {
            return Hit::MISS;
        }
        let surface = Surface { instance, triangle: self.primitive[lane] };
        Hit { t: self.far[lane], u: self.u[lane], v: self.v[lane], surface }
    }

    /// The library marks an occluded ray so.
    #[inline(always)]
    pub(super) fn occluded(&self, lane: usize) -> bool {
        self.far[lane] == f32::NEG_INFINITY
    }
}

/// `RTCIntersectArguments`, and `RTCOccludedArguments`, which is the same.
#[repr(C)]
pub(super) struct Arguments {
    flags: c_int,
    features: u32,
    context: Handle,
    filter: Function,
    callback: Function,
    /// In libraries that were built with a minimal width of curves.
    min_width: f32,
}

impl Arguments {
    fn new(coherent: bool) -> Self {
        Arguments {
            flags: if coherent { QUERY_COHERENT } else { 0 },
            features: u32::MAX,
            context: std::ptr::null_mut(),
            filter: std::ptr::null(),
            callback: std::ptr::null(),
            min_width: 0.0,
        }
    }
}

/// Which lanes of a packet hold rays: -1, else 0.
#[repr(C, align(64))]
pub(super) struct Lanes([c_int; 16]);

pub(super) type Trace1 = unsafe extern "C" fn(Handle, *mut RayHit<1>, *mut Arguments);
pub(super) type Trace16 = unsafe extern "C" fn(*const Lanes, Handle, *mut RayHit<16>, *mut Arguments);

pub(super) struct Api {
    pub(super) new_device: unsafe extern "C" fn(*const c_char) -> Handle,
    pub(super) release_device: unsafe extern "C" fn(Handle),
    pub(super) device_error: unsafe extern "C" fn(Handle) -> c_int,
    pub(super) monitor:
        unsafe extern "C" fn(Handle, unsafe extern "C" fn(Handle, isize, bool) -> bool, Handle),
    pub(super) new_scene: unsafe extern "C" fn(Handle) -> Handle,
    pub(super) release_scene: unsafe extern "C" fn(Handle),
    pub(super) scene_flags: unsafe extern "C" fn(Handle, c_int),
    pub(super) scene_quality: unsafe extern "C" fn(Handle, c_int),
    pub(super) commit_scene: unsafe extern "C" fn(Handle),
    pub(super) new_geometry: unsafe extern "C" fn(Handle, c_int) -> Handle,
    pub(super) geometry_quality: unsafe extern "C" fn(Handle, c_int),
    pub(super) shared_buffer:
        unsafe extern "C" fn(Handle, c_int, u32, c_int, *const c_void, usize, usize, usize),
    pub(super) commit_geometry: unsafe extern "C" fn(Handle),
    pub(super) attach_geometry: unsafe extern "C" fn(Handle, Handle) -> u32,
    pub(super) release_geometry: unsafe extern "C" fn(Handle),
    pub(super) intersect1: Trace1,
    pub(super) occluded1: Trace1,
    pub(super) intersect16: Trace16,
    pub(super) occluded16: Trace16,
    pub(super) instanced_scene: unsafe extern "C" fn(Handle, Handle),
    pub(super) transform: unsafe extern "C" fn(Handle, u32, c_int, *const f32),
    pub(super) enable_geometry: unsafe extern "C" fn(Handle),
    pub(super) disable_geometry: unsafe extern "C" fn(Handle),
}

impl Api {
    pub(super) fn get() -> Result<&'static Api> {
        static API: OnceLock<std::result::Result<Api, String>> = OnceLock::new();
        API.get_or_init(|| Api::load().map_err(|e| format!("{e:#}")))
            .as_ref()
            .map_err(|e| anyhow::anyhow!("{e}"))
    }

    fn load() -> Result<Api> {
        // SAFETY: EMBREE_LIB names Embree 4, whose initializers may run at any time, and whose
        // functions have the types above (rtcore_device.h, rtcore_scene.h, rtcore_geometry.h).
        // Occluded rays are passed as the `RTCRay` that a `RTCRayHit` begins with.
        unsafe {
            let library = library::load("EMBREE_LIB", "libembree4.so")?;
            Ok(Api {
                new_device: *library.get(b"rtcNewDevice\0")?,
                release_device: *library.get(b"rtcReleaseDevice\0")?,
                device_error: *library.get(b"rtcGetDeviceError\0")?,
                monitor: *library.get(b"rtcSetDeviceMemoryMonitorFunction\0")?,
                new_scene: *library.get(b"rtcNewScene\0")?,
                release_scene: *library.get(b"rtcReleaseScene\0")?,
                scene_flags: *library.get(b"rtcSetSceneFlags\0")?,
                scene_quality: *library.get(b"rtcSetSceneBuildQuality\0")?,
                commit_scene: *library.get(b"rtcCommitScene\0")?,
                new_geometry: *library.get(b"rtcNewGeometry\0")?,
                geometry_quality: *library.get(b"rtcSetGeometryBuildQuality\0")?,
                shared_buffer: *library.get(b"rtcSetSharedGeometryBuffer\0")?,
                commit_geometry: *library.get(b"rtcCommitGeometry\0")?,
                attach_geometry: *library.get(b"rtcAttachGeometry\0")?,
                release_geometry: *library.get(b"rtcReleaseGeometry\0")?,
                intersect1: *library.get(b"rtcIntersect1\0")?,
                occluded1: *library.get(b"rtcOccluded1\0")?,
                intersect16: *library.get(b"rtcIntersect16\0")?,
                occluded16: *library.get(b"rtcOccluded16\0")?,
                instanced_scene: *library.get(b"rtcSetGeometryInstancedScene\0")?,
                transform: *library.get(b"rtcSetGeometryTransform\0")?,
                enable_geometry: *library.get(b"rtcEnableGeometry\0")?,
                disable_geometry: *library.get(b"rtcDisableGeometry\0")?,
            })
        }
    }
}

/// Loads the library, so that a build that is timed does not.
///
/// # Errors
/// If it is missing.
pub fn available() -> Result<()> {
    Api::get().map(|_| ())
}

/// A built scene.
pub struct Scene {
    api: &'static Api,
    device: Handle,
    scene: Handle,
    packets: bool,
    /// Scenes that instances in `scene` show.
    objects: Vec<Handle>,
    /// The library refers to these.
    _meshes: Vec<Mesh>,
    allocated: Box<AtomicI64>,
}

/// Positions and triangles. The positions must end with one more than the triangles use: the library may read 16 bytes at
/// the last.
pub type Mesh = (Vec<[f32; 3]>, Vec<[u32; 3]>);

/// An object and the rows from its space to the world.
pub type Place = (u32, [[f32; 4]; 3]);

// SAFETY: the library's queries may run on any number of threads at once, and everything else is done
// by `build` and `drop`, which have the scene for themselves.
unsafe impl Send for Scene {}
// SAFETY: as above.
unsafe impl Sync for Scene {}

/// Adds up what the library allocates and frees.
///
/// # Safety
/// `total` must point to an `AtomicI64`.
unsafe extern "C" fn count(total: Handle, bytes: isize, _after: bool) -> bool {
    // SAFETY: by the contract.
    unsafe { &*total.cast::<AtomicI64>() }.fetch_add(bytes as i64, Ordering::Relaxed);
    true
}

/// Builds a scene on so many threads; see [`Mesh`].
///
/// # Errors
/// If the library is missing or reports an error.
pub fn build(
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    variant: &Variant,
    threads: usize,
) -> Result<Scene> {
    let mut scene = Scene::new(vec![(positions, triangles)], variant, threads)?;
    scene.scene = scene.object(&scene._meshes[0], variant);
    scene.finished()
}

/// Builds the objects of a scene, several at once, and their instances.
///
/// # Errors
/// As [`build`]; if a place names no object.
pub fn build_instances(
    objects: Vec<Mesh>,
    places: &[Place],
    variant: &Variant,
    threads: usize,
) -> Result<Scene> {
    ensure!(places.iter().all(|(object, _)| (*object as usize) < objects.len()), "a place without object");
    let mut scene = Scene::new(objects, variant, threads)?;
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
    // SAFETY: as for `object`; the objects are committed, and live as long as the scene that shows them. The library copies
    // a transform of twelve numbers in rows.
    unsafe {
        scene.scene = scene.empty(variant);
        for (object, rows) in places {
            let geometry = (api.new_geometry)(scene.device, TYPE_INSTANCE);
            (api.instanced_scene)(geometry, scene.objects[*object as usize]);
            (api.transform)(geometry, 0, FORMAT_ROWS, rows.as_ptr().cast());
            (api.commit_geometry)(geometry);
            (api.attach_geometry)(scene.scene, geometry);
            (api.release_geometry)(geometry);
        }
        (api.commit_scene)(scene.scene);
    }
    scene.finished()
}

impl Scene {
    /// Nothing but a device for these meshes.
    fn new(meshes: Vec<Mesh>, variant: &Variant, threads: usize) -> Result<Scene> {
        let api = Api::get()?;
        let fits = |(positions, triangles): &Mesh| {
            let count = positions.len().saturating_sub(1);
            triangles.iter().flatten().all(|v| (*v as usize) < count)
        };
        ensure!(meshes.iter().all(fits), "a triangle uses a position that does not exist");
        let allocated = Box::new(AtomicI64::new(0));
        let total: *const AtomicI64 = &raw const *allocated;
        let config = std::ffi::CString::new(format!("threads={threads}"))?;
        // SAFETY: the counter lives in the `Scene` until after the device is released: moving a `Box` does not move what
        // it points to.
        let device = unsafe {
            let device = (api.new_device)(config.as_ptr());
            ensure!(!device.is_null(), "the library makes no device");
            (api.monitor)(device, count, total.cast_mut().cast());
            device
        };
        let (scene, packets, objects) = (std::ptr::null_mut(), variant.packets, Vec::new());
        Ok(Scene { api, device, scene, packets, objects, _meshes: meshes, allocated })
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
    fn object(&self, (positions, triangles): &Mesh, variant: &Variant) -> Handle {
        let (api, count_of_positions) = (self.api, positions.len().saturating_sub(1));
        // SAFETY: the calls are in the order and with the constants that the library's documentation asks for, which allows
        // them from several threads for different scenes. The buffers hold as many items as is said, plus the padding
        // that it asks for, every index is below the number of positions (`new` looked), and all of it lives in the `Scene`
        // until after the device is released: moving a `Vec` does not move what it points to.
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

    fn finished(self) -> Result<Scene> {
        // SAFETY: the device is there.
        let error = unsafe { (self.api.device_error)(self.device) };
        ensure!(error == 0, "the library reports error {error}");
        Ok(self)
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        // SAFETY: all were made above and are released once; the library knows of none that is null.
        unsafe {
            for scene in std::iter::once(&self.scene).chain(&self.objects).filter(|s| !s.is_null()) {
                (self.api.release_scene)(*scene);
            }
            (self.api.release_device)(self.device);
        }
    }
}

/// Builds a scene of a model.
///
/// # Errors
/// As [`build`].
pub fn contender(model: &Model, name: &str, variant: &Variant, threads: usize) -> Result<Contender> {
    available()?;
    let (positions, triangles) = (padded(&model.mesh.positions), model.mesh.triangles.clone());
    let start = Instant::now();
    let scene = build(positions, triangles, variant, threads)?;
    let build_s = start.elapsed().as_secs_f64();
    let bytes = u64::try_from(scene.allocated.load(Ordering::Relaxed)).ok();
    Ok(Contender { name: name.to_owned(), ours: false, tracer: Box::new(scene), build_s, bytes })
}

/// Positions as [`build`] wants them.
pub fn padded(positions: &[[f32; 3]]) -> Vec<[f32; 3]> {
    positions.iter().copied().chain([[0.0; 3]]).collect()
}

/// Traces rays through a committed scene one by one.
pub(super) fn singly(
    scene: Handle,
    batch: Batch<'_>,
    trace: Trace1,
    mut done: impl FnMut(usize, &RayHit<1>),
) {
    let mut arguments = Arguments::new(batch.coherent);
    let mut lane = RayHit::<1>::EMPTY;
    for (i, ray) in batch.rays.iter().enumerate() {
        lane.set(0, ray);
        // SAFETY: the scene is committed, and both structures are as the library defines them.
        unsafe { trace(scene, &mut lane, &mut arguments) };
        done(i, &lane);
    }
}

/// Traces rays through a committed scene in packets.
pub(super) fn packets(
    scene: Handle,
    batch: Batch<'_>,
    trace: Trace16,
    mut done: impl FnMut(usize, &RayHit<16>, usize),
) {
    let mut arguments = Arguments::new(batch.coherent);
    let mut lanes = RayHit::<16>::EMPTY;
    for (packet, rays) in batch.rays.chunks(16).enumerate() {
        let mut used = Lanes([0; 16]);
        for (lane, ray) in rays.iter().enumerate() {
            lanes.set(lane, ray);
            used.0[lane] = -1;
        }
        // SAFETY: as above; the mask and the packet have the alignment that the library asks for.
        unsafe { trace(&used, scene, &mut lanes, &mut arguments) };
        for lane in 0..rays.len() {
            done(packet * 16 + lane, &lanes, lane);
        }
    }
}

impl Tracer for Scene {
    fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit]) {
        if self.packets {
            packets(self.scene, batch, self.api.intersect16, |i, lanes, lane| hits[i] = lanes.hit(lane));
        } else {
            singly(self.scene, batch, self.api.intersect1, |i, lane| hits[i] = lane.hit(0));
        }
    }

    fn any(&self, batch: Batch<'_>, found: &mut [bool]) {
        if self.packets {
            packets(self.scene, batch, self.api.occluded16, |i, lanes, lane| found[i] = lanes.occluded(lane));
        } else {
            singly(self.scene, batch, self.api.occluded1, |i, lane| found[i] = lane.occluded(0));
        }
    }
}
