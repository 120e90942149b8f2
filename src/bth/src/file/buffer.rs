//! Memory that holds a file, aligned for every structure in it.

use crate::error::{Code, Error, Result};
use crate::layout::Line;
use memmap2::Mmap;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;
use zerocopy::IntoBytes;

/// Bytes of a file at a multiple of 64.
#[derive(Debug)]
pub(super) enum Buffer {
    /// Memory of our own; the length is in bytes.
    Owned(Vec<Line>, usize),
    /// A mapping, which starts at a page.
    Mapped(Mmap),
}

impl Buffer {
    pub(super) fn bytes(&self) -> &[u8] {
        match self {
            Buffer::Owned(lines, length) => &lines.as_bytes()[..*length],
            Buffer::Mapped(map) => map,
        }
    }

    /// As many zero bytes; fails instead of aborting when there is not so much memory.
    fn zeroed(length: usize) -> Option<Vec<Line>> {
        let count = length.div_ceil(size_of::<Line>());
        let mut lines = Vec::new();
        lines.try_reserve_exact(count).ok()?;
        lines.resize(count, Line([0; 16]));
        Some(lines)
    }

    pub(super) fn copy(bytes: &[u8]) -> Result<Self> {
        let mut lines = Self::zeroed(bytes.len()).ok_or_else(|| no_memory(bytes.len() as u64))?;
        lines.as_mut_bytes()[..bytes.len()].copy_from_slice(bytes);
        Ok(Buffer::Owned(lines, bytes.len()))
    }

    /// Reads a whole file. Its header is checked first, so that what is no BTH file is not read.
    pub(super) fn read(path: &Path) -> Result<Self> {
        let io = |e| Error::io(path, e);
        let (mut file, length) = open(path)?;
        let mut first = [0; super::table::HEADER];
        let head = first.len().min(usize::try_from(length).unwrap_or(usize::MAX));
        file.read_exact(&mut first[..head]).map_err(io)?;
        super::table::check_header(&first[..head], length)?;
        file.seek(SeekFrom::Start(0)).map_err(io)?;

        let size = usize::try_from(length).map_err(|_| no_memory(length))?;
        let mut lines = Self::zeroed(size).ok_or_else(|| no_memory(length))?;
        file.read_exact(&mut lines.as_mut_bytes()[..size]).map_err(io)?;
        Ok(Buffer::Owned(lines, size))
    }

    /// Maps a whole file.
    ///
    /// # Safety
    /// Until the buffer is dropped nobody, in this process or another, may write to the file,
    /// truncate it or punch holes into it.
    #[allow(unsafe_code)]
    pub(super) unsafe fn map(path: &Path) -> Result<Self> {
        let (file, length) = open(path)?;
        if length == 0 {
            return Self::copy(&[]);
        }
        // SAFETY: the bytes of a `Mmap` must not change while references to them live. The map is
        // private to this buffer and read-only, and the caller promises that nobody changes or
        // shrinks the file before the buffer is dropped.
        let map = unsafe { Mmap::map(&file) }.map_err(|e| Error::io(path, e))?;
        Ok(Buffer::Mapped(map))
    }
}

/// Opens a regular file; pipes and devices, which may have no end, are refused before they are opened.
fn open(path: &Path) -> Result<(std::fs::File, u64)> {
    let io = |e| Error::io(path, e);
    if !std::fs::metadata(path).map_err(io)?.is_file() {
        return Err(io(std::io::Error::new(std::io::ErrorKind::InvalidInput, "not a regular file")));
    }
    let file = std::fs::File::open(path).map_err(io)?;
    let length = file.metadata().map_err(io)?.len();
    Ok((file, length))
}

fn no_memory(length: u64) -> Error {
    Error::at(Code::Read, 0, format!("{length} bytes of memory"), "less")
}
