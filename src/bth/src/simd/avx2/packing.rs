//! Permutations that expand and compress the lanes whose bit is set.

use std::arch::x86_64::*;

/// Permutation that expands a packed row: for each of eight lanes whose bit is set, the number of
/// set bits below it, which is the index of its element in the packed row.
///
/// # Safety
/// The machine must have the features of [`super::Avx2`].
#[inline(always)]
pub(super) unsafe fn expansion(bits: u8) -> __m256i {
    // SAFETY: the caller proves the features; registers only.
    unsafe {
        // A byte for each lane, 0xff where the bit is set.
        let bytes = _pdep_u64(bits.into(), 0x0101_0101_0101_0101) * 0xff;
        let indices = _pdep_u64(0x0706_0504_0302_0100, bytes);
        _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(indices as i64))
    }
}

/// Permutation that packs a row: the indices of the lanes, out of eight, whose bit is set, in
/// order. The inverse of [`expansion`].
///
/// # Safety
/// The same as for [`expansion`].
#[inline(always)]
pub(super) unsafe fn compression(bits: u8) -> __m256i {
    // SAFETY: the caller proves the features; registers only.
    unsafe {
        let bytes = _pdep_u64(bits.into(), 0x0101_0101_0101_0101) * 0xff;
        let indices = _pext_u64(0x0706_0504_0302_0100, bytes);
        _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(indices as i64))
    }
}
