//! Packets of 4, 8 and 16 rays: the rays of a packet are traced one by one.
#![allow(unsafe_code)] // Reads and writes packets of the program.

use crate::abi::*;
use crate::fallback::has_instance_arrays;
use crate::handles::Shared;
use crate::scene::Scene;
use crate::trace;

/// Reads the ray of a lane.
///
/// # Safety
/// `packet` points to the words of a packet of `lanes` rays.
unsafe fn gather(packet: *const u32, lanes: usize, lane: usize) -> Ray {
    // SAFETY: by contract the words of a ray are there, each `lanes` words after the one before.
    let word = |i: usize| unsafe { *packet.add(i * lanes + lane) };
    let number = |i: usize| f32::from_bits(word(i));
    Ray {
        origin: [number(0), number(1), number(2)],
        tnear: number(3),
        direction: [number(4), number(5), number(6)],
        time: number(7),
        tfar: number(8),
        mask: word(9),
        id: word(10),
        flags: word(11),
    }
}

/// Calls a function for each lane that is valid.
///
/// # Safety
/// `valid` points to as many numbers as there are lanes.
unsafe fn each_valid(valid: *const i32, lanes: usize, mut call: impl FnMut(usize)) {
    for lane in 0..lanes {
        // SAFETY: by contract the number is there.
        if unsafe { *valid.add(lane) } != 0 {
            call(lane);
        }
    }
}

/// Finds the nearest hits of a packet.
///
/// # Safety
/// The structures are as the documentation of `rtcIntersect4` asks, for this number of lanes.
pub(crate) unsafe fn intersect(
    valid: *const i32,
    scene: &Shared<Scene>,
    packet: *mut u32,
    arguments: *const QueryArguments,
    lanes: usize,
) {
    let words = if has_instance_arrays() { HIT_WORDS } else { SHORT_HIT_WORDS };
    let trace = |lane| {
        // SAFETY: by contract the packet has `lanes` lanes, each with the words of a ray and a hit.
        unsafe {
            let mut one = RayHit { ray: gather(packet, lanes, lane), hit: Hit::NONE };
            trace::intersect(scene, &mut one, arguments);
            if one.hit.geometry == INVALID_ID {
                return;
            }
            *packet.add(8 * lanes + lane) = one.ray.tfar.to_bits();
            let hit = (&raw const one.hit).cast::<u32>();
            for word in 0..words {
                *packet.add((RAY_WORDS + word) * lanes + lane) = *hit.add(word);
            }
        }
    };
    // SAFETY: the contract is the same.
    unsafe { each_valid(valid, lanes, trace) };
}

/// Finds which rays of a packet hit anything.
///
/// # Safety
/// The structures are as the documentation of `rtcOccluded4` asks, for this number of lanes.
pub(crate) unsafe fn occluded(
    valid: *const i32,
    scene: &Shared<Scene>,
    packet: *mut u32,
    arguments: *const QueryArguments,
    lanes: usize,
) {
    let trace = |lane| {
        // SAFETY: by contract the packet has `lanes` lanes, each with the words of a ray.
        unsafe {
            #[repr(align(16))]
            struct AlignedRay(Ray);
            let mut one = AlignedRay(gather(packet, lanes, lane));
            trace::occluded(scene, &mut one.0, arguments);
            *packet.add(8 * lanes + lane) = one.0.tfar.to_bits();
        }
    };
    // SAFETY: the contract is the same.
    unsafe { each_valid(valid, lanes, trace) };
}
