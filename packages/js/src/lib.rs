//! The WebAssembly module of the npm package. Its only caller is `index.js`, which documents the
//! queries.
//!
//! Functions take and return numbers: addresses in the module's memory, counts, and 0 or null for
//! an error, whose text [`bth_error`] holds. Results of several rays are columns, one after the
//! other, of one number a ray, since that is what typed arrays are cut from.
#![allow(unsafe_code)] // All functions are called from outside, and most take addresses.

pub mod describe;
pub mod materials;
pub mod memory;
pub mod motion;
pub mod nodes;
pub mod one;
pub mod points;
pub mod queries;
pub mod surface;

use std::cell::RefCell;

thread_local! {
    /// The text of the last error.
    static LAST_ERROR: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Keeps the text of an error.
fn fail(text: String) {
    LAST_ERROR.with(|last| *last.borrow_mut() = text);
}

/// Address of the text of the last error, UTF-8. It stays valid until the next error.
#[unsafe(no_mangle)]
pub extern "C" fn bth_error() -> *const u8 {
    LAST_ERROR.with(|last| last.borrow().as_ptr())
}

/// Bytes of the text of the last error.
#[unsafe(no_mangle)]
pub extern "C" fn bth_error_length() -> usize {
    LAST_ERROR.with(|last| last.borrow().len())
}

/// Says if the module was compiled with vector instructions.
#[unsafe(no_mangle)]
pub extern "C" fn bth_has_vectors() -> u32 {
    (bth::Isa::chosen() != bth::Isa::Scalar).into()
}
