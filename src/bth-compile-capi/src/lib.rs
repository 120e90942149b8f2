//! C interface of the compiler. Its documentation is the header `include/bth_compile.h`, which must
//! be kept consistent with this crate. It is a separate library because the runtime does not
//! depend on the compiler.
#![allow(unsafe_code)] // Functions take pointers from C.

mod monitor;
pub mod options;
mod rounding;

use bth_cache::{DEFAULT_CAP, Store};
use compiler::cached::Cache;
use compiler::error::for_callers;
use compiler::memory::{self, Instance, PositionRows, TriangleMesh};
use compiler::pipeline::{self, CompileOptions, Structure};
use compiler::write::Content;
use compiler::{Error, Monitor};
use monitor::Callbacks;
use options::Options;
use serde_json::Value;
use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::OnceLock;

// Results of functions, `BTH_COMPILE_OK` and `BTH_COMPILE_ERROR_*` in C.
const OK: i32 = 0;
const ERROR_ARGUMENT: i32 = -1;
const ERROR_FILE: i32 = -2;
const ERROR_INPUT: i32 = -3;
const ERROR_LIMIT: i32 = -4;
const ERROR_INTERNAL: i32 = -5;
const ERROR_CANCELLED: i32 = -6;

thread_local! {
    /// Result of [`bth_compile_last_error`].
    static LAST_ERROR: RefCell<CString> = RefCell::default();
}

/// A code and a text.
pub(crate) struct Failure(i32, String);

/// Invalid argument.
pub(crate) fn argument(text: String) -> Failure {
    Failure(ERROR_ARGUMENT, text)
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let code = match &error {
            Error::Input { .. } => ERROR_INPUT,
            Error::File { .. } => ERROR_FILE,
            // Options that exclude each other.
            Error::Limit { code: "BTH-L033", .. } => ERROR_ARGUMENT,
            Error::Limit { .. } => ERROR_LIMIT,
            Error::Internal { .. } => ERROR_INTERNAL,
            Error::Cancelled => ERROR_CANCELLED,
        };
        Failure(code, for_callers(&error.to_string()))
    }
}

/// `bth_mesh` and `bth_mesh64` of `bth_compile.h`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Mesh<T> {
    positions: *const [T; 3],
    position_count: usize,
    triangles: *const [u32; 3],
    triangle_count: usize,
}

/// `bth_mesh_instance` of `bth_compile.h`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct MeshInstance {
    to_world: [[f64; 4]; 3],
    mesh: u32,
    reserved: u32,
}

/// `bth_bytes` of `bth_compile.h`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Bytes {
    data: *mut u8,
    length: usize,
}

const NO_BYTES: Bytes = Bytes { data: std::ptr::null_mut(), length: 0 };

/// Compiles a mesh; see `bth_compile.h`.
///
/// # Safety
/// Each pointer, those in structures included, is null or valid as `bth_compile.h` says, and nobody
/// writes to what they point to during the call; `bytes` is null or valid for writes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_compile_mesh(
    mesh: *const Mesh<f32>,
    options: *const Options,
    bytes: *mut Bytes,
) -> i32 {
    // SAFETY: the contract is the same.
    unsafe { compile_mesh(mesh, PositionRows::F32, options, bytes) }
}

/// Compiles a mesh of double positions; see `bth_compile.h`.
///
/// # Safety
/// The contract of [`bth_compile_mesh`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_compile_mesh_f64(
    mesh: *const Mesh<f64>,
    options: *const Options,
    bytes: *mut Bytes,
) -> i32 {
    // SAFETY: the contract is the same.
    unsafe { compile_mesh(mesh, PositionRows::F64, options, bytes) }
}

/// Compiles a mesh.
///
/// # Safety
/// The contract of [`bth_compile_mesh`].
unsafe fn compile_mesh<'a, T: 'a>(
    mesh: *const Mesh<T>,
    rows: fn(&'a [[T; 3]]) -> PositionRows<'a>,
    options: *const Options,
    bytes: *mut Bytes,
) -> i32 {
    // SAFETY: by contract `mesh` is null or valid for reads, and so are its arrays.
    let input = unsafe {
        let no_mesh = || argument("mesh must not be null".into());
        mesh.as_ref().ok_or_else(no_mesh).and_then(|mesh| mesh.view(rows))
    };
    // SAFETY: the contract of this function includes the contract of `with_bytes`.
    unsafe {
        with_bytes(options, bytes, input, |mesh, options, cache, monitor| {
            let compiled = pipeline::compile_cached(*mesh, options, cache, &|_| true, monitor)?;
            Ok((compiled.content, compiled.report))
        })
    }
}

/// Compiles a model file; see `bth_compile.h`.
///
/// # Safety
/// The contract of [`bth_compile_mesh`], with `path` for `mesh`: it is null or points to a C
/// string.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_compile_file(
    path: *const c_char,
    options: *const Options,
    bytes: *mut Bytes,
) -> i32 {
    // SAFETY: by contract it is null, and then rejected, or points to a C string.
    let path = (!path.is_null()).then(|| unsafe { CStr::from_ptr(path) }).and_then(|path| path.to_str().ok());
    let path = path
        .map(Path::new)
        .ok_or_else(|| argument("expected a path in UTF-8, found null or other bytes".into()));
    // SAFETY: the contract of this function includes the contract of `with_bytes`.
    unsafe {
        with_bytes(options, bytes, path, |path, options, cache, monitor| {
            let compiled = pipeline::compile_cached(*path, options, cache, &|_| true, monitor)?;
            Ok((compiled.content, compiled.report))
        })
    }
}

/// Compiles a scene; see `bth_compile.h`.
///
/// # Safety
/// The contract of [`bth_compile_mesh`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_compile_scene(
    meshes: *const Mesh<f32>,
    mesh_count: usize,
    instances: *const MeshInstance,
    instance_count: usize,
    options: *const Options,
    bytes: *mut Bytes,
) -> i32 {
    // SAFETY: the contract is the same.
    unsafe {
        let meshes = views(meshes, mesh_count, PositionRows::F32);
        compile_scene(meshes, (instances, instance_count), options, bytes)
    }
}

/// Compiles a scene of meshes of double positions; see `bth_compile.h`.
///
/// # Safety
/// The contract of [`bth_compile_mesh`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_compile_scene_f64(
    meshes: *const Mesh<f64>,
    mesh_count: usize,
    instances: *const MeshInstance,
    instance_count: usize,
    options: *const Options,
    bytes: *mut Bytes,
) -> i32 {
    // SAFETY: the contract is the same.
    unsafe {
        let meshes = views(meshes, mesh_count, PositionRows::F64);
        compile_scene(meshes, (instances, instance_count), options, bytes)
    }
}

/// Compiles a scene.
///
/// # Safety
/// The contract of [`bth_compile_mesh`].
unsafe fn compile_scene(
    meshes: Result<Vec<TriangleMesh<'_>>, Failure>,
    (instances, instance_count): (*const MeshInstance, usize),
    options: *const Options,
    bytes: *mut Bytes,
) -> i32 {
    // SAFETY: by contract the array is null or valid for reads.
    let placed = |meshes| unsafe { Ok((meshes, placed(slice(instances, instance_count, "instances")?)?)) };
    // SAFETY: the contract of this function includes the contract of `with_bytes`.
    unsafe {
        with_bytes(options, bytes, meshes.and_then(placed), |(meshes, instances), options, cache, monitor| {
            let compiled = memory::compile_scene(meshes, instances, options, cache, monitor)?;
            Ok((compiled.content, compiled.report))
        })
    }
}

/// The meshes of a scene.
///
/// # Safety
/// The contract of [`Mesh::view`], for this array and the arrays of the meshes.
unsafe fn views<'a, T: 'a>(
    meshes: *const Mesh<T>,
    count: usize,
    rows: fn(&'a [[T; 3]]) -> PositionRows<'a>,
) -> Result<Vec<TriangleMesh<'a>>, Failure> {
    // SAFETY: by contract the arrays are null or valid for reads.
    unsafe { slice(meshes, count, "meshes")?.iter().map(|mesh| mesh.view(rows)).collect() }
}

/// The instances of a scene.
fn placed(instances: &[MeshInstance]) -> Result<Vec<Instance>, Failure> {
    if let Some(row) = instances.iter().position(|i| i.reserved != 0) {
        return Err(argument(format!(
            "reserved of instance {row} must be 0, found {}",
            instances[row].reserved
        )));
    }
    Ok(instances.iter().map(|i| Instance { mesh: i.mesh, to_world: i.to_world }).collect())
}

impl<T> Mesh<T> {
    /// The arrays as slices.
    ///
    /// # Safety
    /// Each array is null or valid for reads, and not written to during the life of the result.
    unsafe fn view<'a>(&self, rows: fn(&'a [[T; 3]]) -> PositionRows<'a>) -> Result<TriangleMesh<'a>, Failure>
    where
        T: 'a,
    {
        // SAFETY: the contract of this function is the contract of `slice`.
        unsafe {
            Ok(TriangleMesh {
                positions: rows(slice(self.positions, self.position_count, "positions")?),
                triangles: slice(self.triangles, self.triangle_count, "triangles")?,
            })
        }
    }
}

/// An array as a slice; null is one without elements.
///
/// # Safety
/// `first` is null or points to `count` elements, which are not written to during the life of the
/// result.
unsafe fn slice<'a, T>(first: *const T, count: usize, name: &str) -> Result<&'a [T], Failure> {
    if count == 0 {
        return Ok(&[]);
    }
    if first.is_null() || count.checked_mul(size_of::<T>()).is_none_or(|bytes| bytes > isize::MAX as usize) {
        return Err(argument(format!("{count} {name} expected, found null or more than fit into memory")));
    }
    // SAFETY: it is not null and the bytes fit into an `isize`; by contract it points to `count`
    // elements. All bit patterns are valid for the types of this crate that C fills.
    Ok(unsafe { std::slice::from_raw_parts(first, count) })
}

/// Runs a compilation with options of C and stores what it makes, or the error.
///
/// # Safety
/// `options` is null or valid for reads, its paths are null or C strings, its functions may be
/// called by any thread, and its other pointers are null or valid for writes; `bytes` is null or
/// valid for writes.
unsafe fn with_bytes<T: Sync>(
    options: *const Options,
    bytes: *mut Bytes,
    input: Result<T, Failure>,
    compile: impl FnOnce(
        &T,
        &CompileOptions,
        &Cache<'_>,
        &dyn Monitor,
    ) -> compiler::Result<(Option<Content>, Value)>
    + Send,
) -> i32 {
    // SAFETY: by contract it is null or valid for reads.
    let options = unsafe { options.as_ref() }.copied().unwrap_or_default();
    let run = || {
        if bytes.is_null() {
            return Err(argument("bytes must not be null".into()));
        }
        let input = input?;
        // SAFETY: by contract its paths are null or C strings.
        let (chosen, folder) = unsafe { (options.compiler()?, options.cache()?) };
        let store = folder.map(|folder| {
            let cannot = |e| {
                let hint = "hint: name a folder that can be made and written to, or null";
                Failure(ERROR_FILE, format!("{}: cannot be a cache: {e} ({hint})", folder.display()))
            };
            Store::open(&folder, DEFAULT_CAP).map_err(cannot)
        });
        let store = store.transpose()?;
        let cache = store.as_ref().map_or_else(Cache::none, |store| Cache::new(store, "memory"));
        let monitor = Callbacks::new(&options);
        let worker = chosen.tets.worker.as_ref().filter(|_| chosen.structure != Structure::Bvh);
        if let Some(absent) = worker.filter(|worker| !worker.is_file()) {
            monitor.warn(&format!(
                "tetgen: there is no program {}; nothing is tetrahedralized",
                absent.display()
            ));
        }
        let (content, report) =
            in_threads(options.threads, || Ok(compile(&input, &chosen, &cache, &monitor)?))?;
        let content = content.ok_or_else(|| Failure(ERROR_INTERNAL, "no content".into()))?;
        Ok((content.bytes()?.into_owned(), report))
    };
    let outcome = catch_unwind(AssertUnwindSafe(run))
        .unwrap_or_else(|_| Err(Failure(ERROR_INTERNAL, "internal error".to_owned())));
    let (stored, report, code) = match outcome {
        Ok((made, report)) => {
            let made = Box::leak(made.into_boxed_slice());
            (Bytes { data: made.as_mut_ptr(), length: made.len() }, report, OK)
        }
        Err(Failure(code, text)) => {
            let text = CString::new(text.replace('\0', "?")).unwrap_or_default();
            LAST_ERROR.with(|last| *last.borrow_mut() = text);
            (NO_BYTES, Value::Null, code)
        }
    };
    // SAFETY: by contract they are null, and then skipped, or valid for writes.
    unsafe { rounding::store(&report, [options.rounding, options.avoided_rounding]) };
    // SAFETY: by contract it is null, and then skipped, or valid for writes.
    unsafe { bytes.as_mut() }.into_iter().for_each(|out| *out = stored);
    code
}

/// Runs a function in a pool of `threads` threads; 0 for the pool that all share.
fn in_threads<T: Send>(threads: u32, work: impl FnOnce() -> Result<T, Failure> + Send) -> Result<T, Failure> {
    let no_threads = |which: &str, why: &str| {
        Failure::from(Error::Limit { code: "BTH-L090", message: format!("cannot start {which}: {why}") })
    };
    if threads == 0 {
        return match why_there_is_no_shared_pool() {
            Some(why) => Err(no_threads("a thread for each processor", why)),
            None => work(),
        };
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads as usize).build();
    pool.map_err(|e| no_threads(&format!("{threads} threads"), &e.to_string()))?.install(work)
}

/// Why the pool that all share could not be started, which is tried once: what needs it panics
/// then.
fn why_there_is_no_shared_pool() -> Option<&'static str> {
    static WHY: OnceLock<Option<String>> = OnceLock::new();
    let failed = || {
        let error = rayon::ThreadPoolBuilder::new().build_global().err()?;
        // Without a source it says that the pool is there already.
        std::error::Error::source(&error).map(ToString::to_string)
    };
    WHY.get_or_init(failed).as_deref()
}

/// Frees bytes; see `bth_compile.h`.
///
/// # Safety
/// `bytes` is null, or what it points to comes from this library or is null and 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_free_bytes(bytes: *mut Bytes) {
    // SAFETY: by contract it is null or valid for reads and writes.
    let Some(bytes) = (unsafe { bytes.as_mut() }) else { return };
    let Bytes { data, length } = std::mem::replace(bytes, NO_BYTES);
    if !data.is_null() {
        // SAFETY: `with_bytes` leaked a boxed slice of this address and length, which by contract
        // has not been freed.
        drop(unsafe { Box::from_raw(std::ptr::slice_from_raw_parts_mut(data, length)) });
    }
}

/// Text of the last error on this thread; see `bth_compile.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_compile_last_error() -> *const c_char {
    LAST_ERROR.with(|last| last.borrow().as_ptr())
}

/// Version of this library; see `bth_compile.h`.
#[unsafe(no_mangle)]
pub extern "C" fn bth_compile_version() -> *const c_char {
    const VERSION: &CStr =
        match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
            Ok(version) => version,
            Err(_) => panic!("a version has no zero byte"),
        };
    VERSION.as_ptr()
}
