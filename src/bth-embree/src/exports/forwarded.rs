//! What only the other library has: user geometry, curves, points, subdivision, its builder.
#![allow(unsafe_code)] // Functions take pointers of the program.

use super::exports;
use crate::abi::Handle;
use crate::device::{Device, report_without_device};
use crate::error::{Result, operation, unsupported};
use crate::fallback::{Functions, functions};
use crate::geometry::Geometry;
use std::ffi::c_void;

/// Calls the other library with its geometry.
fn with_twin<T>(geometry: &Geometry, call: impl FnOnce(&Functions, Handle) -> T) -> Result<T> {
    if geometry.is_known() {
        return operation("operation not supported for this geometry");
    }
    let kind = geometry.kind;
    geometry.forward(call).map_or_else(|| unsupported(&format!("geometry of type {kind}")), Ok)
}

/// Defines functions that set something of a geometry of the other library.
macro_rules! forwarded {
    ($($name:ident($($argument:ident: $type:ty),*) $(-> $result:ty)?;)+) => {
        exports! { $(
            /// Is answered by the other library.
            fn $name(geometry: Geometry $(, $argument: $type)*) $(-> $result)? {
                // SAFETY: the geometry lives; the arguments are the program's.
                with_twin(geometry, |f, twin| unsafe { (f.$name)(twin $(, $argument)*) })
            }
        )+ }
    };
}

forwarded! {
    rtcSetGeometryUserPrimitiveCount(count: u32);
    rtcSetGeometryBoundsFunction(function: *const c_void, user: *mut c_void);
    rtcSetGeometryIntersectFunction(function: *const c_void);
    rtcSetGeometryOccludedFunction(function: *const c_void);
    rtcSetGeometryTessellationRate(rate: f32);
    rtcSetGeometryTopologyCount(count: u32);
    rtcSetGeometrySubdivisionMode(topology: u32, mode: u32);
    rtcSetGeometryVertexAttributeTopology(attribute: u32, topology: u32);
    rtcSetGeometryDisplacementFunction(function: *const c_void);
    rtcSetGeometryMaxRadiusScale(scale: f32);
    rtcGetGeometryFirstHalfEdge(face: u32) -> u32;
    rtcGetGeometryFace(edge: u32) -> u32;
    rtcGetGeometryNextHalfEdge(edge: u32) -> u32;
    rtcGetGeometryPreviousHalfEdge(edge: u32) -> u32;
    rtcGetGeometryOppositeHalfEdge(topology: u32, edge: u32) -> u32;
}

exports! {
    /// Makes a hierarchy for boxes of the program: in the other library.
    fn rtcNewBVH(device: Device) -> Handle {
        match &device.fallback {
            // SAFETY: the device of the other library lives.
            Some(fallback) => Ok(unsafe { (fallback.functions.rtcNewBVH)(fallback.device) }),
            None => unsupported("rtcNewBVH"),
        }
    }
}

/// Defines functions that take nothing of ours.
macro_rules! passed {
    ($($name:ident($($argument:ident: $type:ty),*) $(-> $result:ty)?;)+) => { $(
        /// Is answered by the other library.
        ///
        /// # Safety
        /// Pointers are as the documentation of Embree 4 asks.
        #[unsafe(no_mangle)]
        #[allow(non_snake_case)]
        pub unsafe extern "C" fn $name($($argument: $type),*) $(-> $result)? {
            let Some(functions) = functions() else {
                let failure = unsupported::<()>(stringify!($name));
                failure.unwrap_or_else(|failure| report_without_device(&failure));
                return Default::default();
            };
            // SAFETY: the contract is the same.
            unsafe { (functions.$name)($($argument),*) }
        }
    )+ };
}

passed! {
    rtcInvokeIntersectFilterFromGeometry(arguments: *const c_void, filter: *const c_void);
    rtcInvokeOccludedFilterFromGeometry(arguments: *const c_void, filter: *const c_void);
    rtcBuildBVH(arguments: *const c_void) -> *mut c_void;
    rtcThreadLocalAlloc(allocator: Handle, bytes: usize, alignment: usize) -> *mut c_void;
    rtcRetainBVH(bvh: Handle);
    rtcReleaseBVH(bvh: Handle);
}
