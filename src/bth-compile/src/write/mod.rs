//! Encodes sections into the bytes of a file, and writes the bytes to a file atomically.

mod atomic;
mod builder;
mod bytes;
mod content;
mod disk;
mod groups;
mod images;
mod names;
mod object;
mod open;
mod scene;
mod whole;

pub(crate) use atomic::unread;
pub use atomic::{write_atomically, write_content};
pub use builder::FileBuilder;
pub(crate) use builder::SectionHead;
pub(crate) use bytes::Bytes;
pub use content::Content;
pub(crate) use disk::{DiskFile, Unread};
pub use groups::{GroupParts, object_names};
pub use images::images;
pub(crate) use images::named_images;
pub(crate) use names::Names;
pub use object::{ObjectParts, Source, object};
pub(crate) use open::{assembled, open};
pub use scene::{DeformerParts, SceneParts, scene};
pub use whole::name_if_whole;

use crate::error::{Error, Result};

/// A newly encoded file, after the checks of a reader: every index.
///
/// # Errors
/// `BTH-X030` when the bytes violate the format, which is a defect of the compiler.
pub fn checked(file: bth_format::File) -> Result<bth_format::File> {
    (0..file.object_count()).try_for_each(|i| file.check(i).map(drop).map_err(defect))?;
    file.check_object_names().map_err(defect)?;
    file.check_scene().map_err(defect)?;
    Ok(file)
}

pub(crate) fn defect(error: bth::Error) -> Error {
    Error::Internal { code: "BTH-X030", message: format!("the written file fails: {error}") }
}

/// The error of reading sections: of files on disk, or of memory, where none is expected.
pub(crate) fn read_failed(error: &std::io::Error) -> Error {
    unread(error).unwrap_or_else(|| Error::Internal { code: "BTH-X030", message: error.to_string() })
}
