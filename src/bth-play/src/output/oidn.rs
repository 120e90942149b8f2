//! Open Image Denoise, where its library is installed: loaded when it is needed, so that the
//! program starts without.
#![allow(unsafe_code)]

use crate::shading::Shaded;
use glam::Vec3;
use libloading::{Library, Symbol};
use std::ffi::{CStr, c_char, c_int, c_void};

/// Names of the library, version 2 first.
const NAMES: [&str; 5] = [
    "libOpenImageDenoise.so.2",
    "libOpenImageDenoise.so",
    "libOpenImageDenoise.2.dylib",
    "libOpenImageDenoise.dylib",
    "OpenImageDenoise.dll",
];
/// `OIDN_DEVICE_TYPE_CPU` and `OIDN_FORMAT_FLOAT3`.
const CPU: c_int = 1;
const FLOAT3: c_int = 3;

type Handle = *mut c_void;
/// `oidnSetSharedFilterImage`: name, bytes, format, width, height, offset and strides.
type SetImage =
    unsafe extern "C" fn(Handle, *const c_char, *mut c_void, c_int, usize, usize, usize, usize, usize);

/// The library.
pub(super) struct Denoiser(Library);

impl Denoiser {
    /// The library, if it is installed.
    pub(super) fn load() -> Option<Self> {
        // SAFETY: Loading runs the initializers of the library, which is Open Image Denoise by its
        // name; these set up its own state only.
        NAMES.iter().find_map(|&name| unsafe { Library::new(name) }.ok()).map(Self)
    }

    /// Replaces the colours of a picture.
    ///
    /// # Errors
    /// What the library says, or what it lacks.
    pub(super) fn filter(&self, means: &mut [Shaded], (width, height): (u32, u32)) -> Result<(), String> {
        let (width, height) = (width as usize, height as usize);
        assert_eq!(means.len(), width * height);
        let plane = |of: fn(&Shaded) -> Vec3| means.iter().map(of).collect::<Vec<Vec3>>();
        let mut colors = plane(|mean| mean.color);
        let (mut albedos, mut normals) = (plane(|mean| mean.albedo), plane(|mean| mean.normal));
        let mut output = vec![Vec3::ZERO; means.len()];
        let missing = |e: libloading::Error| e.to_string();
        // SAFETY: The signatures are as in `oidn.h`, the same in all versions from 1.4 on.
        // Handles are passed on as the library returns them, and released once, the filter first.
        // The four images are rows of `width * height` of three f32 (`Vec3` is `repr(C)` of three),
        // so that all bytes that a width, a height and strides of 0 (packed) describe lie within
        // the vectors; these live, unmoved and otherwise unused, until the filter is released.
        // Names end with a zero byte. The message of an error is a string that lives until the next
        // call.
        unsafe {
            let new_device: Symbol<'_, unsafe extern "C" fn(c_int) -> Handle> =
                self.0.get(b"oidnNewDevice\0").map_err(missing)?;
            let commit_device: Symbol<'_, unsafe extern "C" fn(Handle)> =
                self.0.get(b"oidnCommitDevice\0").map_err(missing)?;
            let device_error: Symbol<'_, unsafe extern "C" fn(Handle, *mut *const c_char) -> c_int> =
                self.0.get(b"oidnGetDeviceError\0").map_err(missing)?;
            let new_filter: Symbol<'_, unsafe extern "C" fn(Handle, *const c_char) -> Handle> =
                self.0.get(b"oidnNewFilter\0").map_err(missing)?;
            let set_image: Symbol<'_, SetImage> =
                self.0.get(b"oidnSetSharedFilterImage\0").map_err(missing)?;
            let set_flag: Symbol<'_, unsafe extern "C" fn(Handle, *const c_char, bool)> = self
                .0
                .get(b"oidnSetFilterBool\0")
                .or_else(|_| self.0.get(b"oidnSetFilter1b\0"))
                .map_err(missing)?;
            let commit: Symbol<'_, unsafe extern "C" fn(Handle)> =
                self.0.get(b"oidnCommitFilter\0").map_err(missing)?;
            let execute: Symbol<'_, unsafe extern "C" fn(Handle)> =
                self.0.get(b"oidnExecuteFilter\0").map_err(missing)?;
            let release_filter: Symbol<'_, unsafe extern "C" fn(Handle)> =
                self.0.get(b"oidnReleaseFilter\0").map_err(missing)?;
            let release_device: Symbol<'_, unsafe extern "C" fn(Handle)> =
                self.0.get(b"oidnReleaseDevice\0").map_err(missing)?;
            let device = new_device(CPU);
            if device.is_null() {
                return Err("it has no device".to_owned());
            }
            commit_device(device);
            let filter = new_filter(device, c"RT".as_ptr());
            if !filter.is_null() {
                let images: [(&CStr, &mut Vec<Vec3>); 4] = [
                    (c"color", &mut colors),
                    (c"albedo", &mut albedos),
                    (c"normal", &mut normals),
                    (c"output", &mut output),
                ];
                for (name, image) in images {
                    let bytes = image.as_mut_ptr().cast::<c_void>();
                    set_image(filter, name.as_ptr(), bytes, FLOAT3, width, height, 0, 0, 0);
                }
                set_flag(filter, c"hdr".as_ptr(), true);
                commit(filter);
                execute(filter);
                release_filter(filter);
            }
            let mut message: *const c_char = std::ptr::null();
            let error = device_error(device, &raw mut message);
            let text = match message.is_null() {
                true => format!("error {error}"),
                false => CStr::from_ptr(message).to_string_lossy().into_owned(),
            };
            release_device(device);
            if error != 0 || filter.is_null() {
                return Err(text);
            }
        }
        means.iter_mut().zip(output).for_each(|(mean, color)| mean.color = color);
        Ok(())
    }
}
