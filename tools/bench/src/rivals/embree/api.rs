//! What we use of Embree's C interface (`embree4/rtcore.h`).
#![allow(unsafe_code)]

use crate::rivals::library;
use crate::tracer::Batch;
use anyhow::Result;
use bth::rays::{Hit, PrimitiveRef, Ray};
use bth_format::layout::NONE;
use std::ffi::{c_char, c_int, c_void};

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
    fn empty() -> Self {
        // SAFETY: all fields are numbers.
        let zero: Self = unsafe { std::mem::zeroed() };
        RayHit { mask: [u32::MAX; N], geometry: [NONE; N], instance: [[NONE; N]; 2], ..zero }
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, ray: &Ray) {
        for k in 0..3 {
            self.origin[k][lane] = ray.origin[k];
            self.direction[k][lane] = ray.direction[k];
        }
        (self.near[lane], self.far[lane]) = (ray.tmin, ray.tmax);
        self.geometry[lane] = NONE;
    }

    /// The hit of a lane, in the library's instance if there are `instances`, else in number 0.
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

/// The lanes of a packet that hold rays: -1, else 0.
#[repr(C, align(64))]
pub(super) struct Lanes([c_int; 16]);

pub(super) type Monitor = unsafe extern "C" fn(Handle, isize, bool) -> bool;
pub(super) type Trace1 = unsafe extern "C" fn(Handle, *mut RayHit<1>, *mut QueryArguments);
pub(super) type Trace16 = unsafe extern "C" fn(*const Lanes, Handle, *mut RayHit<16>, *mut QueryArguments);

/// Declares functions of the library, and how to load them.
macro_rules! functions {
    ($($field:ident $name:literal: ($($argument:ty),*) $(-> $returned:ty)?;)*) => {
        pub(super) struct EmbreeApi {
            $(pub(super) $field: unsafe extern "C" fn($($argument),*) $(-> $returned)?,)*
        }

        impl EmbreeApi {
            fn load() -> Result<EmbreeApi> {
                // SAFETY: EMBREE_LIB names Embree 4, whose initializers may run at any time, and
                // whose functions have the types below (rtcore_device.h, rtcore_scene.h,
                // rtcore_geometry.h). Occluded rays are passed as the `RTCRay` that a `RTCRayHit`
                // begins with.
                unsafe {
                    let library = library::load("EMBREE_LIB", "libembree4.so")?;
                    Ok(EmbreeApi { $($field: *library.get(concat!($name, "\0").as_bytes())?,)* })
                }
            }
        }
    };
}

functions! {
    new_device "rtcNewDevice": (*const c_char) -> Handle;
    release_device "rtcReleaseDevice": (Handle);
    device_error "rtcGetDeviceError": (Handle) -> c_int;
    monitor "rtcSetDeviceMemoryMonitorFunction": (Handle, Monitor, Handle);
    new_scene "rtcNewScene": (Handle) -> Handle;
    release_scene "rtcReleaseScene": (Handle);
    scene_flags "rtcSetSceneFlags": (Handle, c_int);
    scene_quality "rtcSetSceneBuildQuality": (Handle, c_int);
    commit_scene "rtcCommitScene": (Handle);
    new_geometry "rtcNewGeometry": (Handle, c_int) -> Handle;
    geometry_quality "rtcSetGeometryBuildQuality": (Handle, c_int);
    shared_buffer "rtcSetSharedGeometryBuffer":
        (Handle, c_int, u32, c_int, *const c_void, usize, usize, usize);
    commit_geometry "rtcCommitGeometry": (Handle);
    attach_geometry "rtcAttachGeometry": (Handle, Handle) -> u32;
    release_geometry "rtcReleaseGeometry": (Handle);
    intersect1 "rtcIntersect1": (Handle, *mut RayHit<1>, *mut QueryArguments);
    occluded1 "rtcOccluded1": (Handle, *mut RayHit<1>, *mut QueryArguments);
    intersect16 "rtcIntersect16": (*const Lanes, Handle, *mut RayHit<16>, *mut QueryArguments);
    occluded16 "rtcOccluded16": (*const Lanes, Handle, *mut RayHit<16>, *mut QueryArguments);
    instanced_scene "rtcSetGeometryInstancedScene": (Handle, Handle);
    transform "rtcSetGeometryTransform": (Handle, u32, c_int, *const f32);
    enable_geometry "rtcEnableGeometry": (Handle);
    disable_geometry "rtcDisableGeometry": (Handle);
}

impl EmbreeApi {
    pub(super) fn get() -> Result<&'static EmbreeApi> {
        static API: library::Api<EmbreeApi> = library::Api::new();
        library::once(&API, EmbreeApi::load)
    }
}

/// Traces rays through a committed scene one by one; with `own` they do not hit the triangles that
/// they start on.
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
    let mut lane = RayHit::<1>::empty();
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
    let mut lanes = RayHit::<16>::empty();
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
