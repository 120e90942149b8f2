//! Devices and buffers.
#![allow(unsafe_code)] // Functions take pointers of the program.

use super::exports;
use crate::abi::*;
use crate::buffer::Buffer;
use crate::device::{Callback, Device, NO_DEVICE, report_without_device};
use crate::error::Failure;
use crate::handles::{Shared, give, is_ours, release, retain};
use std::ffi::{CStr, c_char, c_void};
use std::panic::catch_unwind;
use std::sync::Arc;

/// Makes a device.
///
/// # Safety
/// The text is null or ends with 0.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub unsafe extern "C" fn rtcNewDevice(text: *const c_char) -> Handle {
    // SAFETY: by contract it is null, and then replaced, or ends with 0.
    let text = if text.is_null() { c"" } else { unsafe { CStr::from_ptr(text) } };
    let text = text.to_string_lossy().into_owned();
    match catch_unwind(|| Device::new(&text)).unwrap_or_else(|_| super::defect()) {
        Ok(device) => {
            let device = Shared::new(device);
            listen(&device);
            give(device)
        }
        Err(failure) => {
            report_without_device(&failure);
            std::ptr::null_mut()
        }
    }
}

/// Passes errors of the other library on to the device.
fn listen(device: &Arc<Shared<Device>>) {
    unsafe extern "C" fn relay(device: *mut c_void, code: u32, text: *const c_char) {
        // SAFETY: the other library has the address of the device, which outlives it, and gives a
        // text or null.
        let (device, text) = unsafe {
            let text = if text.is_null() { c"" } else { CStr::from_ptr(text) };
            (&*device.cast::<Shared<Device>>(), text)
        };
        let code = match code {
            2 => ErrorCode::InvalidArgument,
            3 => ErrorCode::InvalidOperation,
            4 => ErrorCode::OutOfMemory,
            6 => ErrorCode::Cancelled,
            _ => ErrorCode::Unknown,
        };
        device.report(&Failure { code, message: text.to_string_lossy().into_owned() });
    }
    if let Some(fallback) = &device.fallback {
        let address = Arc::as_ptr(device).cast_mut().cast();
        // SAFETY: the device of the other library lives as long as ours.
        unsafe { (fallback.functions.rtcSetDeviceErrorFunction)(fallback.device, Some(relay), address) };
    }
}

/// Adds a reference to a device.
///
/// # Safety
/// The handle is null or lives.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub unsafe extern "C" fn rtcRetainDevice(device: Handle) {
    // SAFETY: the contract is the same.
    unsafe { retain::<Device>(device) }.unwrap_or_else(|failure| report_without_device(&failure));
}

/// Removes a reference to a device.
///
/// # Safety
/// The handle is null or lives, and the program owns a reference.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub unsafe extern "C" fn rtcReleaseDevice(device: Handle) {
    // SAFETY: the contract is the same.
    unsafe { release::<Device>(device) }.unwrap_or_else(|failure| report_without_device(&failure));
}

/// The first error of this thread since it last asked; of calls without a device for null.
///
/// # Safety
/// The handle is null or lives.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub unsafe extern "C" fn rtcGetDeviceError(device: Handle) -> u32 {
    // SAFETY: by contract it is null or lives.
    let errors = match unsafe { is_ours::<Device>(device) } {
        // SAFETY: it is one of ours.
        true => unsafe { crate::handles::object::<Device>(device) }.errors(),
        false => &NO_DEVICE,
    };
    errors.take()
}

/// The text of the last error of this thread.
///
/// # Safety
/// The handle is null or lives.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub unsafe extern "C" fn rtcGetDeviceLastErrorMessage(device: Handle) -> *const c_char {
    // SAFETY: by contract it is null or lives.
    let errors = match unsafe { is_ours::<Device>(device) } {
        // SAFETY: it is one of ours.
        true => unsafe { crate::handles::object::<Device>(device) }.errors(),
        false => &NO_DEVICE,
    };
    errors.message()
}

/// The name of an error.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub extern "C" fn rtcGetErrorString(error: u32) -> *const c_char {
    let name = match error {
        0 => c"RTC_ERROR_NONE",
        1 => c"RTC_ERROR_UNKNOWN",
        2 => c"RTC_ERROR_INVALID_ARGUMENT",
        3 => c"RTC_ERROR_INVALID_OPERATION",
        4 => c"RTC_ERROR_OUT_OF_MEMORY",
        5 => c"RTC_ERROR_UNSUPPORTED_CPU",
        6 => c"RTC_ERROR_CANCELLED",
        7 => c"RTC_ERROR_LEVEL_ZERO_RAYTRACING_SUPPORT_MISSING",
        _ => c"Invalid error code",
    };
    name.as_ptr()
}

exports! {
    /// A property of a device.
    fn rtcGetDeviceProperty(device: Device, property: u32) -> isize { Ok(device.property(property)) }

    /// Properties cannot be set.
    fn rtcSetDeviceProperty(device: Device, _property: u32, _value: isize) {
        let _ = device;
        crate::error::argument("properties of a device cannot be set")
    }

    /// Sets the function that hears of errors.
    fn rtcSetDeviceErrorFunction(device: Device, function: Option<ErrorFunction>, user: *mut c_void) {
        device.set_error_function(function.map(|function| Callback { function, user }));
        Ok(())
    }

    /// Sets the function that hears of memory.
    fn rtcSetDeviceMemoryMonitorFunction(device: Device, function: Option<MemoryFunction>, user: *mut c_void) {
        device.set_memory_function(function.map(|function| Callback { function, user }));
        Ok(())
    }

    /// Makes a buffer.
    fn rtcNewBuffer(device: Device, bytes: usize) -> Handle {
        Ok(give(Shared::new(Buffer::new(device, bytes)?)))
    }

    /// Makes a buffer: devices here have the memory of the host.
    fn rtcNewBufferHostDevice(device: Device, bytes: usize) -> Handle {
        Ok(give(Shared::new(Buffer::new(device, bytes)?)))
    }

    /// Makes a buffer of the program's memory.
    fn rtcNewSharedBuffer(device: Device, data: *mut c_void, bytes: usize) -> Handle {
        Ok(give(Shared::new(Buffer::shared(device, data, bytes))))
    }

    /// Makes a buffer of the program's memory.
    fn rtcNewSharedBufferHostDevice(device: Device, data: *mut c_void, bytes: usize) -> Handle {
        Ok(give(Shared::new(Buffer::shared(device, data, bytes))))
    }

    /// Nothing is to be copied to a device.
    fn rtcCommitBuffer(buffer: Buffer) {
        let _ = buffer;
        Ok(())
    }

    /// The memory of a buffer.
    fn rtcGetBufferData(buffer: Buffer) -> *mut c_void { Ok(buffer.data()) }

    /// The memory of a buffer.
    fn rtcGetBufferDataDevice(buffer: Buffer) -> *mut c_void { Ok(buffer.data()) }
}

/// Adds a reference to a buffer.
///
/// # Safety
/// The handle is null or lives.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub unsafe extern "C" fn rtcRetainBuffer(buffer: Handle) {
    // SAFETY: the contract is the same.
    unsafe { retain::<Buffer>(buffer) }.unwrap_or_else(|failure| report_without_device(&failure));
}

/// Removes a reference to a buffer.
///
/// # Safety
/// The handle is null or lives, and the program owns a reference.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub unsafe extern "C" fn rtcReleaseBuffer(buffer: Handle) {
    // SAFETY: the contract is the same.
    unsafe { release::<Buffer>(buffer) }.unwrap_or_else(|failure| report_without_device(&failure));
}

/// There are no devices of SYCL here.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub extern "C" fn rtcIsSYCLDeviceSupported(_device: *const c_void) -> bool {
    false
}

/// There are no devices of SYCL here.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub extern "C" fn rtcSYCLDeviceSelector(_device: *const c_void) -> i32 {
    -1
}

/// There are no devices of SYCL here.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub extern "C" fn rtcSetDeviceSYCLDevice(_device: Handle, _sycl: *const c_void) {
    let _: Result<(), ()> =
        crate::error::unsupported::<()>("SYCL").map_err(|failure| report_without_device(&failure));
}

/// There are no devices of SYCL here.
#[unsafe(no_mangle)]
#[allow(non_snake_case)]
pub extern "C" fn rtcNewSYCLDeviceInternal(_context: *const c_void, _text: *const c_char) -> Handle {
    let _: Result<(), ()> =
        crate::error::unsupported::<()>("SYCL").map_err(|failure| report_without_device(&failure));
    std::ptr::null_mut()
}
