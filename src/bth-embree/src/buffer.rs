//! Buffers: memory that a program fills or shares, and views of their items.
#![allow(unsafe_code)] // The memory is the program's.

use crate::device::Device;
use crate::error::{Failure, Result, argument};
use crate::handles::{Shared, Tagged};
use std::alloc::{Layout, alloc_zeroed, dealloc};
use std::ffi::c_void;
use std::sync::Arc;

/// Alignment of new buffers, and to which their size is rounded up.
const ALIGNMENT: usize = 64;

/// Memory of a buffer.
#[derive(Debug)]
pub(crate) struct Buffer {
    pub(crate) device: Arc<Shared<Device>>,
    data: *mut u8,
    pub(crate) bytes: usize,
    /// The layout of memory that the buffer owns; `None` if the program owns it.
    owned: Option<Layout>,
}

// SAFETY: a buffer is an address and a size. The program must not write to the memory while a
// commit or a query reads it; nothing here writes to it.
unsafe impl Send for Buffer {}
// SAFETY: as above.
unsafe impl Sync for Buffer {}

impl Tagged for Buffer {
    const TAG: u64 = 0x6274_6862_7566_6601;
}

impl Buffer {
    /// New memory, filled with zeros.
    pub(crate) fn new(device: &Arc<Shared<Device>>, bytes: usize) -> Result<Buffer> {
        let too_large = || Failure {
            code: crate::abi::ErrorCode::OutOfMemory,
            message: format!("a buffer of {bytes} bytes does not fit into memory"),
        };
        let padded = bytes.checked_add(ALIGNMENT).ok_or_else(too_large)? / ALIGNMENT * ALIGNMENT;
        let layout = Layout::from_size_align(padded, ALIGNMENT).map_err(|_| too_large())?;
        if !device.memory(bytes as isize, false) {
            return Err(Failure { message: "the memory monitor refused".to_owned(), ..too_large() });
        }
        // SAFETY: the size is at least `ALIGNMENT` less one, rounded up, so not 0.
        let data = unsafe { alloc_zeroed(layout) };
        if data.is_null() {
            device.memory(-(bytes as isize), true);
            return Err(too_large());
        }
        Ok(Buffer { device: device.clone(), data, bytes, owned: Some(layout) })
    }

    /// Memory of the program.
    pub(crate) fn shared(device: &Arc<Shared<Device>>, data: *mut c_void, bytes: usize) -> Buffer {
        Buffer { device: device.clone(), data: data.cast(), bytes, owned: None }
    }

    pub(crate) fn data(&self) -> *mut c_void {
        self.data.cast()
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        if let Some(layout) = self.owned {
            // SAFETY: `new` allocated it with this layout, and it is dropped once.
            unsafe { dealloc(self.data, layout) };
            self.device.memory(-(self.bytes as isize), true);
        }
    }
}

/// Items of a buffer.
#[derive(Clone, Debug)]
pub(crate) struct View {
    first: *const u8,
    pub(crate) stride: usize,
    pub(crate) count: usize,
    pub(crate) format: u32,
    /// Keeps memory alive that the buffer owns.
    _buffer: Arc<Shared<Buffer>>,
}

// SAFETY: as for `Buffer`.
unsafe impl Send for View {}
// SAFETY: as above.
unsafe impl Sync for View {}

impl View {
    /// `count` items of a format, each `stride` bytes after the one before, from `offset` on.
    pub(crate) fn new(
        buffer: &Arc<Shared<Buffer>>,
        format: u32,
        [offset, stride, count]: [usize; 3],
    ) -> Result<View> {
        if count > u32::MAX as usize || stride > u32::MAX as usize {
            return argument("buffer too large: expected at most 2^32 - 1 items of 2^32 - 1 bytes");
        }
        let first = buffer.data().cast_const().cast::<u8>().wrapping_add(offset);
        if !(first as usize).is_multiple_of(4) || !stride.is_multiple_of(4) {
            return crate::error::operation(
                "data must be aligned to 4 bytes, found another offset or stride",
            );
        }
        Ok(View { first, stride, count, format, _buffer: buffer.clone() })
    }

    pub(crate) fn data(&self) -> *const c_void {
        self.first.cast()
    }

    /// The words of an item.
    ///
    /// # Safety
    /// The index is below the count, and the format has `N` words.
    #[inline(always)]
    pub(crate) unsafe fn words<const N: usize>(&self, index: usize) -> [u32; N] {
        // SAFETY: by contract the item exists, and the program declared its words to be readable.
        unsafe { self.first.add(index * self.stride).cast::<[u32; N]>().read_unaligned() }
    }

    /// The numbers of an item.
    ///
    /// # Safety
    /// The contract of [`Self::words`].
    #[inline(always)]
    pub(crate) unsafe fn floats<const N: usize>(&self, index: usize) -> [f32; N] {
        // SAFETY: the contract is the same.
        unsafe { self.words::<N>(index) }.map(f32::from_bits)
    }

    /// One number of an item; 0 beyond the items or the stride.
    pub(crate) fn float(&self, index: usize, word: usize) -> f32 {
        if index >= self.count || 4 * word >= self.stride.max(4) {
            return 0.0;
        }
        // SAFETY: the word is one of an item, and the program declared the items to be readable.
        unsafe { self.first.add(index * self.stride + 4 * word).cast::<f32>().read_unaligned() }
    }
}
