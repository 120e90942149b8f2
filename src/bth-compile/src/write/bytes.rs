//! The bytes of a section: in memory, or in a file from which they are read when they are needed.

use super::DiskFile;
use std::borrow::Cow;
use std::io::Result;
use std::ops::Range;
use std::sync::Arc;

/// Where the bytes of a section are.
#[derive(Clone, Debug)]
pub(crate) enum Bytes<'a> {
    /// Owned or borrowed.
    Owned(Cow<'a, [u8]>),
    /// In a file in memory.
    InFile(Arc<bth_format::File>, Range<usize>),
    /// In a file on disk.
    OnDisk(Arc<DiskFile>, Range<u64>),
}

impl Bytes<'_> {
    pub(crate) fn len(&self) -> u64 {
        match self {
            Self::Owned(bytes) => bytes.len() as u64,
            Self::InFile(_, range) => range.len() as u64,
            Self::OnDisk(_, range) => range.end - range.start,
        }
    }

    /// The bytes, if they are in memory.
    pub(crate) fn in_memory(&self) -> Option<&[u8]> {
        match self {
            Self::Owned(bytes) => Some(bytes),
            Self::InFile(file, range) => Some(&file.bytes()[range.clone()]),
            Self::OnDisk(..) => None,
        }
    }

    /// Passes the bytes on, in pieces. Bytes on disk must have this hash.
    ///
    /// # Errors
    /// [`super::Unread`] when they cannot be read or have another hash, and errors of `take`.
    pub(crate) fn read(&self, hash: [u8; 16], take: &mut dyn FnMut(&[u8]) -> Result<()>) -> Result<()> {
        match self {
            Self::OnDisk(file, range) => file.read(range.clone(), hash, take),
            _ => take(self.in_memory().unwrap_or_default()),
        }
    }

    /// The same, borrowed.
    pub(super) fn borrowed(&self) -> Bytes<'_> {
        match self {
            Self::Owned(bytes) => Bytes::Owned(Cow::Borrowed(bytes)),
            Self::InFile(file, range) => Bytes::InFile(file.clone(), range.clone()),
            Self::OnDisk(file, range) => Bytes::OnDisk(file.clone(), range.clone()),
        }
    }

    /// The same without a borrow.
    pub(super) fn into_static(self) -> Bytes<'static> {
        match self {
            Self::Owned(bytes) => Bytes::Owned(Cow::Owned(bytes.into_owned())),
            Self::InFile(file, range) => Bytes::InFile(file, range),
            Self::OnDisk(file, range) => Bytes::OnDisk(file, range),
        }
    }
}
