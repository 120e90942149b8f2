//! C interface of bth. Its documentation is the header `include/bth.h`, which must be kept
//! consistent with this crate. Pointers that are null or valid by its contract are references
//! here; arrays are pointers.
#![allow(unsafe_code)] // Most functions take pointers from C.

pub mod builder;
pub mod deform;
pub mod hits;
pub mod materials;
pub mod memory;
pub mod motion;
pub mod points;
mod query;
pub mod starts;
pub mod surface;

use query::{Arguments, guarded};
use runtime::rays::{Hit, PrimitiveRef, Ray};
use runtime::{Code, Error, Scene};
use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char};
use std::mem::MaybeUninit;
use std::panic::catch_unwind;
use std::path::Path;
use std::slice::{from_mut, from_ref};

// Flags of `bth_open`.
const READ: u32 = 0;
const MAP: u32 = 1;

// Results of functions, `BTH_OK` and `BTH_ERROR_*` in C.
const OK: i32 = 0;
const ERROR_ARGUMENT: i32 = -1;
const ERROR_FILE: i32 = -2;
const ERROR_FORMAT: i32 = -3;
const ERROR_VERSION: i32 = -4;
const ERROR_INTERNAL: i32 = -5;
const ERROR_SCENE: i32 = -6;
const ERROR_MISSING: i32 = -7;

thread_local! {
    /// Result of [`bth_last_error`].
    static LAST_ERROR: RefCell<CString> = RefCell::default();
}

/// Where a result is stored, unless it is null.
type Out<'a, T> = Option<&'a mut MaybeUninit<T>>;

/// Stores the text of an error for [`bth_last_error`] and returns its code.
fn fail(code: i32, text: String) -> i32 {
    let text = CString::new(text.replace('\0', "?")).unwrap_or_default();
    LAST_ERROR.with(|last| *last.borrow_mut() = text);
    code
}

/// The result in C for an error of the runtime.
fn code_of(error: &Error) -> i32 {
    match error.code() {
        Code::Read => ERROR_FILE,
        Code::Host | Code::Version | Code::Features | Code::UnknownKind => ERROR_VERSION,
        Code::Singular | Code::NotFinite => ERROR_SCENE,
        Code::NoSuchObject
        | Code::NoSuchInstance
        | Code::PlacedByFile
        | Code::Start
        | Code::TooManyInstances
        | Code::NewPositions => ERROR_ARGUMENT,
        Code::NotDeformable => ERROR_MISSING,
        _ => ERROR_FORMAT,
    }
}

/// Opens a file; see `bth.h`.
///
/// # Safety
/// `path` is null or points to a C string; `scene` is null or valid for writes. With the flag
/// `BTH_MAP` the file must keep the contract of [`runtime::map`] until the scene is closed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_open(path: *const c_char, flags: u32, scene: *mut *mut Scene) -> i32 {
    if scene.is_null() || path.is_null() {
        return fail(ERROR_ARGUMENT, "bth_open: path and scene must not be null".into());
    }
    // SAFETY: it is not null, so it is valid for writes by the contract of this function.
    unsafe { *scene = std::ptr::null_mut() };
    // SAFETY: it is not null, so it points to a C string by the contract of this function.
    let Ok(path) = unsafe { CStr::from_ptr(path) }.to_str() else {
        return fail(ERROR_ARGUMENT, "bth_open: the path is not UTF-8".into());
    };
    let opened = catch_unwind(|| match flags {
        READ => Some(runtime::open(Path::new(path))),
        // SAFETY: with this flag the contract of this function includes the contract of `map`.
        MAP => Some(unsafe { runtime::map(Path::new(path)) }),
        _ => None,
    });
    match opened {
        Ok(Some(Ok(opened))) => {
            // SAFETY: it is not null, so it is valid for writes by the contract of this function.
            unsafe { *scene = Box::into_raw(Box::new(opened)) };
            OK
        }
        Ok(Some(Err(error))) => fail(code_of(&error), error.to_string()),
        Ok(None) => fail(ERROR_ARGUMENT, format!("bth_open: unknown flags {flags:#x}")),
        Err(_) => fail(ERROR_INTERNAL, format!("{path}: internal error")),
    }
}

/// Closes a scene, which [`bth_open`] or a function like it opened; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_close(scene: Option<Box<Scene>>) {
    drop(scene);
}

/// Text of the last error on this thread; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_last_error() -> *const c_char {
    LAST_ERROR.with(|last| last.borrow().as_ptr())
}

/// The result of a query without a scene, rays or room for results.
#[cold]
fn null_argument() -> i32 {
    fail(ERROR_ARGUMENT, "scene, rays or points, and results of a query must not be null".into())
}

/// Nearest hits; see `bth.h`.
///
/// # Safety
/// `scene` is null or open. `rays` and `hits` are each null or point to `count` elements. The
/// elements of `hits` are valid for writes and do not overlap the others.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_nearest(
    scene: *const Scene,
    rays: *const Ray,
    _reserved: *const PrimitiveRef,
    hits: *mut Hit,
    count: usize,
) -> i32 {
    if count == 1 {
        // SAFETY: by contract each pointer is null or points to one element, and `hits` is valid
        // for writes. `Ray` and `Hit` have the layout of the C structs, and all bit patterns are
        // valid for them.
        let one = unsafe { (scene.as_ref(), rays.as_ref(), hits.as_mut()) };
        if let (Some(scene), Some(ray), Some(hit)) = one {
            // With nothing but the kernel behind it, no registers are saved for what only batches
            // need.
            let (ray, hits) = (from_ref(ray), from_mut(hit));
            return guarded(|| scene.batch(ray).nearest(hits)).unwrap_or_else(|code| {
                hits.fill(Hit::MISS);
                code
            });
        }
    }
    // SAFETY: the contract is the same.
    unsafe { nearest_of_batch(Arguments { scene, asked: rays, answers: hits, count }) }
}

/// [`bth_nearest`] for any number of rays.
///
/// # Safety
/// The arguments are as in [`Arguments`].
#[inline(never)]
unsafe fn nearest_of_batch(arguments: Arguments<Ray, Hit>) -> i32 {
    // SAFETY: the contract is the same. `Ray` and `Hit` have the layout of the C structs.
    unsafe { arguments.store(Hit::MISS, |scene, rays, hits| scene.batch(rays).nearest(hits)) }
}

/// Stores which rays hit anything; see `bth.h`.
///
/// # Safety
/// The contract of [`bth_nearest`], with `hit` for `hits`: it is null or points to `count` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_any(
    scene: *const Scene,
    rays: *const Ray,
    _reserved: *const PrimitiveRef,
    hit: *mut u8,
    count: usize,
) -> i32 {
    if count == 1 {
        // SAFETY: as in `bth_nearest`; `hit` is null or points to a byte that is valid for writes.
        let one = unsafe { (scene.as_ref(), rays.as_ref(), hit.as_mut()) };
        if let (Some(scene), Some(ray), Some(hit)) = one {
            let (ray, mut found) = (from_ref(ray), [false]);
            let code = guarded(|| scene.batch(ray).any(&mut found)).unwrap_or_else(|code| code);
            *hit = (code == OK && found[0]).into();
            return code;
        }
    }
    // SAFETY: the contract is the same.
    unsafe { any_of_batch(Arguments { scene, asked: rays, answers: hit, count }) }
}

/// [`bth_any`] for any number of rays.
///
/// # Safety
/// The arguments are as in [`Arguments`].
#[inline(never)]
unsafe fn any_of_batch(arguments: Arguments<Ray, u8>) -> i32 {
    // SAFETY: the contract is the same. The caller's bytes are not used as a slice of `bool`, which
    // has invalid bit patterns.
    unsafe { arguments.store_as(false, |scene, rays, found| scene.batch(rays).any(found), u8::from) }
}

/// Bytes of the sections that traversal reads; see `bth.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_resident_bytes(scene: Option<&Scene>) -> u64 {
    scene.map_or(0, Scene::resident_bytes)
}
