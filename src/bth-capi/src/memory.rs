//! The part of the C interface that opens files in memory.

use crate::{ERROR_ARGUMENT, ERROR_INTERNAL, OK, READ, code_of, fail};
use runtime::Scene;
use std::panic::catch_unwind;

/// Opens the contents of a file; see `bth.h`.
///
/// # Safety
/// `bytes` is null or points to `length` bytes, which nobody writes to during the call; `scene` is
/// null or valid for writes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_open_memory(
    bytes: *const u8,
    length: usize,
    flags: u32,
    scene: *mut *mut Scene,
) -> i32 {
    if scene.is_null() {
        return fail(ERROR_ARGUMENT, "bth_open_memory: scene must not be null".into());
    }
    // SAFETY: it is not null, so it is valid for writes by the contract of this function.
    unsafe { *scene = std::ptr::null_mut() };
    if bytes.is_null() || length > isize::MAX as usize {
        return fail(ERROR_ARGUMENT, "bth_open_memory: bytes must not be null, and fit into memory".into());
    }
    if flags != READ {
        return fail(ERROR_ARGUMENT, format!("bth_open_memory: unknown flags {flags:#x}"));
    }
    // SAFETY: it is not null, so by contract it points to `length` bytes, which do not change
    // during the call.
    let bytes = unsafe { std::slice::from_raw_parts(bytes, length) };
    match catch_unwind(|| runtime::from_bytes(bytes)) {
        Ok(Ok(opened)) => {
            // SAFETY: it is not null, so it is valid for writes by the contract of this function.
            unsafe { *scene = Box::into_raw(Box::new(opened)) };
            OK
        }
        Ok(Err(error)) => fail(code_of(&error), error.to_string()),
        Err(_) => fail(ERROR_INTERNAL, "bth_open_memory: internal error".into()),
    }
}
