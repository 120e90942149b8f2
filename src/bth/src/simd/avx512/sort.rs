//! Sorting networks in registers.

use std::arch::x86_64::*;

/// Step of a bitonic sorting network, descending: lanes whose bit is set keep the greater of themselves and partner.
macro_rules! exchange {
    ($min:ident, $mask_max:ident, $v:expr, $partner:expr, $keep_greater:expr) => {{
        let (v, partner) = ($v, $partner);
        $mask_max($min(v, partner), $keep_greater, v, partner)
    }};
}

/// Sorts four lanes of i32, the greatest first.
///
/// # Safety
/// The machine must have the features of [`super::Avx512`]. Touches registers only, as the next two.
#[inline(always)]
pub(super) unsafe fn sort4(v: __m128i) -> __m128i {
    // SAFETY: see above.
    unsafe {
        let v =
            exchange!(_mm_min_epi32, _mm_mask_max_epi32, v, _mm_shuffle_epi32::<0b10_11_00_01>(v), 0b1001);
        let v =
            exchange!(_mm_min_epi32, _mm_mask_max_epi32, v, _mm_shuffle_epi32::<0b01_00_11_10>(v), 0b0011);
        exchange!(_mm_min_epi32, _mm_mask_max_epi32, v, _mm_shuffle_epi32::<0b10_11_00_01>(v), 0b0101)
    }
}

/// Sorts eight lanes; see [`sort4`].
///
/// # Safety
/// As [`sort4`].
#[inline(always)]
pub(super) unsafe fn sort8(v: __m256i) -> __m256i {
    macro_rules! step {
        ($v:expr, $partner:expr, $mask:literal) => {
            exchange!(_mm256_min_epi32, _mm256_mask_max_epi32, $v, $partner, $mask)
        };
    }
    // SAFETY: see `sort4`.
    unsafe {
        let v = step!(v, _mm256_shuffle_epi32::<0b10_11_00_01>(v), 0b1001_1001);
        let v = step!(v, _mm256_shuffle_epi32::<0b01_00_11_10>(v), 0b1100_0011);
        let v = step!(v, _mm256_shuffle_epi32::<0b10_11_00_01>(v), 0b1010_0101);
        let v = step!(v, _mm256_permute4x64_epi64::<0b01_00_11_10>(v), 0b0000_1111);
        let v = step!(v, _mm256_shuffle_epi32::<0b01_00_11_10>(v), 0b0011_0011);
        step!(v, _mm256_shuffle_epi32::<0b10_11_00_01>(v), 0b0101_0101)
    }
}

/// Sorts sixteen lanes; see [`sort4`].
///
/// # Safety
/// As [`sort4`].
#[inline(always)]
pub(super) unsafe fn sort16(v: __m512i) -> __m512i {
    macro_rules! step {
        ($v:expr, $partner:expr, $mask:literal) => {
            exchange!(_mm512_min_epi32, _mm512_mask_max_epi32, $v, $partner, $mask)
        };
    }
    // SAFETY: see `sort4`.
    unsafe {
        let v = step!(v, _mm512_shuffle_epi32::<0b10_11_00_01>(v), 0b1001_1001_1001_1001);
        let v = step!(v, _mm512_shuffle_epi32::<0b01_00_11_10>(v), 0b1100_0011_1100_0011);
        let v = step!(v, _mm512_shuffle_epi32::<0b10_11_00_01>(v), 0b1010_0101_1010_0101);
        let v = step!(v, _mm512_shuffle_i32x4::<0b10_11_00_01>(v, v), 0b1111_0000_0000_1111);
        let v = step!(v, _mm512_shuffle_epi32::<0b01_00_11_10>(v), 0b1100_1100_0011_0011);
        let v = step!(v, _mm512_shuffle_epi32::<0b10_11_00_01>(v), 0b1010_1010_0101_0101);
        let v = step!(v, _mm512_shuffle_i32x4::<0b01_00_11_10>(v, v), 0b0000_0000_1111_1111);
        let v = step!(v, _mm512_shuffle_i32x4::<0b10_11_00_01>(v, v), 0b0000_1111_0000_1111);
        let v = step!(v, _mm512_shuffle_epi32::<0b01_00_11_10>(v), 0b0011_0011_0011_0011);
        step!(v, _mm512_shuffle_epi32::<0b10_11_00_01>(v), 0b0101_0101_0101_0101)
    }
}
