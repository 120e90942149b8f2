//! Transposition of rows of a few words to vectors of sixteen lanes.

use super::{Avx2, U};
use crate::simd::{LANES, Lanewise};
use std::arch::x86_64::*;

/// Transposes four by four lanes within each half.
///
/// # Safety
/// The machine must have the features of [`super::Avx2`].
#[inline(always)]
pub(super) unsafe fn transpose4([a, b, c, d]: [__m256; 4]) -> [__m256; 4] {
    // SAFETY: the caller proves the features; registers only.
    unsafe {
        let (a, b) = (_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
        let (c, d) = (_mm256_unpacklo_ps(c, d), _mm256_unpackhi_ps(c, d));
        [
            _mm256_shuffle_ps::<0b01_00_01_00>(a, c),
            _mm256_shuffle_ps::<0b11_10_11_10>(a, c),
            _mm256_shuffle_ps::<0b01_00_01_00>(b, d),
            _mm256_shuffle_ps::<0b11_10_11_10>(b, d),
        ]
    }
}

/// Transposes eight by eight lanes.
///
/// # Safety
/// The same as for [`transpose4`].
#[inline(always)]
pub(super) unsafe fn transpose8(rows: [__m256; 8]) -> [__m256; 8] {
    let mut out = rows;
    // SAFETY: see `transpose4`.
    unsafe {
        // Columns 0 to 3 of these four rows in the low half, columns 4 to 7 in the high half; `low`
        // are the first four rows.
        let low = transpose4([rows[0], rows[1], rows[2], rows[3]]);
        let high = transpose4([rows[4], rows[5], rows[6], rows[7]]);
        for k in 0..4 {
            out[k] = _mm256_permute2f128_ps::<0x20>(low[k], high[k]);
            out[4 + k] = _mm256_permute2f128_ps::<0x31>(low[k], high[k]);
        }
    }
    out
}

/// Loads the rows with the indices `row` and transposes them, see [`crate::simd::Simd::rows8`].
///
/// # Safety
/// `from` must point to rows that include all of these indices.
#[inline(always)]
pub(super) unsafe fn columns8(simd: Avx2, from: *const [u32; 8], row: [u32; LANES]) -> [U; 8] {
    let mut out = [simd.splat_u(0); 8];
    // SAFETY: the token proves the features, and the caller the rows; unaligned loads.
    unsafe {
        for half in 0..2 {
            let mut rows = [simd.splat(0.0)[0]; 8];
            for i in 0..8 {
                rows[i] = _mm256_loadu_ps(from.add(row[8 * half + i] as usize).cast());
            }
            let columns = transpose8(rows);
            for k in 0..8 {
                out[k][half] = _mm256_castps_si256(columns[k]);
            }
        }
    }
    out
}
