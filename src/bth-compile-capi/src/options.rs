//! The options of a compilation in C, and what they mean in Rust.

use crate::rounding::RoundingC;
use crate::{Failure, argument};
use bth_format::layout::GridBits;
use bth_import::Positions;
use compiler::bvh::Quality;
use compiler::coordinates::MaxError;
use compiler::free::KeepFree;
use compiler::pipeline::{CompileOptions, Structure};
use std::ffi::{CStr, c_char, c_void};
use std::path::PathBuf;

/// `bth_progress` of `bth_compile.h`.
pub type Progress = unsafe extern "C" fn(*mut c_void, *const c_char, u64, u64) -> i32;
/// `bth_warning` of `bth_compile.h`.
pub type Warning = unsafe extern "C" fn(*mut c_void, *const c_char);

/// `bth_compile_options` of `bth_compile.h`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Options {
    structure: u32,
    quality: u32,
    flags: u32,
    coordinate_bits: u32,
    max_error: f64,
    pub(crate) threads: u32,
    free_directions: u32,
    cache: *const c_char,
    tetgen: *const c_char,
    pub(crate) progress: Option<Progress>,
    pub(crate) warning: Option<Warning>,
    pub(crate) user: *mut c_void,
    positions: u32,
    reserved: u32,
    pub(crate) rounding: *mut RoundingC,
    pub(crate) avoided_rounding: *mut RoundingC,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            structure: 0,
            quality: 0,
            flags: 0,
            coordinate_bits: 0,
            max_error: 0.0,
            threads: 0,
            free_directions: 0,
            cache: std::ptr::null(),
            tetgen: std::ptr::null(),
            progress: None,
            warning: None,
            user: std::ptr::null_mut(),
            positions: 0,
            reserved: 0,
            rounding: std::ptr::null_mut(),
            avoided_rounding: std::ptr::null_mut(),
        }
    }
}

const NO_GEOMETRY: u32 = 1;
const DEFORMABLE: u32 = 4;
/// Greatest number of threads; more are a mistake.
const MOST_THREADS: u32 = 1 << 12;

impl Options {
    /// The options of the compiler.
    ///
    /// # Safety
    /// `tetgen` is null or points to a C string.
    pub(crate) unsafe fn compiler(&self) -> Result<CompileOptions, Failure> {
        let unknown = |option: &str, expected: &str, found: u32| {
            Err(argument(format!("options: {option}: expected {expected}, found {found}")))
        };
        let structure = match self.structure {
            0 => Structure::Bth,
            1 => Structure::Bvh,
            2 => Structure::Tets,
            other => return unknown("structure", "0, 1 or 2", other),
        };
        let deformable = self.flags & DEFORMABLE != 0;
        let mut options = CompileOptions {
            structure,
            geometry: self.flags & NO_GEOMETRY == 0,
            deformable,
            ..CompileOptions::default()
        };
        options.bvh.quality = match self.quality {
            0 => Quality::Balanced,
            1 => Quality::Fast,
            2 => Quality::Best,
            other => return unknown("quality", "0, 1 or 2", other),
        };
        options.positions = match self.positions {
            0 => Positions::Auto,
            1 => Positions::F32,
            2 => Positions::F64,
            other => return unknown("positions", "0, 1 or 2", other),
        };
        options.coordinates.bits = match self.coordinate_bits {
            0 => None,
            16 => Some(GridBits::B16),
            21 => Some(GridBits::B21),
            other => return unknown("coordinate_bits", "0, 16 or 21", other),
        };
        options.coordinates.max_error = match self.max_error {
            0.0 => None,
            limit if limit.is_finite() && limit > 0.0 => Some(MaxError::Absolute(limit)),
            limit => {
                let text = format!("options: max_error: expected a finite number from 0 on, found {limit}");
                return Err(argument(text));
            }
        };
        if self.flags & !(NO_GEOMETRY | DEFORMABLE) != 0 {
            return unknown("flags", "a sum of 1 and 4", self.flags);
        }
        options.free.keep = match self.free_directions {
            0 => KeepFree::None,
            1 => KeepFree::Auto,
            2 => KeepFree::Distances,
            3 => KeepFree::All,
            other => return unknown("free_directions", "0 to 3", other),
        };
        if self.reserved != 0 {
            return unknown("reserved", "0", self.reserved);
        }
        if self.threads > MOST_THREADS {
            return unknown("threads", &format!("at most {MOST_THREADS}"), self.threads);
        }
        // SAFETY: the contract of this function is the contract of `path`.
        options.tets.worker = unsafe { path(self.tetgen, "tetgen") }?;
        Ok(options)
    }

    /// The folder of the cache.
    ///
    /// # Safety
    /// `cache` is null or points to a C string.
    pub(crate) unsafe fn cache(&self) -> Result<Option<PathBuf>, Failure> {
        // SAFETY: the contract of this function is the contract of `path`.
        unsafe { path(self.cache, "cache") }
    }
}

/// A path in UTF-8, or none. An empty one would name the current folder, which nobody means.
///
/// # Safety
/// `text` is null or points to a C string.
unsafe fn path(text: *const c_char, option: &str) -> Result<Option<PathBuf>, Failure> {
    if text.is_null() {
        return Ok(None);
    }
    // SAFETY: it is not null, so by contract it points to a C string.
    let text = unsafe { CStr::from_ptr(text) };
    match text.to_str() {
        Ok("") => Err(argument(format!("options: {option}: expected a path or null, found an empty path"))),
        Ok(text) => Ok(Some(text.into())),
        Err(_) => {
            let found = String::from_utf8_lossy(text.to_bytes());
            Err(argument(format!("options: {option}: expected a path in UTF-8, found {found:?}")))
        }
    }
}
