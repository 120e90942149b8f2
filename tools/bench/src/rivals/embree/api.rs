//! What we use of Embree's C interface (`embree4/rtcore.h`).
#![allow(unsafe_code)]

use crate::rivals::library;
use crate::tracer::Batch;
use anyhow::Result;
use bth::rays::{Hit, PrimitiveRef, Ray};
use bth_format::layout::NONE;
use std::ffi::{c_char, c_int, c_void};
use std::sync::OnceLock;

pub(super) type Handle = *mut c_void;
type Function = *const c_void;

pub(super) const TYPE_TRIANGLE: c_int = 0;
pub(super) const BUFFER_INDEX: c_int = 0;
pub(super) const BUFFER_VERTEX: c_int = 1;
pub(super) const FORMAT_UINT3: c_int = 0x5003;
pub(super) const FORMAT_FLOAT3: c_int = 0x9003;
pub(super) const TYPE_INSTANCE: c_int = 121;
pub(super) const FORMAT_ROWS: c_int = 0x9134;
const QUERY_COHERENT: c_int = 1 << 16;
const QUERY_FILTER: c_int = 1 << 1;

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

    /// The hit of a lane, in the instance that the library names if there are `instances`, else in that of number 0.
    #[inline(always)]
    pub(super) fn hit(&self, lane: usize, instances: bool) -> Hit {
        if self.geometry[lane] == NONE {
            return Hit::MISS;
        }
        let instance = if instances { self.instance[0][lane] } else { 0 };
        let primitive = PrimitiveRef { instance, triangle: self.primitive[lane] };
        Hit { t: self.far[lane], u: self.u[lane], v: self.v[lane], primitive }
    }

    /// The library marks an occluded ray so.
    #[inline(always)]
    pub(super) fn occluded(&self, lane: usize) -> bool {
        self.far[lane] == f32::NEG_INFINITY
    }
}

/// `RTCIntersectArguments`, and `RTCOccludedArguments`, which is the same.
#[repr(C)]
pub(super) struct QueryArguments {
    flags: c_int,
    features: u32,
    context: Handle,
    filter: Function,
    callback: Function,
    /// In libraries that were built with a minimal width of curves.
    min_width: f32,
}

impl QueryArguments {
    fn new(coherent: bool) -> Self {
        QueryArguments {
            flags: if coherent { QUERY_COHERENT } else { 0 },
            features: u32::MAX,
            context: std::ptr::null_mut(),
            filter: std::ptr::null(),
            callback: std::ptr::null(),
            min_width: 0.0,
        }
    }
}

/// `RTCRayQueryContext`, and the triangle that [`reject_own`] rejects.
#[repr(C)]
struct OwnContext {
    /// Instance, and row in an instance array in libraries that were built with those.
    instance: [u32; 2],
    own: u32,
}

/// `RTCFilterFunctionNArguments`.
#[repr(C)]
struct FilterArguments {
    valid: *mut c_int,
    user: Handle,
    context: *const OwnContext,
    ray: *const f32,
    /// `RTCHit`: normal, u and v, then the triangle.
    hit: *const [u32; 6],
    lanes: u32,
}

/// Rejects a hit on the triangle on which the ray starts.
///
/// # Safety
/// Called by the library for one ray, in a query whose context is an `OwnContext`.
unsafe extern "C" fn reject_own(arguments: *const FilterArguments) {
    // SAFETY: by the contract; the library's pointers are valid during the call.
    unsafe {
        if (*(*arguments).hit)[5] == (*(*arguments).context).own {
            *(*arguments).valid = 0;
        }
    }
}

/// Which lanes of a packet hold rays: -1, else 0.
#[repr(C, align(64))]
pub(super) struct Lanes([c_int; 16]);

pub(super) type Trace1 = unsafe extern "C" fn(Handle, *mut RayHit<1>, *mut QueryArguments);
pub(super) type Trace16 = unsafe extern "C" fn(*const Lanes, Handle, *mut RayHit<16>, *mut QueryArguments);

pub(super) struct EmbreeApi {
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
    pub(super) geometry: unsafe extern "C" fn(Handle, u32) -> Handle,
    pub(super) update_buffer: unsafe extern "C" fn(Handle, c_int, u32),
}

impl EmbreeApi {
    pub(super) fn get() -> Result<&'static EmbreeApi> {
        static EMBREE_API: OnceLock<std::result::Result<EmbreeApi, String>> = OnceLock::new();
        EMBREE_API
            .get_or_init(|| EmbreeApi::load().map_err(|e| format!("{e:#}")))
            .as_ref()
            .map_err(|e| anyhow::anyhow!("{e}"))
    }

    fn load() -> Result<EmbreeApi> {
        // SAFETY: EMBREE_LIB names Embree 4, whose initializers may run at any time, and whose
        // functions have the types above (rtcore_device.h, rtcore_scene.h, rtcore_geometry.h).
        // Occluded rays are passed as the `RTCRay` that a `RTCRayHit` begins with.
        unsafe {
            let library = library::load("EMBREE_LIB", "libembree4.so")?;
            Ok(EmbreeApi {
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
                geometry: *library.get(b"rtcGetGeometry\0")?,
                update_buffer: *library.get(b"rtcUpdateGeometryBuffer\0")?,
            })
        }
    }
}

/// Traces rays through a committed scene one by one; with `own` they do not hit the triangles that they start on.
pub(super) fn singly(
    scene: Handle,
    batch: Batch<'_>,
    own: bool,
    trace: Trace1,
    mut done: impl FnMut(usize, &RayHit<1>),
) {
    let mut arguments = QueryArguments::new(batch.coherent);
    let mut context = OwnContext { instance: [NONE; 2], own: NONE };
    let context = &raw mut context;
    let starts = if own { batch.starts } else { None };
    if starts.is_some() {
        arguments.flags |= QUERY_FILTER;
        arguments.context = context.cast();
        arguments.filter = reject_own as Function;
    }
    let mut lane = RayHit::<1>::EMPTY;
    for (i, ray) in batch.rays.iter().enumerate() {
        lane.set(0, ray);
        if let Some(starts) = starts {
            // SAFETY: the context lives on the stack, and the library reads it only during calls.
            unsafe { (*context).own = starts[i].primitive.triangle };
        }
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
    let mut arguments = QueryArguments::new(batch.coherent);
    let mut lanes = RayHit::<16>::EMPTY;
    for (packet, rays) in batch.rays.chunks(16).enumerate() {
        let mut used = Lanes([0; 16]);
        for (lane, ray) in rays.iter().enumerate() {
            lanes.set(lane, ray);
            used.0[lane] = -1;
        }
        // SAFETY: as above; the mask and the packet have the alignment that the library requires.
        unsafe { trace(&used, scene, &mut lanes, &mut arguments) };
        for lane in 0..rays.len() {
            done(packet * 16 + lane, &lanes, lane);
        }
    }
}
