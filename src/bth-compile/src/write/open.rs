//! Files that are put together in the memory in which they are read.

use super::builder::FileBuilder;
use crate::error::{Error, Result};
use bth_format::{File, FileMemory};
use rayon::prelude::*;

/// The file of a builder, after the checks of a reader ([`super::checked`]). Sections are copied on
/// several threads.
///
/// # Errors
/// `BTH-L034` when there is not enough memory; `BTH-X030` when the bytes violate the format, which
/// is a defect of the compiler.
pub(crate) fn open(builder: &FileBuilder<'_>) -> Result<File> {
    let length = builder.file_length();
    let mut memory = FileMemory::zeroed(length as usize).map_err(|_| Error::Limit {
        code: "BTH-L034",
        message: format!("not enough memory for a file of {length} bytes"),
    })?;
    builder.copies(memory.bytes_mut()).into_par_iter().for_each(|(to, from)| to.copy_from_slice(from));
    super::checked(File::from_memory(memory).map_err(super::defect)?)
}
