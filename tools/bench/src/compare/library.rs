//! A build of `libbth.so`, loaded at run time through the C interface.
#![allow(unsafe_code)]

use crate::tracer::Answers;
use anyhow::{Context, Result, bail, ensure};
use bth::rays::{Hit, Ray};
use libloading::Library;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::path::Path;
use std::ptr::null;

/// `bth_open` with the flag `BTH_READ`.
const READ: u32 = 0;

type Open = unsafe extern "C" fn(*const c_char, u32, *mut *mut c_void) -> c_int;
type Close = unsafe extern "C" fn(*mut c_void);
type LastError = unsafe extern "C" fn() -> *const c_char;
type Nearest = unsafe extern "C" fn(*mut c_void, *const Ray, *const c_void, *mut Hit, usize);
type Any = unsafe extern "C" fn(*mut c_void, *const Ray, *const c_void, *mut bool, usize);

/// The functions of one build.
pub(super) struct Build {
    open: Open,
    close: Close,
    last_error: LastError,
    nearest: Nearest,
    any: Any,
}

impl Build {
    /// Loads a build. It is never unloaded, so its functions stay valid.
    pub(super) fn load(path: &Path) -> Result<Build> {
        let path = path.canonicalize().with_context(|| format!("{}: no such file", path.display()))?;
        // SAFETY: by the documentation of `compare` the user names a build of libbth, whose
        // only initializers are of Rust's standard library.
        let library = unsafe { Library::new(&path) }.with_context(|| path.display().to_string())?;
        let library: &'static Library = Box::leak(Box::new(library));
        let lacks = |name| format!("{}: no function {name}: expected a build of libbth", path.display());
        // SAFETY: bth.h has these types for these names, which have not changed since the
        // first version.
        unsafe {
            Ok(Build {
                open: *library.get(b"bth_open\0").with_context(|| lacks("bth_open"))?,
                close: *library.get(b"bth_close\0").with_context(|| lacks("bth_close"))?,
                last_error: *library.get(b"bth_last_error\0").with_context(|| lacks("bth_last_error"))?,
                nearest: *library.get(b"bth_nearest\0").with_context(|| lacks("bth_nearest"))?,
                any: *library.get(b"bth_any\0").with_context(|| lacks("bth_any"))?,
            })
        }
    }

    /// Returns true if the builds were loaded from two files: each chooses its instruction set
    /// separately.
    pub(super) fn is_other_than(&self, other: &Build) -> bool {
        self.nearest as usize != other.nearest as usize
    }

    /// Opens a compiled file with this build.
    pub(super) fn open(&self, file: &Path) -> Result<OpenedByBuild<'_>> {
        let name = CString::new(file.as_os_str().as_encoded_bytes()).context("a path without zero bytes")?;
        let mut scene = std::ptr::null_mut();
        // SAFETY: a zero-terminated path and a place for the scene, as bth.h demands.
        let code = unsafe { (self.open)(name.as_ptr(), READ, &mut scene) };
        if code != 0 {
            // SAFETY: bth_last_error returns a zero-terminated text that stays until the next call
            // of this thread.
            let text = unsafe { CStr::from_ptr((self.last_error)()) };
            bail!("{}: {}", file.display(), text.to_string_lossy());
        }
        ensure!(!scene.is_null(), "{}: bth_open returned no scene", file.display());
        Ok(OpenedByBuild { build: self, scene })
    }
}

/// A file that a build has opened; closed when it is dropped.
pub(super) struct OpenedByBuild<'a> {
    build: &'a Build,
    scene: *mut c_void,
}

impl OpenedByBuild<'_> {
    /// Traces rays, in calls of `batch` rays.
    pub(super) fn trace(&self, rays: &[Ray], answers: &mut Answers, batch: usize) {
        let Build { nearest, any, .. } = self.build;
        match answers {
            Answers::Nearest(hits) => {
                for (rays, hits) in rays.chunks(batch).zip(hits.chunks_mut(batch)) {
                    // SAFETY: rays and hits are slices of the length that is passed; the reserved
                    // argument is null; the scene is open.
                    unsafe { nearest(self.scene, rays.as_ptr(), null(), hits.as_mut_ptr(), rays.len()) }
                }
            }
            Answers::Any(found) => {
                for (rays, found) in rays.chunks(batch).zip(found.chunks_mut(batch)) {
                    // SAFETY: as above; the library writes 0 or 1 to each byte.
                    unsafe { any(self.scene, rays.as_ptr(), null(), found.as_mut_ptr(), rays.len()) }
                }
            }
        }
    }
}

impl Drop for OpenedByBuild<'_> {
    fn drop(&mut self) {
        // SAFETY: the scene was opened by this build and is closed once.
        unsafe { (self.build.close)(self.scene) }
    }
}
