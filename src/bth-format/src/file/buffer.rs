//! Memory that holds the bytes of a file, aligned for every structure in it.

use crate::error::{Error, Result};
use crate::layout::{CacheLine, Header};
use crate::memory;
use memmap2::{Mmap, MmapMut};
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;
use zerocopy::IntoBytes;

/// The bytes of a file, from an address that is a multiple of 64.
#[derive(Debug)]
pub(super) enum Buffer {
    /// A copy in memory that this process allocated.
    Owned(Owned),
    /// A mapping of the file, which starts at a page; true if the file did not fit in memory.
    Mapped(Mmap, bool),
}

/// Allocated memory, writable until the file has been read into it.
#[derive(Debug)]
pub(super) struct Owned {
    memory: Memory,
    /// Bytes in use.
    length: usize,
}

#[derive(Debug)]
enum Memory {
    Lines(Vec<CacheLine>),
    /// Anonymous pages, which are large ones where the system has them, and the index of the first
    /// byte in use.
    #[cfg_attr(
        not(target_os = "linux"),
        expect(dead_code, reason = "large pages are requested on Linux only")
    )]
    Pages(MmapMut, usize),
}

/// Bytes of a large page. Files of fewer than two gain nothing by them.
const LARGE_PAGE: usize = 2 << 20;

impl Owned {
    /// Zero bytes. `None` when there is not enough memory: the length comes from a file, so
    /// allocation must not abort.
    pub(super) fn zeroed(length: usize) -> Option<Self> {
        if length >= 2 * LARGE_PAGE
            && let Some(memory) = large_pages(length)
        {
            return Some(Owned { memory, length });
        }
        let count = length.div_ceil(size_of::<CacheLine>());
        let mut lines = Vec::new();
        lines.try_reserve_exact(count).ok()?;
        lines.resize(count, CacheLine([0; 16]));
        Some(Owned { memory: Memory::Lines(lines), length })
    }

    pub(super) fn bytes(&self) -> &[u8] {
        match &self.memory {
            Memory::Lines(lines) => &lines.as_bytes()[..self.length],
            Memory::Pages(pages, first) => &pages[*first..][..self.length],
        }
    }

    pub(super) fn bytes_mut(&mut self) -> &mut [u8] {
        match &mut self.memory {
            Memory::Lines(lines) => &mut lines.as_mut_bytes()[..self.length],
            Memory::Pages(pages, first) => &mut pages[*first..][..self.length],
        }
    }
}

/// Zero bytes from the start of a large page on; `None` if there are no large pages. Rays visit a
/// model in no order of addresses: with small pages most of their cache misses are TLB misses too.
fn large_pages(length: usize) -> Option<Memory> {
    #[cfg(target_os = "linux")]
    {
        let pages = MmapMut::map_anon(length.checked_add(LARGE_PAGE)?).ok()?;
        // The advice may be refused: then the pages are small, and all else is the same.
        let _ = pages.advise(memmap2::Advice::HugePage);
        let first = pages.as_ptr().addr().next_multiple_of(LARGE_PAGE) - pages.as_ptr().addr();
        Some(Memory::Pages(pages, first))
    }
    #[cfg(not(target_os = "linux"))]
    {
        let _ = length;
        None
    }
}

impl Buffer {
    /// All bytes of the file.
    pub(super) fn bytes(&self) -> &[u8] {
        match self {
            Buffer::Owned(owned) => owned.bytes(),
            Buffer::Mapped(map, _) => map,
        }
    }

    /// True if the file is mapped and did not fit in memory when it was.
    pub(super) fn is_paged(&self) -> bool {
        matches!(self, Buffer::Mapped(_, true))
    }

    /// Asks the system to read bytes from an address on, if they are of a file that is paged.
    pub(super) fn will_need(&self, address: usize, length: usize) {
        #[cfg(unix)]
        if let Buffer::Mapped(map, true) = self
            && let Some(first) = address.checked_sub(map.as_ptr().addr())
            && first + length <= map.len()
        {
            // The advice may be refused: then the bytes are read when they are needed.
            let _ = map.advise_range(memmap2::Advice::WillNeed, first, length);
        }
        #[cfg(not(unix))]
        let _ = (address, length);
    }

    /// Copies the bytes of a file.
    pub(super) fn copy(bytes: &[u8]) -> Result<Self> {
        let mut owned = Owned::zeroed(bytes.len()).ok_or_else(|| Error::memory(bytes.len() as u64))?;
        owned.bytes_mut().copy_from_slice(bytes);
        Ok(Buffer::Owned(owned))
    }

    /// Reads a whole file. The header is checked first, so that a file of another format is not
    /// read to its end.
    pub(super) fn read(path: &Path) -> Result<Self> {
        Self::read_first(path, |header| header.file_length).map(|(buffer, _)| buffer)
    }

    /// Reads the first bytes of a file, whose header says how many. Returns the length of the file,
    /// too.
    pub(super) fn read_first(path: &Path, bytes: impl FnOnce(&Header) -> u64) -> Result<(Self, u64)> {
        let io = |e| Error::io(path, e);
        let (mut file, length) = open(path)?;
        let mut first = [0; super::table::HEADER_SIZE];
        let head = first.len().min(usize::try_from(length).unwrap_or(usize::MAX));
        file.read_exact(&mut first[..head]).map_err(io)?;
        let bytes = bytes(super::table::check_header(&first[..head], length)?);
        file.seek(SeekFrom::Start(0)).map_err(io)?;

        let size = usize::try_from(bytes).map_err(|_| Error::memory(bytes))?;
        let mut owned = Owned::zeroed(size).ok_or_else(|| Error::memory(bytes))?;
        file.read_exact(owned.bytes_mut()).map_err(io)?;
        Ok((Buffer::Owned(owned), length))
    }

    /// Maps a whole file. Where it does not fit in memory, only the pages are read that are used:
    /// rays need pages here and there, and reading around them would push out what they need.
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
        // Asked before: under a limit on addresses the map itself counts as used.
        let is_paged = length >= ASKED && length > memory::available();
        // SAFETY: the bytes of a `Mmap` must neither change nor become inaccessible while
        // references to them live. The map is read-only and owned by this buffer, which lends
        // references for its own lifetime only, and the caller promises that nobody changes or
        // shrinks the file before the buffer is dropped.
        let map = unsafe { Mmap::map(&file) }.map_err(|e| Error::io(path, e))?;
        if is_paged {
            // The advice may be refused: then more is read, and all else is the same.
            #[cfg(unix)]
            let _ = map.advise(memmap2::Advice::Random);
        }
        Ok(Buffer::Mapped(map, is_paged))
    }
}

/// Bytes of a mapped file from which on it is asked how much memory there is. Opening a smaller one
/// would take longer for it, and the system reads most of it at once.
const ASKED: u64 = 32 << 20;

/// Opens a regular file and returns its length in bytes. Pipes and devices, which may block or have
/// no end, are refused before they are opened.
fn open(path: &Path) -> Result<(std::fs::File, u64)> {
    let io = |e| Error::io(path, e);
    let found = std::fs::metadata(path).map_err(io)?;
    if !found.is_file() {
        let what = if found.is_dir() { "a folder, not a file" } else { "not a regular file" };
        return Err(io(std::io::Error::new(std::io::ErrorKind::InvalidInput, what)));
    }
    let file = std::fs::File::open(path).map_err(io)?;
    let length = file.metadata().map_err(io)?.len();
    Ok((file, length))
}
