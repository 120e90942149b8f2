//! Bytes that are in a file without a name, so that they need not stay in memory.
#![allow(unsafe_code)]

use crate::nameless;
use memmap2::Mmap;
use std::fs::File;
use std::io::Result;
use std::path::Path;

/// Maps what `write` writes to a file without a name in a folder. The file is gone when the map is
/// dropped.
///
/// # Errors
/// Errors of the system and of `write`.
pub fn mapped(folder: &Path, write: impl FnOnce(&mut File) -> Result<()>) -> Result<Mmap> {
    let mut file = nameless(folder)?;
    write(&mut file)?;
    // SAFETY: the bytes of a `Mmap` must neither change nor become inaccessible while references to
    // them live. The file has no name, or one that only this process knew and that is gone, and its
    // only handle is dropped here. So nobody can write to it, truncate it or punch holes into it.
    // Its bytes have been written, so the disk has room for them.
    unsafe { Mmap::map(&file) }
}
