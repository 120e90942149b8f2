//! Memory that the caller writes to and reads from, and what is opened in it.

use crate::fail;
use bth::Scene;
use bth_format::{File, FileMemory};

/// Memory for a file of this many bytes; null if there is not enough.
#[unsafe(no_mangle)]
pub extern "C" fn bth_file_new(length: usize) -> *mut FileMemory {
    match FileMemory::zeroed(length) {
        Ok(memory) => Box::into_raw(Box::new(memory)),
        Err(error) => {
            fail(error.to_string());
            std::ptr::null_mut()
        }
    }
}

/// Address of the first byte of a file's memory.
///
/// # Safety
/// `file` comes from [`bth_file_new`] and has not been opened.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_file_bytes(file: *mut FileMemory) -> *mut u8 {
    // SAFETY: by contract the pointer comes from `Box::into_raw` and is still owned by the caller,
    // who uses it nowhere else.
    unsafe { &mut *file }.bytes_mut().as_mut_ptr()
}

/// Checks and opens the file whose bytes were written to the memory, which must not be used any
/// more; null if it cannot be opened.
///
/// # Safety
/// `file` comes from [`bth_file_new`] and has not been opened.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_open(file: *mut FileMemory) -> *mut Scene {
    // SAFETY: by contract the pointer comes from `Box::into_raw`, and the caller gives it up.
    let memory = unsafe { Box::from_raw(file) };
    match File::from_memory(*memory).and_then(bth::from_file) {
        Ok(scene) => Box::into_raw(Box::new(scene)),
        Err(error) => {
            fail(error.to_string());
            std::ptr::null_mut()
        }
    }
}

/// Closes a scene.
///
/// # Safety
/// `scene` comes from [`bth_open`] and is not used any more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_close(scene: *mut Scene) {
    // SAFETY: by contract the pointer comes from `Box::into_raw`, and the caller gives it up.
    drop(unsafe { Box::from_raw(scene) });
}

/// Words of memory for rays and results, zeros, at a multiple of 8 bytes. It is kept until the
/// module ends.
#[unsafe(no_mangle)]
pub extern "C" fn bth_words(count: usize) -> *mut u64 {
    Box::leak(vec![0u64; count.div_ceil(2)].into_boxed_slice()).as_mut_ptr()
}
