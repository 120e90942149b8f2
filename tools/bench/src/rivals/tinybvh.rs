//! tinybvh's CPU layout of nodes with 8 children, through `shim/tinybvh_shim.cpp`. Built with
//! spatial splits on one thread.
#![allow(unsafe_code)]

use super::library;
use crate::model::Model;
use crate::tracer::{Batch, Contender, Tracer};
use anyhow::{Result, ensure};
use bth::rays::{Hit, PrimitiveRef, Ray};
use bth_format::layout::NONE;
use std::ffi::c_void;
use std::time::Instant;

/// Children of a node: the layout `BVH8_CPU`.
const WIDTH: u32 = 8;

/// An answer of the shim; for a miss t is infinite and the triangle [`NONE`].
#[derive(Clone, Copy)]
#[repr(C)]
struct Answer {
    t: f32,
    u: f32,
    v: f32,
    triangle: u32,
}

struct TinybvhApi {
    build: unsafe extern "C" fn(*const [f32; 4], u32, u32, u32) -> *mut c_void,
    free: unsafe extern "C" fn(*mut c_void),
    bytes: unsafe extern "C" fn(*const c_void) -> usize,
    nearest: unsafe extern "C" fn(*const c_void, *const Ray, usize, *mut Answer),
    occluded: unsafe extern "C" fn(*const c_void, *const Ray, usize, *mut bool),
}

impl TinybvhApi {
    fn get() -> Result<&'static TinybvhApi> {
        static API: library::Api<TinybvhApi> = library::Api::new();
        library::once(&API, TinybvhApi::load)
    }

    fn load() -> Result<TinybvhApi> {
        // SAFETY: TINYBVH_LIB names the shim, which has no initializers but the C++ runtime's, and
        // whose functions have the types above.
        unsafe {
            let library = library::load("TINYBVH_LIB", "libtinybvh_shim.so")?;
            Ok(TinybvhApi {
                build: *library.get(b"tb_build\0")?,
                free: *library.get(b"tb_free\0")?,
                bytes: *library.get(b"tb_bytes\0")?,
                nearest: *library.get(b"tb_nearest\0")?,
                occluded: *library.get(b"tb_occluded\0")?,
            })
        }
    }
}

struct TinyBvh {
    api: &'static TinybvhApi,
    bvh: *mut c_void,
    /// The structure keeps pointers into these.
    _corners: Vec<[f32; 4]>,
}

// SAFETY: queries only read the structure, and nothing else touches it until it is freed.
unsafe impl Send for TinyBvh {}
// SAFETY: as above.
unsafe impl Sync for TinyBvh {}

impl Drop for TinyBvh {
    fn drop(&mut self) {
        // SAFETY: made by `tb_build`, freed once.
        unsafe { (self.api.free)(self.bvh) }
    }
}

pub(super) fn contender(model: &Model, name: &str) -> Result<Contender> {
    let api = TinybvhApi::get()?;
    let triangles = u32::try_from(model.triangles())?;
    let corners: Vec<[f32; 4]> =
        (0..triangles).flat_map(|t| model.mesh.corners(t)).map(|[x, y, z]| [x, y, z, 0.0]).collect();
    let start = Instant::now();
    // SAFETY: three corners for each triangle, which live as long as the structure.
    let bvh = unsafe { (api.build)(corners.as_ptr(), triangles, WIDTH, 1) };
    ensure!(!bvh.is_null(), "the library builds nothing");
    let tracer = TinyBvh { api, bvh, _corners: corners };
    let build_s = start.elapsed().as_secs_f64();
    // SAFETY: just built.
    let bytes = unsafe { (api.bytes)(tracer.bvh) } as u64;
    Ok(Contender::rival(name, tracer, build_s, Some(bytes)))
}

/// Answers that are buffered before they become hits.
const MOST_ANSWERS: usize = 1024;

impl Tracer for TinyBvh {
    fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit]) {
        let mut answers = [Answer { t: f32::INFINITY, u: 0.0, v: 0.0, triangle: NONE }; MOST_ANSWERS];
        for (batch, hits) in batch.chunks(MOST_ANSWERS).zip(hits.chunks_mut(MOST_ANSWERS)) {
            // SAFETY: at most as many rays as there is room for answers; `Ray` is what the shim
            // expects.
            unsafe {
                (self.api.nearest)(self.bvh, batch.rays.as_ptr(), batch.rays.len(), answers.as_mut_ptr())
            };
            for (answer, hit) in answers.iter().zip(hits) {
                *hit = match answer.triangle {
                    NONE => Hit::MISS,
                    triangle => Hit {
                        t: answer.t,
                        u: answer.u,
                        v: answer.v,
                        primitive: PrimitiveRef { instance: 0, triangle },
                    },
                };
            }
        }
    }

    fn any(&self, batch: Batch<'_>, found: &mut [bool]) {
        assert_eq!(batch.rays.len(), found.len(), "as many answers as rays");
        // SAFETY: as many answers as rays, which the shim sets to 0 or 1.
        unsafe { (self.api.occluded)(self.bvh, batch.rays.as_ptr(), batch.rays.len(), found.as_mut_ptr()) }
    }
}
