//! Rays and point queries. Handles of the other library come here, too, where it calls its own
//! functions by name.
#![allow(unsafe_code)] // Functions take pointers of the program.

use crate::abi::*;
use crate::device::report_without_device;
use crate::fallback::{Functions, functions};
use crate::geometry::Instanced;
use crate::handles::{Shared, is_ours, object};
use crate::points::{self, Asked};
use crate::scene::Scene;
use crate::{packets, trace};
use std::ffi::c_void;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A scene of ours, or the functions of the library whose scene it is. `None` is reported.
///
/// # Safety
/// The handle is null or lives.
#[inline(always)]
unsafe fn scene<'a>(handle: Handle) -> Result<&'a Shared<Scene>, Option<&'static Functions>> {
    // SAFETY: the contract is the same.
    unsafe {
        if is_ours::<Scene>(handle) {
            return Ok(object::<Scene>(handle));
        }
    }
    Err(foreign(handle))
}

#[cold]
fn foreign(handle: Handle) -> Option<&'static Functions> {
    let known = if handle.is_null() { None } else { functions() };
    if known.is_none() {
        refuse();
    }
    known
}

/// Reports a handle that is not a scene of ours.
#[cold]
fn refuse() {
    let failure = crate::error::argument::<()>("invalid argument: expected a scene of this library");
    failure.unwrap_or_else(|failure| report_without_device(&failure));
}

/// Traces; a panic, which would be a defect, is reported.
#[inline(always)]
fn guarded(work: impl FnOnce()) {
    if catch_unwind(AssertUnwindSafe(work)).is_err() {
        super::defect::<()>().unwrap_or_else(|failure| report_without_device(&failure));
    }
}

/// Defines functions that trace one ray.
macro_rules! single {
    ($($(#[$doc:meta])* fn $name:ident($ray:ty) = $trace:path, $theirs:ident;)+) => { $(
        $(#[$doc])*
        ///
        /// # Safety
        /// Handles are null or live, and pointers are as the documentation of Embree 4 asks.
        #[unsafe(no_mangle)]
        #[allow(non_snake_case)]
        pub unsafe extern "C" fn $name(handle: Handle, ray: *mut $ray, arguments: *mut QueryArguments) {
            // SAFETY: the contract is the same.
            unsafe {
                match scene(handle) {
                    Ok(scene) => guarded(|| $trace(scene, ray, arguments)),
                    Err(Some(functions)) => (functions.$theirs)(handle, ray, arguments),
                    Err(None) => {}
                }
            }
        }
    )+ };
}

single! {
    /// Finds the nearest hit of a ray.
    fn rtcIntersect1(RayHit) = trace::intersect, rtcIntersect1;
    /// Finds the nearest hit of a ray.
    fn rtcTraversableIntersect1(RayHit) = trace::intersect, rtcIntersect1;
    /// Finds out if a ray hits anything.
    fn rtcOccluded1(Ray) = trace::occluded, rtcOccluded1;
    /// Finds out if a ray hits anything.
    fn rtcTraversableOccluded1(Ray) = trace::occluded, rtcOccluded1;
}

/// Defines functions that trace packets.
macro_rules! packets {
    ($($name:ident = $trace:path, $lanes:literal;)+) => { $(
        /// Traces the rays of a packet that are valid.
        ///
        /// # Safety
        /// Handles are null or live, and pointers are as the documentation of Embree 4 asks.
        #[unsafe(no_mangle)]
        #[allow(non_snake_case)]
        pub unsafe extern "C" fn $name(valid: *const i32, handle: Handle, packet: *mut u32, arguments: *mut QueryArguments) {
            // SAFETY: the contract is the same.
            unsafe {
                match scene(handle) {
                    Ok(scene) => guarded(|| $trace(valid, scene, packet, arguments, $lanes)),
                    // Its scenes are only asked for single rays here.
                    Err(Some(_)) => refuse(),
                    Err(None) => {}
                }
            }
        }
    )+ };
}

packets! {
    rtcIntersect4 = packets::intersect, 4;
    rtcIntersect8 = packets::intersect, 8;
    rtcIntersect16 = packets::intersect, 16;
    rtcTraversableIntersect4 = packets::intersect, 4;
    rtcTraversableIntersect8 = packets::intersect, 8;
    rtcTraversableIntersect16 = packets::intersect, 16;
    rtcOccluded4 = packets::occluded, 4;
    rtcOccluded8 = packets::occluded, 8;
    rtcOccluded16 = packets::occluded, 16;
    rtcTraversableOccluded4 = packets::occluded, 4;
    rtcTraversableOccluded8 = packets::occluded, 8;
    rtcTraversableOccluded16 = packets::occluded, 16;
}

/// Defines functions by which callbacks of user geometry, which the other library calls, trace on
/// in another scene: it gets all of that scene.
macro_rules! forwards {
    ($($name:ident($($valid:ident)?) = $theirs:ident $(, $index:ident)?;)+) => { $(
        /// Traces on in another scene, in a callback of user geometry.
        ///
        /// # Safety
        /// Handles are null or live, and pointers are as the documentation of Embree 4 asks.
        #[unsafe(no_mangle)]
        #[allow(non_snake_case)]
        pub unsafe extern "C" fn $name(
            $($valid: *const i32,)?
            arguments: *const CallbackArguments,
            handle: Handle,
            ray: *mut c_void,
            instance: u32,
            $($index: u32,)?
        ) {
            #[allow(unused_mut, unused_assignments)]
            let mut index = 0;
            $(index = $index;)?
            // SAFETY: the contract is the same; the other library holds all of the scene.
            unsafe {
                let (theirs, handle) = match scene(handle) {
                    Ok(scene) => (functions(), scene.whole_twin().0),
                    Err(theirs) => (theirs, handle),
                };
                if let (Some(theirs), false) = (theirs, handle.is_null()) {
                    (theirs.$theirs)($($valid,)? arguments, handle, ray, instance, index);
                }
            }
        }
    )+ };
}

forwards! {
    rtcForwardIntersect1() = rtcForwardIntersect1Ex;
    rtcForwardIntersect1Ex() = rtcForwardIntersect1Ex, instance_primitive;
    rtcForwardIntersect4(valid) = rtcForwardIntersect4Ex;
    rtcForwardIntersect4Ex(valid) = rtcForwardIntersect4Ex, instance_primitive;
    rtcForwardIntersect8(valid) = rtcForwardIntersect8Ex;
    rtcForwardIntersect8Ex(valid) = rtcForwardIntersect8Ex, instance_primitive;
    rtcForwardIntersect16(valid) = rtcForwardIntersect16Ex;
    rtcForwardIntersect16Ex(valid) = rtcForwardIntersect16Ex, instance_primitive;
    rtcForwardOccluded1() = rtcForwardOccluded1Ex;
    rtcForwardOccluded1Ex() = rtcForwardOccluded1Ex, instance_primitive;
    rtcForwardOccluded4(valid) = rtcForwardOccluded4Ex;
    rtcForwardOccluded4Ex(valid) = rtcForwardOccluded4Ex, instance_primitive;
    rtcForwardOccluded8(valid) = rtcForwardOccluded8Ex;
    rtcForwardOccluded8Ex(valid) = rtcForwardOccluded8Ex, instance_primitive;
    rtcForwardOccluded16(valid) = rtcForwardOccluded16Ex;
    rtcForwardOccluded16Ex(valid) = rtcForwardOccluded16Ex, instance_primitive;
    rtcTraversableForwardIntersect1() = rtcForwardIntersect1Ex;
    rtcTraversableForwardIntersect1Ex() = rtcForwardIntersect1Ex, instance_primitive;
    rtcTraversableForwardIntersect4(valid) = rtcForwardIntersect4Ex;
    rtcTraversableForwardIntersect4Ex(valid) = rtcForwardIntersect4Ex, instance_primitive;
    rtcTraversableForwardIntersect8(valid) = rtcForwardIntersect8Ex;
    rtcTraversableForwardIntersect8Ex(valid) = rtcForwardIntersect8Ex, instance_primitive;
    rtcTraversableForwardIntersect16(valid) = rtcForwardIntersect16Ex;
    rtcTraversableForwardIntersect16Ex(valid) = rtcForwardIntersect16Ex, instance_primitive;
    rtcTraversableForwardOccluded1() = rtcForwardOccluded1Ex;
    rtcTraversableForwardOccluded1Ex() = rtcForwardOccluded1Ex, instance_primitive;
    rtcTraversableForwardOccluded4(valid) = rtcForwardOccluded4Ex;
    rtcTraversableForwardOccluded4Ex(valid) = rtcForwardOccluded4Ex, instance_primitive;
    rtcTraversableForwardOccluded8(valid) = rtcForwardOccluded8Ex;
    rtcTraversableForwardOccluded8Ex(valid) = rtcForwardOccluded8Ex, instance_primitive;
    rtcTraversableForwardOccluded16(valid) = rtcForwardOccluded16Ex;
    rtcTraversableForwardOccluded16Ex(valid) = rtcForwardOccluded16Ex, instance_primitive;
}

/// Shows the primitives near a point.
///
/// # Safety
/// Handles are null or live, and pointers are as the documentation of Embree 4 asks.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub unsafe extern "C" fn rtcPointQuery(
    handle: Handle,
    query: *mut PointQuery,
    context: *mut PointQueryContext,
    function: Option<PointQueryFunction>,
    user: *mut c_void,
) -> bool {
    let mut changed = false;
    // SAFETY: the contract is the same.
    unsafe {
        match scene(handle) {
            Ok(scene) => guarded(|| {
                changed = points::query(scene, Asked { query, context, function, user });
            }),
            Err(Some(functions)) => {
                changed = (functions.rtcPointQuery)(handle, query, context, function, user);
            }
            Err(None) => {}
        }
    }
    changed
}

/// Shows the primitives near a point.
///
/// # Safety
/// Handles are null or live, and pointers are as the documentation of Embree 4 asks.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub unsafe extern "C" fn rtcTraversablePointQuery(
    handle: Handle,
    query: *mut PointQuery,
    context: *mut PointQueryContext,
    function: Option<PointQueryFunction>,
    user: *mut c_void,
) -> bool {
    // SAFETY: the contract is the same.
    unsafe { rtcPointQuery(handle, query, context, function, user) }
}

/// Defines functions that make several point queries, each by itself.
macro_rules! point_queries {
    ($($name:ident = $lanes:literal;)+) => { $(
        /// Makes the point queries that are valid.
        ///
        /// # Safety
        /// Handles are null or live, and pointers are as the documentation of Embree 4 asks.
        #[unsafe(no_mangle)]
        #[allow(non_snake_case)]
        pub unsafe extern "C" fn $name(
            valid: *const i32,
            handle: Handle,
            queries: *mut f32,
            context: *mut PointQueryContext,
            function: Option<PointQueryFunction>,
            users: *mut *mut c_void,
        ) -> bool {
            let mut changed = false;
            for lane in 0..$lanes {
                // SAFETY: by contract the numbers of this many queries are there, x, y, z, time
                // and radius one after the other, and `users` is null or has as many pointers.
                unsafe {
                    if *valid.add(lane) == 0 {
                        continue;
                    }
                    let number = |i: usize| queries.add(i * $lanes + lane);
                    let point = [*number(0), *number(1), *number(2)];
                    let mut one = PointQuery { point, time: *number(3), radius: *number(4) };
                    let user = if users.is_null() { users.cast() } else { *users.add(lane) };
                    changed |= rtcPointQuery(handle, &mut one, context, function, user);
                    *number(4) = one.radius;
                }
            }
            changed
        }
    )+ };
}

point_queries! {
    rtcPointQuery4 = 4;
    rtcPointQuery8 = 8;
    rtcPointQuery16 = 16;
    rtcTraversablePointQuery4 = 4;
    rtcTraversablePointQuery8 = 8;
    rtcTraversablePointQuery16 = 16;
}
