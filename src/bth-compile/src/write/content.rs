//! A file that is ready to be written.

use super::FileBuilder;
use super::whole::name;
use bth_files::Digest;
use std::borrow::Cow;
use std::io::{Result, Write};

/// A file that is ready to be written.
#[derive(Clone, Debug)]
pub struct Content(Parts);

#[derive(Clone, Debug)]
enum Parts {
    Bytes(Vec<u8>),
    File(bth_format::File),
    Sections { builder: FileBuilder<'static>, length: u64 },
}

impl From<Vec<u8>> for Content {
    fn from(bytes: Vec<u8>) -> Self {
        Self(Parts::Bytes(bytes))
    }
}

impl From<bth_format::File> for Content {
    fn from(file: bth_format::File) -> Self {
        Self(Parts::File(file))
    }
}

impl From<FileBuilder<'static>> for Content {
    fn from(builder: FileBuilder<'static>) -> Self {
        let length = builder.file_length();
        Self(Parts::Sections { builder, length })
    }
}

impl Content {
    /// The file in memory that the content is, if it is one.
    pub(crate) fn file(&self) -> Option<&bth_format::File> {
        match &self.0 {
            Parts::File(file) => Some(file),
            _ => None,
        }
    }

    /// Length in bytes.
    pub fn length(&self) -> u64 {
        match &self.0 {
            Parts::Bytes(bytes) => bytes.len() as u64,
            Parts::File(file) => file.bytes().len() as u64,
            Parts::Sections { length, .. } => *length,
        }
    }

    /// The name of the content: the hash of the header. The header contains the hash of the section
    /// table, which contains the hashes of the sections.
    pub fn name(&self) -> Digest {
        match &self.0 {
            Parts::Bytes(bytes) => name(bytes),
            Parts::File(file) => name(file.bytes()),
            Parts::Sections { builder, .. } => builder.name(),
        }
    }

    /// Writes the content. What is on disk is copied from there.
    ///
    /// # Errors
    /// Errors of the writer, and of files that cannot be read again or have changed.
    pub fn write_to(&self, out: &mut (impl Write + ?Sized)) -> Result<()> {
        match &self.0 {
            Parts::Bytes(bytes) => out.write_all(bytes),
            Parts::File(file) => out.write_all(file.bytes()),
            Parts::Sections { builder, .. } => builder.borrowed().write_to(&mut |bytes| out.write_all(bytes)),
        }
    }

    /// Writes the content for the last time, and removes parts of temporary files behind it.
    ///
    /// # Errors
    /// The errors of [`Self::write_to`].
    pub(crate) fn write_last(self, out: &mut (impl Write + ?Sized)) -> Result<()> {
        match self.0 {
            Parts::Sections { builder, .. } => builder.write_to(&mut |bytes| out.write_all(bytes)),
            _ => self.write_to(out),
        }
    }

    /// All bytes in one piece.
    ///
    /// # Errors
    /// `BTH-O001` for files that cannot be read again, `BTH-O002` for those that have changed.
    pub fn bytes(&self) -> crate::error::Result<Cow<'_, [u8]>> {
        Ok(match &self.0 {
            Parts::Bytes(bytes) => bytes.into(),
            Parts::File(file) => file.bytes().into(),
            Parts::Sections { length, .. } => {
                let mut bytes = Vec::with_capacity(*length as usize);
                self.write_to(&mut bytes).map_err(|e| super::read_failed(&e))?;
                bytes.into()
            }
        })
    }
}
