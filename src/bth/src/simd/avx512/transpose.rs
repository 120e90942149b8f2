//! Transposition of vectors in registers, and the reduction of each of sixteen vectors to one lane.

use crate::simd::LANES;
use std::arch::x86_64::*;

/// Transposes four by four lanes within each quarter.
///
/// # Safety
/// The same as for [`super::sort::sort4`].
#[inline(always)]
pub(super) unsafe fn transpose4([a, b, c, d]: [__m512; 4]) -> [__m512; 4] {
    // SAFETY: see `super::sort::sort4`.
    unsafe {
        let (a, b) = (_mm512_unpacklo_ps(a, b), _mm512_unpackhi_ps(a, b));
        let (c, d) = (_mm512_unpacklo_ps(c, d), _mm512_unpackhi_ps(c, d));
        [
            _mm512_shuffle_ps::<0b01_00_01_00>(a, c),
            _mm512_shuffle_ps::<0b11_10_11_10>(a, c),
            _mm512_shuffle_ps::<0b01_00_01_00>(b, d),
            _mm512_shuffle_ps::<0b11_10_11_10>(b, d),
        ]
    }
}

/// Transposes sixteen vectors: lane k of row i becomes lane i of row k.
///
/// # Safety
/// The same as for [`transpose4`].
#[inline(always)]
pub(super) unsafe fn transpose16(rows: [__m512; LANES]) -> [__m512; LANES] {
    let mut r = rows;
    // SAFETY: the caller proves the features.
    unsafe {
        // First four by four lanes within each quarter of the lanes.
        for i in (0..LANES).step_by(4) {
            let four = transpose4([r[i], r[i + 1], r[i + 2], r[i + 3]]);
            r[i..i + 4].copy_from_slice(&four);
        }
        // Then the quarters: row 4p + i now holds lane 4q + i of rows 4p to 4p + 3 in its quarter
        // q.
        let mut out = r;
        for i in 0..4 {
            let (a, b) = (r[i], r[i + 4]);
            let (c, d) = (r[i + 8], r[i + 12]);
            let (even, odd) =
                (_mm512_shuffle_f32x4::<0b10_00_10_00>(a, b), _mm512_shuffle_f32x4::<0b11_01_11_01>(a, b));
            let (even2, odd2) =
                (_mm512_shuffle_f32x4::<0b10_00_10_00>(c, d), _mm512_shuffle_f32x4::<0b11_01_11_01>(c, d));
            out[i] = _mm512_shuffle_f32x4::<0b10_00_10_00>(even, even2);
            out[i + 8] = _mm512_shuffle_f32x4::<0b11_01_11_01>(even, even2);
            out[i + 4] = _mm512_shuffle_f32x4::<0b10_00_10_00>(odd, odd2);
            out[i + 12] = _mm512_shuffle_f32x4::<0b11_01_11_01>(odd, odd2);
        }
        out
    }
}

/// Lane i of the result is the smallest lane of row i.
///
/// # Safety
/// The same as for [`transpose4`].
#[inline(always)]
pub(super) unsafe fn least_of_each(rows: [__m512; LANES]) -> __m512 {
    let mut r = rows;
    // SAFETY: the caller proves the features.
    unsafe {
        // Each step takes minima of the halves of two vectors and packs them into one vector: two
        // steps within each quarter of the lanes, then two over the quarters.
        for i in 0..8 {
            let (a, b) = (r[2 * i], r[2 * i + 1]);
            r[i] = _mm512_min_ps(_mm512_unpacklo_ps(a, b), _mm512_unpackhi_ps(a, b));
        }
        for i in 0..4 {
            let (a, b) = (_mm512_castps_pd(r[2 * i]), _mm512_castps_pd(r[2 * i + 1]));
            let (low, high) = (_mm512_unpacklo_pd(a, b), _mm512_unpackhi_pd(a, b));
            r[i] = _mm512_min_ps(_mm512_castpd_ps(low), _mm512_castpd_ps(high));
        }
        for i in 0..2 {
            let (a, b) = (r[2 * i], r[2 * i + 1]);
            let low = _mm512_shuffle_f32x4::<0b01_00_01_00>(a, b);
            r[i] = _mm512_min_ps(low, _mm512_shuffle_f32x4::<0b11_10_11_10>(a, b));
        }
        let even = _mm512_shuffle_f32x4::<0b10_00_10_00>(r[0], r[1]);
        _mm512_min_ps(even, _mm512_shuffle_f32x4::<0b11_01_11_01>(r[0], r[1]))
    }
}
