//! A file that is ready to be written, in pieces.

use super::whole::{are_zeros, name};
use bth_files::Digest;
use std::borrow::Cow;
use std::io::{Result, Write};
use std::ops::{Deref, Range};
use std::sync::Arc;

/// Where the bytes of a section are.
#[derive(Clone, Debug)]
pub(crate) enum Bytes<'a> {
    /// Owned or borrowed.
    Owned(Cow<'a, [u8]>),
    /// In a file in memory.
    InFile(Arc<bth_format::File>, Range<usize>),
}

impl Deref for Bytes<'_> {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match self {
            Self::Owned(bytes) => bytes,
            Self::InFile(file, range) => &file.bytes()[range.clone()],
        }
    }
}

/// A file that is ready to be written.
#[derive(Clone, Debug)]
pub struct Content {
    pieces: Vec<Bytes<'static>>,
    length: u64,
    /// Zeros at the end that are counted in the length but are not in a piece yet.
    pad: usize,
}

impl From<Vec<u8>> for Content {
    fn from(bytes: Vec<u8>) -> Self {
        Self::new(bytes)
    }
}

impl From<bth_format::File> for Content {
    fn from(file: bth_format::File) -> Self {
        let length = file.bytes().len();
        Self { pieces: vec![Bytes::InFile(Arc::new(file), 0..length)], length: length as u64, pad: 0 }
    }
}

impl Content {
    /// A content that starts with these bytes.
    pub(super) fn new(bytes: Vec<u8>) -> Self {
        Self { length: bytes.len() as u64, pieces: vec![Bytes::Owned(bytes.into())], pad: 0 }
    }

    /// Appends zeros up to an offset that is not before the end.
    pub(super) fn pad_to(&mut self, end: u64) {
        self.pad += (end - self.length) as usize;
        self.length = end;
        // A source in memory often has the same zeros, so the range is extended instead of starting
        // a new piece.
        if let Some(Bytes::InFile(file, range)) = self.pieces.last_mut()
            && file.bytes().get(range.end..range.end + self.pad).is_some_and(are_zeros)
        {
            range.end += std::mem::take(&mut self.pad);
        }
    }

    /// Appends the bytes of a section. Adjacent ranges of the same file become one piece.
    pub(super) fn push(&mut self, bytes: Bytes<'_>) {
        self.length += bytes.len() as u64;
        match (self.pieces.last_mut(), bytes) {
            (Some(Bytes::InFile(file, old)), Bytes::InFile(other, new))
                if Arc::ptr_eq(file, &other) && self.pad == 0 && old.end == new.start =>
            {
                old.end = new.end;
            }
            (_, bytes) => {
                self.fill();
                match bytes {
                    Bytes::Owned(bytes) => self.append(&bytes),
                    Bytes::InFile(file, range) => self.pieces.push(Bytes::InFile(file, range)),
                }
            }
        }
    }

    /// Turns the zeros at the end into a piece.
    fn fill(&mut self) {
        let pad = std::mem::take(&mut self.pad);
        if pad > 0 {
            self.append(&[0; bth_format::layout::ALIGNMENT][..pad]);
        }
    }

    fn append(&mut self, bytes: &[u8]) {
        match self.pieces.last_mut() {
            Some(Bytes::Owned(last)) => last.to_mut().extend_from_slice(bytes),
            _ => self.pieces.push(Bytes::Owned(bytes.to_vec().into())),
        }
    }

    /// The file in memory that the content is, if it is one.
    pub(crate) fn file(&self) -> Option<&bth_format::File> {
        match &self.pieces[..] {
            [Bytes::InFile(file, range)] if range.len() == file.bytes().len() => Some(file),
            _ => None,
        }
    }

    /// Length in bytes.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// The name of the content: the hash of the header. The header contains the hash of the section
    /// table, which contains the hashes of the sections.
    pub fn name(&self) -> Digest {
        name(self.pieces.first().map_or(&[], |head| head))
    }

    /// Writes the content.
    ///
    /// # Errors
    /// Returns the error of the writer.
    pub fn write_to(&self, out: &mut (impl Write + ?Sized)) -> Result<()> {
        self.pieces.iter().try_for_each(|piece| out.write_all(piece))?;
        out.write_all(&[0; bth_format::layout::ALIGNMENT][..self.pad])
    }

    /// All bytes in one piece.
    pub fn bytes(&self) -> Cow<'_, [u8]> {
        if let ([piece], 0) = (&self.pieces[..], self.pad) {
            return Cow::Borrowed(piece);
        }
        let mut bytes = Vec::with_capacity(self.length as usize);
        self.pieces.iter().for_each(|piece| bytes.extend_from_slice(piece));
        bytes.resize(self.length as usize, 0);
        bytes.into()
    }
}
