//! Where the lanes whose bit is set go in a packed row, and from where they come.

use std::arch::x86_64::*;

/// For each lane of eight whose bit is set, how many set bits lie below it: where its element is in a packed row.
///
/// # Safety
/// The machine must have the features of [`super::Avx2`].
#[inline(always)]
pub(super) unsafe fn expansion(bits: u8) -> __m256i {
    // SAFETY: see above; registers only.
    unsafe {
        // A byte a lane: ones where the bit is set.
        let bytes = _pdep_u64(bits.into(), 0x0101_0101_0101_0101) * 0xff;
        let places = _pdep_u64(0x0706_0504_0302_0100, bytes);
        _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(places as i64))
    }
}

/// Places of the lanes of eight whose bit is set, in order: the inverse of [`expansion`].
///
/// # Safety
/// As [`expansion`].
#[inline(always)]
pub(super) unsafe fn compression(bits: u8) -> __m256i {
    // SAFETY: see above; registers only.
    unsafe {
        let bytes = _pdep_u64(bits.into(), 0x0101_0101_0101_0101) * 0xff;
        let places = _pext_u64(0x0706_0504_0302_0100, bytes);
        _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(places as i64))
    }
}
