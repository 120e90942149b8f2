//! Another library with the same interface, which answers what bth does not hold.
//!
//! `BTH_EMBREE_FALLBACK` names its file; `none` forbids it. Otherwise it is a library that the
//! process has already loaded, or the one that the system finds.
#![allow(unsafe_code)] // Loads a library and calls it.

use crate::abi::*;
use crate::error::{Failure, Result};
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::sync::OnceLock;

/// The environment variable that names the library.
const VARIABLE: &str = "BTH_EMBREE_FALLBACK";

/// Name under which systems have it.
const USUAL_NAME: &CStr = c"libembree4.so.4";

/// Defines the functions that are called, with their signatures from the documentation.
macro_rules! functions {
    ($($name:ident($($type:ty),*) $(-> $result:ty)?;)+) => {
        /// The functions of the library.
        #[allow(non_snake_case)]
        #[derive(Debug)]
        pub(crate) struct Functions {
            $(pub(crate) $name: unsafe extern "C" fn($($type),*) $(-> $result)?,)+
        }

        impl Functions {
            /// Finds all of them.
            ///
            /// # Safety
            /// `library` is an open library with the interface of Embree 4.
            unsafe fn load(library: *mut c_void) -> std::result::Result<Functions, String> {
                Ok(Functions { $(
                    $name: {
                        let name = concat!(stringify!($name), "\0");
                        // SAFETY: the library is open and the name ends with 0.
                        let found = unsafe { libc::dlsym(library, name.as_ptr().cast()) };
                        if found.is_null() {
                            return Err(concat!("it has no ", stringify!($name)).to_owned());
                        }
                        // SAFETY: by contract the function of this name has this signature.
                        unsafe { std::mem::transmute::<*mut c_void, unsafe extern "C" fn($($type),*) $(-> $result)?>(found) }
                    },
                )+ })
            }
        }
    };
}

functions! {
    rtcNewDevice(*const c_char) -> Handle;
    rtcReleaseDevice(Handle);
    rtcGetDeviceProperty(Handle, u32) -> isize;
    rtcSetDeviceErrorFunction(Handle, Option<ErrorFunction>, *mut c_void);
    rtcNewScene(Handle) -> Handle;
    rtcReleaseScene(Handle);
    rtcCommitScene(Handle);
    rtcSetSceneFlags(Handle, u32);
    rtcSetSceneBuildQuality(Handle, u32);
    rtcGetSceneBounds(Handle, *mut Bounds);
    rtcGetSceneLinearBounds(Handle, *mut [Bounds; 2]);
    rtcAttachGeometryByID(Handle, Handle, u32);
    rtcDetachGeometry(Handle, u32);
    rtcNewGeometry(Handle, u32) -> Handle;
    rtcReleaseGeometry(Handle);
    rtcCommitGeometry(Handle);
    rtcSetGeometryTimeStepCount(Handle, u32);
    rtcSetGeometryTimeRange(Handle, f32, f32);
    rtcSetGeometryVertexAttributeCount(Handle, u32);
    rtcSetGeometryMask(Handle, u32);
    rtcSetGeometryBuildQuality(Handle, u32);
    rtcSetGeometryMaxRadiusScale(Handle, f32);
    rtcSetSharedGeometryBuffer(Handle, u32, u32, u32, *const c_void, usize, usize, usize);
    rtcUpdateGeometryBuffer(Handle, u32, u32);
    rtcSetGeometryIntersectFilterFunction(Handle, *const c_void);
    rtcSetGeometryOccludedFilterFunction(Handle, *const c_void);
    rtcSetGeometryEnableFilterFunctionFromArguments(Handle, bool);
    rtcSetGeometryUserData(Handle, *mut c_void);
    rtcSetGeometryPointQueryFunction(Handle, *const c_void);
    rtcSetGeometryUserPrimitiveCount(Handle, u32);
    rtcSetGeometryBoundsFunction(Handle, *const c_void, *mut c_void);
    rtcSetGeometryIntersectFunction(Handle, *const c_void);
    rtcSetGeometryOccludedFunction(Handle, *const c_void);
    rtcSetGeometryInstancedScene(Handle, Handle);
    rtcSetGeometryInstancedScenes(Handle, *mut Handle, usize);
    rtcSetGeometryTransform(Handle, u32, u32, *const c_void);
    rtcSetGeometryTransformQuaternion(Handle, u32, *const c_void);
    rtcGetGeometryTransformEx(Handle, u32, f32, u32, *mut c_void);
    rtcSetGeometryTessellationRate(Handle, f32);
    rtcSetGeometryTopologyCount(Handle, u32);
    rtcSetGeometrySubdivisionMode(Handle, u32, u32);
    rtcSetGeometryVertexAttributeTopology(Handle, u32, u32);
    rtcSetGeometryDisplacementFunction(Handle, *const c_void);
    rtcGetGeometryFirstHalfEdge(Handle, u32) -> u32;
    rtcGetGeometryFace(Handle, u32) -> u32;
    rtcGetGeometryNextHalfEdge(Handle, u32) -> u32;
    rtcGetGeometryPreviousHalfEdge(Handle, u32) -> u32;
    rtcGetGeometryOppositeHalfEdge(Handle, u32, u32) -> u32;
    rtcInterpolate(*const InterpolateArguments);
    rtcInvokeIntersectFilterFromGeometry(*const c_void, *const c_void);
    rtcInvokeOccludedFilterFromGeometry(*const c_void, *const c_void);
    rtcPointQuery(Handle, *mut PointQuery, *mut PointQueryContext, Option<PointQueryFunction>, *mut c_void) -> bool;
    rtcIntersect1(Handle, *mut RayHit, *mut QueryArguments);
    rtcOccluded1(Handle, *mut Ray, *mut QueryArguments);
    rtcForwardIntersect1Ex(*const CallbackArguments, Handle, *mut c_void, u32, u32);
    rtcForwardIntersect4Ex(*const c_int, *const CallbackArguments, Handle, *mut c_void, u32, u32);
    rtcForwardIntersect8Ex(*const c_int, *const CallbackArguments, Handle, *mut c_void, u32, u32);
    rtcForwardIntersect16Ex(*const c_int, *const CallbackArguments, Handle, *mut c_void, u32, u32);
    rtcForwardOccluded1Ex(*const CallbackArguments, Handle, *mut c_void, u32, u32);
    rtcForwardOccluded4Ex(*const c_int, *const CallbackArguments, Handle, *mut c_void, u32, u32);
    rtcForwardOccluded8Ex(*const c_int, *const CallbackArguments, Handle, *mut c_void, u32, u32);
    rtcForwardOccluded16Ex(*const c_int, *const CallbackArguments, Handle, *mut c_void, u32, u32);
    rtcCollide(Handle, Handle, *const c_void, *mut c_void);
    rtcNewBVH(Handle) -> Handle;
    rtcBuildBVH(*const c_void) -> *mut c_void;
    rtcThreadLocalAlloc(Handle, usize, usize) -> *mut c_void;
    rtcRetainBVH(Handle);
    rtcReleaseBVH(Handle);
}

/// A device of the library.
#[derive(Debug)]
pub(crate) struct Fallback {
    pub(crate) functions: &'static Functions,
    pub(crate) device: Handle,
}

// SAFETY: devices may be used from any thread.
unsafe impl Send for Fallback {}
// SAFETY: as above.
unsafe impl Sync for Fallback {}

impl Fallback {
    /// A device of the library with the configuration of the program; `None` if there is no library
    /// or it is forbidden.
    ///
    /// # Errors
    /// If the library that was named cannot be used, or one was built in a way that is not known.
    pub(crate) fn find(configuration: &str) -> Result<Option<Fallback>> {
        let library = LIBRARY.get_or_init(Library::find).as_ref();
        let unknown = |message: &String| Failure { code: ErrorCode::Unknown, message: message.clone() };
        let Some(library) = library.map_err(unknown)? else { return Ok(None) };
        let text = CString::new(configuration).unwrap_or_default();
        // SAFETY: the text ends with 0.
        let device = unsafe { (library.functions.rtcNewDevice)(text.as_ptr()) };
        if device.is_null() {
            return Err(unknown(&"the other Embree 4 makes no device".to_owned()));
        }
        Ok(Some(Fallback { functions: &library.functions, device }))
    }

    /// A property of its device.
    pub(crate) fn property(&self, property: u32) -> isize {
        // SAFETY: the device lives as long as this.
        unsafe { (self.functions.rtcGetDeviceProperty)(self.device, property) }
    }
}

impl Drop for Fallback {
    fn drop(&mut self) {
        // SAFETY: the device is ours and released once.
        unsafe { (self.functions.rtcReleaseDevice)(self.device) };
    }
}

/// The loaded library.
struct Library {
    functions: Functions,
}

/// The library, once it was looked for.
static LIBRARY: OnceLock<std::result::Result<Option<Library>, String>> = OnceLock::new();

/// The functions of the library, if one was found.
pub(crate) fn functions() -> Option<&'static Functions> {
    LIBRARY.get()?.as_ref().ok()?.as_ref().map(|library| &library.functions)
}

/// True if hits have the word of instance arrays, as the other library was built. Without another
/// library they have, which is the default since Embree 4.3.
static HAS_INSTANCE_ARRAYS: OnceLock<bool> = OnceLock::new();

/// Returns true if hits have the word of instance arrays.
#[inline(always)]
pub(crate) fn has_instance_arrays() -> bool {
    *HAS_INSTANCE_ARRAYS.get().unwrap_or(&true)
}

impl Library {
    fn find() -> std::result::Result<Option<Library>, String> {
        let Some((library, name)) = open()? else { return Ok(None) };
        // SAFETY: the library is open, and has the name of one with this interface.
        let functions = unsafe { Functions::load(library) }.map_err(|why| format!("{name}: {why}"))?;
        // SAFETY: the functions come from the library.
        let layout = unsafe { probe(&functions) }.map_err(|why| format!("{name}: {why}"))?;
        HAS_INSTANCE_ARRAYS.get_or_init(|| layout);
        Ok(Some(Library { functions }))
    }
}

/// Opens the library.
fn open() -> std::result::Result<Option<(*mut c_void, String)>, String> {
    let named = std::env::var(VARIABLE).ok();
    if named.as_deref() == Some("none") {
        return Ok(None);
    }
    let (path, flags) = match &named {
        Some(path) => (CString::new(path.as_str()).unwrap_or_default(), 0),
        None => match loaded() {
            Some(path) => (path, libc::RTLD_NOLOAD),
            None => (USUAL_NAME.to_owned(), 0),
        },
    };
    // What it calls by name is to be found in it, not in us.
    let flags = flags | libc::RTLD_NOW | libc::RTLD_LOCAL | libc::RTLD_DEEPBIND;
    // SAFETY: the path ends with 0; the initializers of the library may run here.
    let library = unsafe { libc::dlopen(path.as_ptr(), flags) };
    let name = path.to_string_lossy().into_owned();
    if library.is_null() {
        return match named {
            Some(_) => Err(format!("{name}: cannot be loaded ({VARIABLE} names it)")),
            None => Ok(None),
        };
    }
    // SAFETY: the library is open and the name ends with 0.
    let found = unsafe { libc::dlsym(library, c"rtcNewDevice".as_ptr()) };
    // Where we have its name, the system finds us.
    let is_other = !found.is_null() && base(found) != base(open as *const c_void);
    Ok(is_other.then_some((library, name)))
}

/// The path of a library of this kind that the process has loaded, and that is not this one.
fn loaded() -> Option<CString> {
    struct Search {
        own: usize,
        found: Option<CString>,
    }
    unsafe extern "C" fn visit(info: *mut libc::dl_phdr_info, _: usize, search: *mut c_void) -> c_int {
        // SAFETY: the system gives a valid structure, and we the search.
        let (info, search) = unsafe { (&*info, &mut *search.cast::<Search>()) };
        if info.dlpi_name.is_null() || info.dlpi_addr as usize == search.own {
            return 0;
        }
        // SAFETY: the name ends with 0.
        let path = unsafe { CStr::from_ptr(info.dlpi_name) };
        let is_it =
            path.to_string_lossy().rsplit('/').next().is_some_and(|name| name.starts_with("libembree4"));
        if is_it {
            search.found = Some(path.to_owned());
        }
        c_int::from(is_it)
    }
    let mut search = Search { own: base(loaded as *const c_void), found: None };
    // SAFETY: `visit` has the signature that is asked for, and the search outlives the call.
    unsafe { libc::dl_iterate_phdr(Some(visit), (&raw mut search).cast()) };
    search.found
}

/// Where the library that a function belongs to is loaded.
fn base(function: *const c_void) -> usize {
    // SAFETY: all zeros are a valid value.
    let mut info: libc::Dl_info = unsafe { std::mem::zeroed() };
    // SAFETY: both pointers are valid.
    unsafe { libc::dladdr(function, &mut info) };
    info.dli_fbase as usize
}

/// How the library was built: true if hits have the word of instance arrays.
///
/// # Errors
/// If hits are laid out in another way, such as for several levels of instances.
///
/// # Safety
/// The functions come from a library with the interface of Embree 4.
unsafe fn probe(functions: &Functions) -> std::result::Result<bool, String> {
    const UNTOUCHED: u32 = 0xABCD_1234;
    const ID: u32 = 5;
    let positions = [[0.0f32; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0; 3]];
    let triangle = [0u32, 1, 2, 0];
    let mut words = [UNTOUCHED; 48];
    let ray = [0.25f32, 0.25, 1.0, 0.0, 0.0, 0.0, -1.0, 0.0, f32::INFINITY];
    words.iter_mut().zip(ray).for_each(|(word, number)| *word = number.to_bits());
    (words[9], words[10], words[11]) = (u32::MAX, 0, 0);
    // The hit is a miss yet.
    words[17] = INVALID_ID;
    words[18] = INVALID_ID;
    #[repr(align(64))]
    struct Memory([u32; 48]);
    let mut memory = Memory(words);
    // SAFETY: the calls are as the documentation asks; the arrays outlive the objects, and the
    // memory of the ray has room for the hits of all known layouts.
    unsafe {
        let device = (functions.rtcNewDevice)(c"".as_ptr());
        let (inner, outer) = ((functions.rtcNewScene)(device), (functions.rtcNewScene)(device));
        let mesh = (functions.rtcNewGeometry)(device, TRIANGLE);
        let set = functions.rtcSetSharedGeometryBuffer;
        set(mesh, BUFFER_VERTEX, 0, FORMAT_FLOAT3, positions.as_ptr().cast(), 0, 12, 3);
        set(mesh, BUFFER_INDEX, 0, FORMAT_UINT3, triangle.as_ptr().cast(), 0, 12, 1);
        (functions.rtcCommitGeometry)(mesh);
        (functions.rtcAttachGeometryByID)(inner, mesh, 0);
        (functions.rtcCommitScene)(inner);
        let instance = (functions.rtcNewGeometry)(device, INSTANCE);
        (functions.rtcSetGeometryInstancedScene)(instance, inner);
        (functions.rtcCommitGeometry)(instance);
        (functions.rtcAttachGeometryByID)(outer, instance, ID);
        (functions.rtcCommitScene)(outer);
        (functions.rtcIntersect1)(outer, memory.0.as_mut_ptr().cast(), std::ptr::null_mut());
        (functions.rtcReleaseGeometry)(mesh);
        (functions.rtcReleaseGeometry)(instance);
        (functions.rtcReleaseScene)(inner);
        (functions.rtcReleaseScene)(outer);
        (functions.rtcReleaseDevice)(device);
    }
    let tail = &memory.0[RAY_WORDS + 5..RAY_WORDS + 11];
    match *tail {
        [0, 0, ID, 0, UNTOUCHED, _] => Ok(true),
        [0, 0, ID, UNTOUCHED, UNTOUCHED, _] => Ok(false),
        _ => Err(format!(
            "it was built in a way that is not known: expected hits that end with primitive 0, geometry 0, \
             instance {ID} and perhaps instance primitive 0, found {tail:x?}"
        )),
    }
}
