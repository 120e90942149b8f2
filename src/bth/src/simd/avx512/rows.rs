//! Transposition of rows of a few words to vectors of sixteen lanes, and back.

use super::Avx512;
use super::transpose::transpose4;
use crate::simd::{LANES, Lanewise};
use std::arch::x86_64::*;

/// Concatenates four registers of four lanes.
#[inline(always)]
pub(super) fn concat_quarters(_simd: Avx512, [a, b, c, d]: [__m128; 4]) -> __m512 {
    // SAFETY: the token proves the features, and only registers are accessed.
    unsafe {
        let four = _mm512_insertf32x4::<1>(_mm512_castps128_ps512(a), b);
        _mm512_insertf32x4::<3>(_mm512_insertf32x4::<2>(four, c), d)
    }
}

/// Loads the rows with the indices `row` and transposes them, see [`crate::simd::Simd::rows8`].
///
/// # Safety
/// `from` must point to rows that include all of these indices.
#[inline(always)]
pub(super) unsafe fn columns8(simd: Avx512, from: *const [u32; 8], row: [u32; LANES]) -> [__m512i; 8] {
    // SAFETY: the token proves the features, and the caller the rows; unaligned loads.
    unsafe {
        macro_rules! load {
            ($i:literal) => {
                _mm256_loadu_ps(from.add(row[$i] as usize).cast())
            };
        }
        macro_rules! halves {
            ($a:literal $b:literal) => {
                _mm512_insertf32x8::<1>(_mm512_castps256_ps512(load!($a)), load!($b))
            };
        }
        // After these transpositions, quarters 0 and 2 belong to columns 0 to 3, quarters 1 and 3
        // to columns 4 to 7.
        let low = transpose4([halves!(0 4), halves!(1 5), halves!(2 6), halves!(3 7)]);
        let high = transpose4([halves!(8 12), halves!(9 13), halves!(10 14), halves!(11 15)]);
        let mut out = [simd.bits(low[0]); 8];
        for k in 0..4 {
            out[k] = simd.bits(_mm512_shuffle_f32x4::<0b10_00_10_00>(low[k], high[k]));
            out[4 + k] = simd.bits(_mm512_shuffle_f32x4::<0b11_01_11_01>(low[k], high[k]));
        }
        out
    }
}

/// For the 80 consecutive words of sixteen rows of five words, as five vectors: the index of each
/// word's row.
pub(super) const ROWS5: [[u32; LANES]; 5] = {
    let mut rows = [[0; LANES]; 5];
    let mut i = 0;
    while i < 5 * LANES {
        rows[i / LANES][i % LANES] = i as u32 / 5;
        i += 1;
    }
    rows
};

/// For each of the vectors of [`ROWS5`] and each column, the bits of the words that belong to the
/// column.
pub(super) const COLUMNS5: [[u16; 5]; 5] = {
    let mut columns = [[0; 5]; 5];
    let mut i = 0;
    while i < 5 * LANES {
        columns[i / LANES][i % 5] |= 1 << (i % LANES);
        i += 1;
    }
    columns
};
