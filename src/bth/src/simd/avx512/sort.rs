//! Sorting networks in registers.

use crate::simd::LANES;
use std::arch::x86_64::*;

/// Step of a bitonic sorting network in descending order: lanes whose bit is set in `keep_greater`
/// take the larger of two values, their value and their partner's; the other lanes take the
/// smaller.
macro_rules! exchange {
    ($min:ident, $mask_max:ident, $v:expr, $partner:expr, $keep_greater:expr) => {{
        let (v, partner) = ($v, $partner);
        $mask_max($min(v, partner), $keep_greater, v, partner)
    }};
}

/// Sorts four i32 lanes in descending order.
///
/// # Safety
/// The machine must have the features of [`super::Avx512`]. Only registers are accessed.
#[inline(always)]
pub(super) unsafe fn sort4(v: __m128i) -> __m128i {
    // SAFETY: the caller proves the features.
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
/// The same as for [`sort4`].
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
/// The same as for [`sort4`].
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

/// Replaces the four lowest bits of each key by the index of its lane, which thus moves with the
/// key when keys are sorted.
///
/// # Safety
/// The same as for [`sort4`].
#[inline(always)]
pub(super) unsafe fn keys_with_lanes(key: __m512) -> __m512i {
    // SAFETY: see `sort4`.
    unsafe {
        let lane = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
        _mm512_or_si512(_mm512_andnot_si512(_mm512_set1_epi32(15), _mm512_castps_si512(key)), lane)
    }
}

/// Stores the keys of `lanes` and their values `a` in descending order of the keys, which come from
/// [`keys_with_lanes`]; returns their number. `WHOLE` stores all sixteen entries of both arrays, so
/// that no store before needs to initialize them.
///
/// # Safety
/// The machine must have the features of [`super::Avx512`].
#[inline(always)]
pub(super) unsafe fn store_far_to_near<const WHOLE: bool>(
    lanes: u16,
    key: __m512i,
    a: __m512i,
    to: &mut [u32; LANES],
    keys: &mut [f32; LANES],
) -> usize {
    let count = lanes.count_ones() as usize;
    // SAFETY: the caller proves the features, and 4, 8 or 16 lanes are stored to arrays of sixteen.
    unsafe {
        let least = _mm512_set1_epi32(i32::MIN);
        if count <= 4 {
            let key = sort4(_mm512_castsi512_si128(_mm512_mask_compress_epi32(least, lanes, key)));
            let a = _mm512_permutexvar_epi32(_mm512_castsi128_si512(key), a);
            if WHOLE {
                _mm512_storeu_si512(keys.as_mut_ptr().cast(), _mm512_zextsi128_si512(key));
                _mm512_storeu_si512(to.as_mut_ptr().cast(), a);
            } else {
                _mm_storeu_ps(keys.as_mut_ptr(), _mm_castsi128_ps(key));
                _mm_storeu_si128(to.as_mut_ptr().cast(), _mm512_castsi512_si128(a));
            }
        } else if count <= 8 {
            let key = sort8(_mm512_castsi512_si256(_mm512_mask_compress_epi32(least, lanes, key)));
            let a = _mm512_permutexvar_epi32(_mm512_castsi256_si512(key), a);
            if WHOLE {
                _mm512_storeu_si512(keys.as_mut_ptr().cast(), _mm512_zextsi256_si512(key));
                _mm512_storeu_si512(to.as_mut_ptr().cast(), a);
            } else {
                _mm256_storeu_ps(keys.as_mut_ptr(), _mm256_castsi256_ps(key));
                _mm256_storeu_si256(to.as_mut_ptr().cast(), _mm512_castsi512_si256(a));
            }
        } else {
            let key = sort16(_mm512_mask_mov_epi32(least, lanes, key));
            let a = _mm512_permutexvar_epi32(key, a);
            _mm512_storeu_ps(keys.as_mut_ptr(), _mm512_castsi512_ps(key));
            _mm512_storeu_si512(to.as_mut_ptr().cast(), a);
        }
    }
    count
}

/// The smallest key of at most four lanes.
///
/// # Safety
/// The same as for [`sort4`].
#[inline(always)]
pub(super) unsafe fn nearest_of_four(lanes: u16, key: __m512i) -> u32 {
    // SAFETY: see `sort4`.
    unsafe {
        let key = _mm512_mask_compress_epi32(_mm512_set1_epi32(i32::MAX), lanes, key);
        let key = _mm512_castsi512_si128(key);
        let key = _mm_min_epi32(key, _mm_shuffle_epi32::<0b01_00_11_10>(key));
        _mm_cvtsi128_si32(_mm_min_epi32(key, _mm_shuffle_epi32::<0b10_11_00_01>(key))) as u32
    }
}
