//! The WebAssembly module of the npm package that compiles meshes: the fast way of `bth-compile`,
//! without importers and cache. Its only caller is `compile.js`.
//!
//! Nothing is freed: the caller compiles one mesh and drops the module's instance with its memory.
#![allow(unsafe_code)] // All functions are called from outside and take addresses.

use bth_compile::error::for_callers;
use bth_compile::memory::{PositionRows, TriangleMesh};
use bth_compile::pipeline::{Compiled, compile_fast};
use bth_compile::{Monitor, Result};
use std::sync::Mutex;

/// What a call leaves: the file, or the text of an error.
static BYTES: Mutex<Vec<u8>> = Mutex::new(Vec::new());

/// The warnings of the last call, a line each.
static WARNINGS: Mutex<String> = Mutex::new(String::new());

/// Keeps warnings.
struct Warnings;

impl Monitor for Warnings {
    fn warn(&self, message: &str) {
        if let Ok(mut warnings) = WARNINGS.lock() {
            *warnings = format!("{warnings}{}\n", for_callers(message));
        }
    }
}

/// Memory for an array of `count` words, zeros, at a multiple of 8 bytes.
#[unsafe(no_mangle)]
pub extern "C" fn bth_words(count: usize) -> *mut u64 {
    Box::leak(vec![0u64; count.div_ceil(2)].into_boxed_slice()).as_mut_ptr()
}

/// Compiles a mesh. Positions are three numbers each, f64 where `wide` is 1, else f32. Returns the
/// bytes that [`bth_bytes`] holds: the file, or a negative number for the text of an error.
///
/// # Safety
/// `positions` and `triangles` point to arrays of these lengths at multiples of 8 bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_compile(
    positions: *const u64,
    position_count: usize,
    wide: u32,
    triangles: *const [u32; 3],
    triangle_count: usize,
    deformable: u32,
) -> f64 {
    // SAFETY: by contract the addresses belong to arrays of these lengths, aligned for f64. All bit
    // patterns are valid for their elements.
    let mesh = unsafe {
        let positions = if wide == 1 {
            PositionRows::F64(std::slice::from_raw_parts(positions.cast(), position_count))
        } else {
            PositionRows::F32(std::slice::from_raw_parts(positions.cast(), position_count))
        };
        TriangleMesh { positions, triangles: std::slice::from_raw_parts(triangles, triangle_count) }
    };
    keep(compile_fast(mesh, deformable == 1, &Warnings))
}

/// Compiles a model file, as [`bth_compile`] a mesh. Its name is UTF-8; the extension decides about
/// the format.
///
/// # Safety
/// `name` and `file` point to arrays of these lengths.
#[cfg(feature = "models")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_compile_model(
    name: *const u8,
    name_length: usize,
    file: *const u8,
    length: usize,
) -> f64 {
    // SAFETY: by contract the addresses belong to arrays of these lengths.
    let (name, file) =
        unsafe { (std::slice::from_raw_parts(name, name_length), std::slice::from_raw_parts(file, length)) };
    let name = String::from_utf8_lossy(name);
    keep(bth_compile::pipeline::compile_model_fast(std::path::Path::new(&*name), file, &Warnings))
}

/// Keeps what was made. Returns its length, negative for an error.
fn keep(made: Result<Compiled>) -> f64 {
    let (bytes, sign) = match made {
        Ok(compiled) => (compiled.bytes, 1.0),
        Err(error) => (for_callers(&error.to_string()).into_bytes(), -1.0),
    };
    let length = bytes.len() as f64;
    if let Ok(mut kept) = BYTES.lock() {
        *kept = bytes;
    }
    sign * length
}

/// Address of what [`bth_compile`] made.
#[unsafe(no_mangle)]
pub extern "C" fn bth_bytes() -> *const u8 {
    BYTES.lock().map_or(std::ptr::null(), |bytes| bytes.as_ptr())
}

/// Address of the warnings.
#[unsafe(no_mangle)]
pub extern "C" fn bth_warnings() -> *const u8 {
    WARNINGS.lock().map_or(std::ptr::null(), |warnings| warnings.as_ptr())
}

/// Bytes of the warnings.
#[unsafe(no_mangle)]
pub extern "C" fn bth_warnings_length() -> usize {
    WARNINGS.lock().map_or(0, |warnings| warnings.len())
}
