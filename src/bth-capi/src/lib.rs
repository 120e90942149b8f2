//! C interface of bth. `include/bth.h` is the reference; this file must match it.
#![allow(unsafe_code)] // FFI: every function takes pointers from C.

pub mod motion;

use runtime::rays::{Hit, Ray, Surface};
use runtime::{Code, Error, Scene};
use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

const READ: u32 = 0;
const MAP: u32 = 1;

const OK: i32 = 0;
const ERROR_ARGUMENT: i32 = -1;
const ERROR_FILE: i32 = -2;
const ERROR_FORMAT: i32 = -3;
const ERROR_VERSION: i32 = -4;
const ERROR_INTERNAL: i32 = -5;
const ERROR_SCENE: i32 = -6;

thread_local! {
    static LAST_ERROR: RefCell<CString> = RefCell::default();
}

fn fail(code: i32, text: String) -> i32 {
    let text = CString::new(text.replace('\0', "?")).unwrap_or_default();
    LAST_ERROR.with(|last| *last.borrow_mut() = text);
    code
}

fn code_of(error: &Error) -> i32 {
    match error.code() {
        Code::Read => ERROR_FILE,
        Code::Host | Code::Version | Code::Features | Code::UnknownKind => ERROR_VERSION,
        Code::Singular | Code::NotFinite => ERROR_SCENE,
        _ => ERROR_FORMAT,
    }
}

/// Opens a file; see `bth.h`.
///
/// # Safety
/// `path` is null or a C string; `scene` is null or may be written. With the map flag, the contract of
/// [`runtime::map`] holds for the file until the scene is closed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_open(path: *const c_char, flags: u32, scene: *mut *mut Scene) -> i32 {
    if scene.is_null() || path.is_null() {
        return fail(ERROR_ARGUMENT, "bth_open: path and scene must not be null".into());
    }
    // SAFETY: not null, and writable by contract.
    unsafe { *scene = std::ptr::null_mut() };
    // SAFETY: not null, and the caller passes a C string.
    let Ok(path) = unsafe { CStr::from_ptr(path) }.to_str() else {
        return fail(ERROR_ARGUMENT, "bth_open: the path is not UTF-8".into());
    };
    let opened = catch_unwind(|| match flags {
        READ => Some(runtime::open(Path::new(path))),
        // SAFETY: with the map flag the caller guarantees the contract of `map`.
        MAP => Some(unsafe { runtime::map(Path::new(path)) }),
        _ => None,
    });
    match opened {
        Ok(Some(Ok(opened))) => {
            // SAFETY: as above.
            unsafe { *scene = Box::into_raw(Box::new(opened)) };
            OK
        }
        Ok(Some(Err(error))) => fail(code_of(&error), format!("{path}: {error}")),
        Ok(None) => fail(ERROR_ARGUMENT, format!("bth_open: unknown flags {flags:#x}")),
        Err(_) => fail(ERROR_INTERNAL, format!("{path}: internal error")),
    }
}

/// Closes a scene; see `bth.h`.
///
/// # Safety
/// `scene` is null or comes from [`bth_open`], is closed only once, and no query is running on it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_close(scene: *mut Scene) {
    if !scene.is_null() {
        // SAFETY: made by Box::into_raw in bth_open, and not closed before.
        drop(unsafe { Box::from_raw(scene) });
    }
}

/// Text of the last error on this thread; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_last_error() -> *const c_char {
    LAST_ERROR.with(|last| last.borrow().as_ptr())
}

/// Scene, rays and, unless null, the primitives on which they start.
type Batch<'a> = (&'a Scene, &'a [Ray], Option<&'a [Surface]>);

/// The arguments of a query as slices; `None` when there is nothing to do.
///
/// # Safety
/// Each pointer is null or points to what `bth.h` requires, which outlives the result.
unsafe fn batch<'a>(
    scene: *const Scene,
    rays: *const Ray,
    from: *const Surface,
    count: usize,
) -> Option<Batch<'a>> {
    if scene.is_null() || rays.is_null() || count == 0 {
        return None;
    }
    // SAFETY: not null; a scene from bth_open, and `count` rays and surfaces, which have the layout of the
    // C structs and no invalid values.
    unsafe {
        let from = (!from.is_null()).then(|| std::slice::from_raw_parts(from, count));
        Some((&*scene, std::slice::from_raw_parts(rays, count), from))
    }
}

/// Nearest hits; see `bth.h`.
///
/// # Safety
/// `scene` comes from [`bth_open`] and is open; `rays` and `hits`, and `from` unless null, have `count` elements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_nearest(
    scene: *const Scene,
    rays: *const Ray,
    from: *const Surface,
    hits: *mut Hit,
    count: usize,
) {
    // SAFETY: the caller's contract.
    let Some((scene, rays, from)) = (unsafe { batch(scene, rays, from, count) }) else { return };
    if hits.is_null() {
        return;
    }
    // SAFETY: not null, `count` elements by contract; any bits are a valid `Hit`.
    let hits = unsafe { std::slice::from_raw_parts_mut(hits, count) };
    // Unwinding must not reach C. After a panic, which would be a defect of the library, all rays miss.
    if catch_unwind(AssertUnwindSafe(|| scene.nearest_batch(rays, from, hits))).is_err() {
        hits.fill(Hit::MISS);
    }
}

/// Any hits; see `bth.h`.
///
/// # Safety
/// As for [`bth_nearest`]; `hit` has `count` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_any(
    scene: *const Scene,
    rays: *const Ray,
    from: *const Surface,
    hit: *mut u8,
    count: usize,
) {
    // SAFETY: the caller's contract.
    let Some((scene, rays, from)) = (unsafe { batch(scene, rays, from, count) }) else { return };
    if hit.is_null() {
        return;
    }
    // SAFETY: not null, `count` bytes by contract.
    let hit = unsafe { std::slice::from_raw_parts_mut(hit, count) };
    // `bool` has invalid bit patterns, so the bytes of the caller are not used as `bool`. A single ray takes a path without
    // the buffer of a part.
    if let [hit] = hit {
        let mut found = [false];
        let traced = catch_unwind(AssertUnwindSafe(|| scene.any_batch(rays, from, &mut found)));
        *hit = (traced.is_ok() && found[0]).into();
    } else {
        any_in_parts(scene, rays, from, hit);
    }
}

/// Rays that are traced together by [`bth_any`].
const PART: usize = 1024;

/// Any hits, a [`PART`] at a time.
#[inline(never)]
fn any_in_parts(scene: &Scene, rays: &[Ray], from: Option<&[Surface]>, hit: &mut [u8]) {
    let mut part = [false; PART];
    for (i, (rays, hit)) in rays.chunks(PART).zip(hit.chunks_mut(PART)).enumerate() {
        let from = from.map(|f| &f[i * PART..i * PART + rays.len()]);
        let part = &mut part[..rays.len()];
        if catch_unwind(AssertUnwindSafe(|| scene.any_batch(rays, from, part))).is_err() {
            part.fill(false);
        }
        for (out, found) in hit.iter_mut().zip(part) {
            *out = (*found).into();
        }
    }
}

/// Bytes of the sections that traversal reads; see `bth.h`.
///
/// # Safety
/// `scene` is null or comes from [`bth_open`] and is open.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_resident_bytes(scene: *const Scene) -> u64 {
    // SAFETY: null or valid by contract.
    unsafe { scene.as_ref() }.map_or(0, Scene::resident_bytes)
}
