//! Files that are put together in the memory in which they are read.

use super::builder::FileBuilder;
use crate::error::{Error, Result};
use bth_format::{File, FileMemory};
use rayon::prelude::*;

/// The file of a builder, after the checks of a reader ([`super::checked`]).
///
/// # Errors
/// The errors of [`assembled`]; `BTH-X030` when the bytes violate the format, which is a defect of
/// the compiler.
pub(crate) fn open(builder: &FileBuilder<'_>) -> Result<File> {
    super::checked(assembled(builder)?)
}

/// The file of a builder. Its header and table have been checked. Sections in memory are copied on
/// several threads.
///
/// # Errors
/// `BTH-L034` when there is not enough memory; for sections on disk `BTH-O001` when they cannot be
/// read and `BTH-O002` when they have changed.
pub(crate) fn assembled(builder: &FileBuilder<'_>) -> Result<File> {
    let length = builder.file_length();
    let mut memory = FileMemory::zeroed(length as usize).map_err(|_| Error::Limit {
        code: "BTH-L034",
        message: format!("not enough memory for a file of {length} bytes"),
    })?;
    let copies = builder.copies(memory.bytes_mut()).map_err(|e| super::read_failed(&e))?;
    copies.into_par_iter().for_each(|(to, from)| to.copy_from_slice(from));
    File::from_memory(memory).map_err(super::defect)
}
