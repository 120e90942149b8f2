//! A file that is ready to be written, in pieces that need not be in one place, nor in memory.

use super::whole::{are_zeros, name};
use bth_files::{Digest, OpenFile};
use std::borrow::Cow;
use std::io::{Error, Result, Write};
use std::ops::Range;
use std::sync::Arc;

/// Where the bytes of a section are.
#[derive(Clone, Debug)]
pub(crate) enum Bytes<'a> {
    /// Here.
    Here(Cow<'a, [u8]>),
    /// In a file that was read.
    In(Arc<bth_format::File>, Range<usize>),
    /// In a file that was opened.
    Old(Arc<OpenFile>, Range<u64>),
}

impl Bytes<'_> {
    /// How many there are.
    pub(super) fn length(&self) -> u64 {
        match self {
            Self::Here(bytes) => bytes.len() as u64,
            Self::In(_, range) => range.len() as u64,
            Self::Old(_, range) => range.end - range.start,
        }
    }

    /// They themselves, unless they are still in a file.
    pub(super) fn in_memory(&self) -> Option<&[u8]> {
        match self {
            Self::Here(bytes) => Some(bytes),
            Self::In(file, range) => file.bytes().get(range.clone()),
            Self::Old(..) => None,
        }
    }
}

/// A file that is ready to be written.
#[derive(Clone, Debug)]
pub struct Content {
    pieces: Vec<Bytes<'static>>,
    length: u64,
    /// Bytes of the length that are no piece yet: zeros.
    pad: usize,
}

impl From<Vec<u8>> for Content {
    fn from(bytes: Vec<u8>) -> Self {
        Self::new(bytes)
    }
}

impl Content {
    /// From the first bytes.
    pub(super) fn new(bytes: Vec<u8>) -> Self {
        Self { length: bytes.len() as u64, pieces: vec![Bytes::Here(bytes.into())], pad: 0 }
    }

    /// Goes on with zeros up to a place that is not before its end.
    pub(super) fn pad_to(&mut self, end: u64) {
        self.pad += (end - self.length) as usize;
        self.length = end;
        // Files that were read often end alike.
        if let Some(Bytes::In(file, range)) = self.pieces.last_mut()
            && file.bytes().get(range.end..range.end + self.pad).is_some_and(are_zeros)
        {
            range.end += std::mem::take(&mut self.pad);
        }
    }

    /// Goes on with the bytes of a section. What follows each other in the same file becomes one piece.
    pub(super) fn push(&mut self, bytes: Bytes<'_>) {
        self.length += bytes.length();
        let pad = self.pad;
        match (self.pieces.last_mut(), bytes) {
            (Some(Bytes::In(file, old)), Bytes::In(other, new))
                if Arc::ptr_eq(file, &other) && pad == 0 && old.end == new.start =>
            {
                old.end = new.end;
            }
            // Between the sections of an old file that is used there are zeros.
            (Some(Bytes::Old(file, old)), Bytes::Old(other, new))
                if Arc::ptr_eq(file, &other) && old.end + pad as u64 == new.start =>
            {
                old.end = new.end;
                self.pad = 0;
            }
            (_, bytes) => {
                self.fill();
                match bytes {
                    Bytes::Here(bytes) => self.append(&bytes),
                    Bytes::In(file, range) => self.pieces.push(Bytes::In(file, range)),
                    Bytes::Old(file, range) => self.pieces.push(Bytes::Old(file, range)),
                }
            }
        }
    }

    /// Makes a piece of the zeros.
    fn fill(&mut self) {
        let pad = std::mem::take(&mut self.pad);
        if pad > 0 {
            self.append(&[0; bth_format::layout::ALIGNMENT][..pad]);
        }
    }

    fn append(&mut self, bytes: &[u8]) {
        match self.pieces.last_mut() {
            Some(Bytes::Here(last)) => last.to_mut().extend_from_slice(bytes),
            _ => self.pieces.push(Bytes::Here(bytes.to_vec().into())),
        }
    }

    /// Its bytes.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// What names it: the hash of its header, which has that of the section table, which has those of the sections.
    pub fn name(&self) -> Digest {
        let head = self.pieces.first().and_then(Bytes::in_memory).unwrap_or_default();
        name(head)
    }

    /// Writes it.
    ///
    /// # Errors
    /// Those of the writer, and when an old file that it takes sections from cannot be read or has changed.
    pub fn write_to(&self, out: &mut (impl Write + ?Sized)) -> Result<()> {
        let mut at = 0;
        let mut used: Option<&Arc<OpenFile>> = None;
        for piece in &self.pieces {
            match piece {
                Bytes::Old(file, range) => {
                    file.copy_to(range.clone(), out, at)?;
                    used = Some(file);
                }
                piece => out.write_all(piece.in_memory().unwrap_or_default())?,
            }
            at += piece.length();
        }
        out.write_all(&[0; bth_format::layout::ALIGNMENT][..self.pad])?;
        match used {
            Some(file) if !file.is_unchanged() => {
                Err(Error::other("the file that was there was changed meanwhile; compile again"))
            }
            _ => Ok(()),
        }
    }

    /// All bytes in one place.
    ///
    /// # Errors
    /// As [`Self::write_to`].
    pub fn bytes(&self) -> Result<Cow<'_, [u8]>> {
        if let ([Bytes::Here(bytes)], 0) = (&self.pieces[..], self.pad) {
            return Ok(Cow::Borrowed(bytes));
        }
        let mut bytes = Vec::with_capacity(self.length as usize);
        self.write_to(&mut bytes)?;
        Ok(bytes.into())
    }
}
