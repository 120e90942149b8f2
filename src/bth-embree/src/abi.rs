//! The structures and constants of the interface, as its public documentation gives them.

use std::ffi::{c_char, c_int, c_void};

/// A pointer that a program only passes on: device, scene, geometry, buffer, traversable.
pub(crate) type Handle = *mut c_void;

/// No geometry, primitive or instance.
pub(crate) const INVALID_ID: u32 = u32::MAX;

/// Most time steps of a geometry.
pub(crate) const MAX_TIME_STEPS: u32 = 129;

// Kinds of geometry that are answered here, `RTC_GEOMETRY_TYPE_*`.
pub(crate) const TRIANGLE: u32 = 0;
pub(crate) const QUAD: u32 = 1;
pub(crate) const GRID: u32 = 2;
pub(crate) const INSTANCE: u32 = 121;
pub(crate) const INSTANCE_ARRAY: u32 = 122;

// Kinds of buffers, `RTC_BUFFER_TYPE_*`.
pub(crate) const BUFFER_INDEX: u32 = 0;
pub(crate) const BUFFER_VERTEX: u32 = 1;
pub(crate) const BUFFER_ATTRIBUTE: u32 = 2;
pub(crate) const BUFFER_GRID: u32 = 8;
pub(crate) const BUFFER_TRANSFORM: u32 = 23;

// Formats of the items of buffers, `RTC_FORMAT_*`.
pub(crate) const FORMAT_UINT: u32 = 0x5001;
pub(crate) const FORMAT_UINT3: u32 = 0x5003;
pub(crate) const FORMAT_UINT4: u32 = 0x5004;
pub(crate) const FORMAT_FLOAT: u32 = 0x9001;
pub(crate) const FORMAT_FLOAT3: u32 = 0x9003;
pub(crate) const FORMAT_FLOAT16: u32 = 0x9010;
pub(crate) const FORMAT_3X4_ROWS: u32 = 0x9134;
pub(crate) const FORMAT_3X4_COLUMNS: u32 = 0x9234;
pub(crate) const FORMAT_4X4_COLUMNS: u32 = 0x9244;
pub(crate) const FORMAT_GRID: u32 = 0xA001;
pub(crate) const FORMAT_QUATERNION: u32 = 0xB001;

// Qualities of a build, `RTC_BUILD_QUALITY_*`.
pub(crate) const QUALITY_LOW: u32 = 0;
pub(crate) const QUALITY_MEDIUM: u32 = 1;
pub(crate) const QUALITY_HIGH: u32 = 2;
pub(crate) const QUALITY_REFIT: u32 = 3;

// Flags of scenes and of queries.
pub(crate) const SCENE_DYNAMIC: u32 = 1;
pub(crate) const SCENE_ROBUST: u32 = 1 << 2;
pub(crate) const SCENE_FILTER_IN_ARGUMENTS: u32 = 1 << 3;
pub(crate) const QUERY_INVOKE_FILTER: u32 = 1 << 1;

/// `RTCError`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(crate) enum ErrorCode {
    Unknown = 1,
    InvalidArgument = 2,
    InvalidOperation = 3,
    OutOfMemory = 4,
    Cancelled = 6,
}

/// `RTCRay`: the points `origin + t * direction` with t from `tnear` to `tfar`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Ray {
    pub(crate) origin: [f32; 3],
    pub(crate) tnear: f32,
    pub(crate) direction: [f32; 3],
    pub(crate) time: f32,
    pub(crate) tfar: f32,
    pub(crate) mask: u32,
    pub(crate) id: u32,
    pub(crate) flags: u32,
}

/// `RTCHit`. The last word is absent where the program was built without instance arrays.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Hit {
    /// The normal, not normalized, in the space of the geometry.
    pub(crate) normal: [f32; 3],
    pub(crate) u: f32,
    pub(crate) v: f32,
    pub(crate) primitive: u32,
    pub(crate) geometry: u32,
    pub(crate) instance: u32,
    pub(crate) instance_primitive: u32,
}

impl Hit {
    /// No hit.
    pub(crate) const NONE: Hit = Hit {
        normal: [0.0; 3],
        u: 0.0,
        v: 0.0,
        primitive: INVALID_ID,
        geometry: INVALID_ID,
        instance: INVALID_ID,
        instance_primitive: INVALID_ID,
    };
}

/// `RTCRayHit`.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub struct RayHit {
    pub(crate) ray: Ray,
    pub(crate) hit: Hit,
}

/// Words of a ray, and of a hit with and without instance arrays.
pub(crate) const RAY_WORDS: usize = 12;
pub(crate) const HIT_WORDS: usize = 9;
pub(crate) const SHORT_HIT_WORDS: usize = 8;

const _: () = assert!(size_of::<Ray>() == 4 * RAY_WORDS && size_of::<Hit>() == 4 * HIT_WORDS);
const _: () = assert!(size_of::<RayHit>() == 96);

/// `RTCFilterFunctionNArguments`.
#[derive(Debug)]
#[repr(C)]
pub struct FilterArguments {
    pub(crate) valid: *mut c_int,
    pub(crate) user: *mut c_void,
    pub(crate) context: *mut QueryContext,
    pub(crate) ray: *mut Ray,
    pub(crate) hit: *mut Hit,
    pub(crate) count: u32,
}

/// `RTCFilterFunctionN`.
pub(crate) type FilterFunction = unsafe extern "C" fn(*const FilterArguments);

/// `RTCRayQueryContext`: the instance that a ray is in.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct QueryContext {
    pub(crate) instance: u32,
    /// Absent where the program was built without instance arrays.
    pub(crate) instance_primitive: u32,
}

/// `RTCIntersectArguments` and `RTCOccludedArguments`.
#[derive(Debug)]
#[repr(C)]
pub struct QueryArguments {
    pub(crate) flags: u32,
    pub(crate) features: u32,
    pub(crate) context: *mut QueryContext,
    pub(crate) filter: Option<FilterFunction>,
    /// For user geometry.
    pub(crate) callback: *const c_void,
}

/// The first fields of `RTCIntersectFunctionNArguments` and `RTCOccludedFunctionNArguments`.
#[derive(Debug)]
#[repr(C)]
pub struct CallbackArguments {
    pub(crate) valid: *mut c_int,
    pub(crate) user: *mut c_void,
    pub(crate) primitive: u32,
    pub(crate) context: *mut QueryContext,
    /// A ray with its hit, or a ray.
    pub(crate) ray: *mut c_void,
    pub(crate) count: u32,
    pub(crate) geometry: u32,
}

/// `RTCBounds`.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub struct Bounds {
    pub(crate) lower: [f32; 3],
    pub(crate) align0: f32,
    pub(crate) upper: [f32; 3],
    pub(crate) align1: f32,
}

impl Bounds {
    /// The box of nothing.
    pub(crate) const EMPTY: Bounds =
        Bounds { lower: [f32::INFINITY; 3], align0: 0.0, upper: [f32::NEG_INFINITY; 3], align1: 0.0 };

    /// Makes the box contain a point.
    pub(crate) fn add(&mut self, point: [f32; 3]) {
        self.lower = std::array::from_fn(|k| self.lower[k].min(point[k]));
        self.upper = std::array::from_fn(|k| self.upper[k].max(point[k]));
    }

    /// Makes the box contain another one.
    pub(crate) fn join(&mut self, other: &Bounds) {
        if other.lower[0] <= other.upper[0] {
            self.add(other.lower);
            self.add(other.upper);
        }
    }
}

/// `RTCPointQuery`.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub struct PointQuery {
    pub(crate) point: [f32; 3],
    pub(crate) time: f32,
    pub(crate) radius: f32,
}

/// `RTCPointQueryContext` of a library with instance arrays; without them the stack size has the
/// place of the instance's primitive.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub struct PointQueryContext {
    pub(crate) to_instance: [f32; 16],
    pub(crate) to_world: [f32; 16],
    pub(crate) instance: u32,
    pub(crate) rest: [u32; 2],
}

/// `RTCPointQueryFunctionArguments`.
#[derive(Debug)]
#[repr(C, align(16))]
pub struct PointQueryArguments {
    pub(crate) query: *mut PointQuery,
    pub(crate) user: *mut c_void,
    pub(crate) primitive: u32,
    pub(crate) geometry: u32,
    pub(crate) context: *mut PointQueryContext,
    pub(crate) similarity: f32,
}

/// `RTCPointQueryFunction`.
pub(crate) type PointQueryFunction = unsafe extern "C" fn(*mut PointQueryArguments) -> bool;

/// `RTCInterpolateArguments`.
#[derive(Debug)]
#[repr(C)]
pub struct InterpolateArguments {
    pub(crate) geometry: Handle,
    pub(crate) primitive: u32,
    pub(crate) u: f32,
    pub(crate) v: f32,
    pub(crate) buffer: u32,
    pub(crate) slot: u32,
    /// P, dPdu, dPdv, ddPdudu, ddPdvdv, ddPdudv.
    pub(crate) out: [*mut f32; 6],
    pub(crate) count: u32,
}

/// `RTCInterpolateNArguments`.
#[derive(Debug)]
#[repr(C)]
pub struct InterpolateManyArguments {
    pub(crate) geometry: Handle,
    pub(crate) valid: *const c_int,
    pub(crate) primitives: *const u32,
    pub(crate) u: *const f32,
    pub(crate) v: *const f32,
    pub(crate) many: u32,
    pub(crate) buffer: u32,
    pub(crate) slot: u32,
    pub(crate) out: [*mut f32; 6],
    pub(crate) count: u32,
}

/// `RTCErrorFunction`, `RTCMemoryMonitorFunction` and `RTCProgressMonitorFunction`.
pub(crate) type ErrorFunction = unsafe extern "C" fn(*mut c_void, u32, *const c_char);
pub(crate) type MemoryFunction = unsafe extern "C" fn(*mut c_void, isize, bool) -> bool;
pub(crate) type ProgressFunction = unsafe extern "C" fn(*mut c_void, f64) -> bool;
