//! Four lanes in a register of SSE4.1.
//!
//! The intrinsics of all `unsafe` blocks below may be executed, because an [`Sse4`] exists only
//! where [`Sse4::detect`] found the features that they need. The comments at the blocks prove the
//! accesses through pointers.
#![allow(unsafe_code)]

use super::{LANES, QUAD, QUADS, Quad, Quads};
use crate::simd::{Part, x86_token};
use std::arch::x86_64::*;

x86_token!(
    /// Proof that this machine has SSE4.1, SSSE3 and POPCNT.
    Sse4, Quads<Sse4> = Quads, "sse4.1" "ssse3" "popcnt"
);

type F = __m128;
type U = __m128i;

/// [`Simd::greatest_of_three`](crate::simd::Simd::greatest_of_three).
///
/// # Safety
/// The machine must have SSE4.1.
#[inline(always)]
pub(in crate::simd) unsafe fn greatest_of_three(a: [f32; QUAD]) -> [f32; QUAD] {
    // SAFETY: the caller proves the feature; four floats are loaded from an array of four, and
    // stored to one.
    unsafe {
        let a = _mm_castps_si128(_mm_loadu_ps(a.as_ptr()));
        // Lanes 0, 1, 2 and 2; 1, 2, 0 and 0; 2, 0, 1 and 1.
        let [x, y, z] = [
            _mm_shuffle_epi32::<0b10_10_01_00>(a),
            _mm_shuffle_epi32::<0b00_00_10_01>(a),
            _mm_shuffle_epi32::<0b01_01_00_10>(a),
        ];
        let mut out = [0.0; QUAD];
        _mm_storeu_ps(out.as_mut_ptr(), _mm_castsi128_ps(_mm_max_epu32(_mm_max_epu32(x, y), z)));
        out
    }
}

/// Methods of registers alone.
macro_rules! registers {
    ($($name:ident($($arg:ident: $of:ty),*) -> $out:ty = $do:expr;)*) => { $(
        #[inline(always)]
        fn $name(self, $($arg: $of),*) -> $out {
            // SAFETY: self proves the features, and only registers are accessed.
            unsafe { $do }
        }
    )* };
}

impl Quad for Sse4 {
    type F = F;
    type U = U;

    #[inline(always)]
    fn call<P: Part<Quads<Self>>>(simd: Quads<Self>, part: P) -> P::Output {
        // SAFETY: the token proves that the machine has the features that `part_entry` enables.
        unsafe { part_entry(simd, part) }
    }

    registers! {
        splat(x: f32) -> F = _mm_set1_ps(x);
        add(a: F, b: F) -> F = _mm_add_ps(a, b);
        sub(a: F, b: F) -> F = _mm_sub_ps(a, b);
        mul(a: F, b: F) -> F = _mm_mul_ps(a, b);
        div(a: F, b: F) -> F = _mm_div_ps(a, b);
        fma(a: F, b: F, c: F) -> F = _mm_add_ps(_mm_mul_ps(a, b), c);
        fnma(a: F, b: F, c: F) -> F = _mm_sub_ps(c, _mm_mul_ps(a, b));
        min(a: F, b: F) -> F = _mm_min_ps(a, b);
        max(a: F, b: F) -> F = _mm_max_ps(a, b);
        abs(a: F) -> F = _mm_andnot_ps(_mm_set1_ps(-0.0), a);
        lt(a: F, b: F) -> U = _mm_castps_si128(_mm_cmplt_ps(a, b));
        le(a: F, b: F) -> U = _mm_castps_si128(_mm_cmple_ps(a, b));
        select(m: U, a: F, b: F) -> F = _mm_blendv_ps(b, a, _mm_castsi128_ps(m));
        least(a: F) -> f32 = {
            let a = _mm_min_ps(a, _mm_movehl_ps(a, a));
            _mm_cvtss_f32(_mm_min_ss(a, _mm_shuffle_ps::<1>(a, a)))
        };
        transpose(rows: [F; QUAD]) -> [F; QUAD] = {
            let [a, b, c, d] = rows;
            let (low, high) = (_mm_unpacklo_ps(a, b), _mm_unpackhi_ps(a, b));
            let (low_2, high_2) = (_mm_unpacklo_ps(c, d), _mm_unpackhi_ps(c, d));
            [
                _mm_movelh_ps(low, low_2),
                _mm_movehl_ps(low_2, low),
                _mm_movelh_ps(high, high_2),
                _mm_movehl_ps(high_2, high),
            ]
        };
        splat_u(x: u32) -> U = _mm_set1_epi32(x as i32);
        add_u(a: U, b: U) -> U = _mm_add_epi32(a, b);
        and_u(a: U, b: U) -> U = _mm_and_si128(a, b);
        or_u(a: U, b: U) -> U = _mm_or_si128(a, b);
        xor_u(a: U, b: U) -> U = _mm_xor_si128(a, b);
        and_not(a: U, b: U) -> U = _mm_andnot_si128(b, a);
        eq_u(a: U, b: U) -> U = _mm_cmpeq_epi32(a, b);
        // a < b unless max(a, b) is a.
        lt_u(a: U, b: U) -> U = _mm_xor_si128(_mm_cmpeq_epi32(_mm_max_epu32(a, b), a), _mm_set1_epi32(-1));
        bits(a: F) -> U = _mm_castps_si128(a);
        floats(a: U) -> F = _mm_castsi128_ps(a);
        mask_bits(m: U) -> u32 = _mm_movemask_ps(_mm_castsi128_ps(m)) as u32;
        // Masks keep their value when signed words and halves are saturated.
        mask_bits_of_all(m: [U; QUADS]) -> u32 =
            _mm_movemask_epi8(_mm_packs_epi16(_mm_packs_epi32(m[0], m[1]), _mm_packs_epi32(m[2], m[3]))) as u32;
    }

    #[inline(always)]
    fn load(self, from: &[f32; QUAD]) -> F {
        // SAFETY: four readable floats; unaligned load.
        unsafe { _mm_loadu_ps(from.as_ptr()) }
    }
    #[inline(always)]
    fn store(self, a: F, to: &mut [f32; QUAD]) {
        // SAFETY: four writable floats; unaligned store.
        unsafe { _mm_storeu_ps(to.as_mut_ptr(), a) }
    }
    #[inline(always)]
    fn load_u(self, from: &[u32; QUAD]) -> U {
        // SAFETY: four readable words; unaligned load.
        unsafe { _mm_loadu_si128(from.as_ptr().cast()) }
    }
    #[inline(always)]
    fn store_u(self, a: U, to: &mut [u32; QUAD]) {
        // SAFETY: four writable words; unaligned store.
        unsafe { _mm_storeu_si128(to.as_mut_ptr().cast(), a) }
    }
    #[inline(always)]
    fn load_bytes(self, from: &[u8; QUAD]) -> U {
        // SAFETY: four readable bytes; unaligned load.
        unsafe { _mm_cvtepu8_epi32(_mm_loadu_si32(from.as_ptr().cast())) }
    }
    #[inline(always)]
    fn shl_u<const K: u32>(self, a: U) -> U {
        // SAFETY: registers only. The count is passed in a register, because an immediate would
        // have to be an i32 constant.
        unsafe { _mm_sll_epi32(a, _mm_cvtsi32_si128(K as i32)) }
    }
    #[inline(always)]
    fn bytes(self, a: U, at: &[u8; LANES]) -> U {
        // SAFETY: sixteen readable bytes; unaligned load.
        unsafe { _mm_shuffle_epi8(a, _mm_loadu_si128(at.as_ptr().cast())) }
    }
    #[inline(always)]
    fn greatest_of_three(self, a: [f32; QUAD]) -> [f32; QUAD] {
        // SAFETY: self proves the feature.
        unsafe { greatest_of_three(a) }
    }
    #[inline(always)]
    fn prefetch<T>(self, address: *const T) {
        // SAFETY: a hint that never faults, whatever the address.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(address.cast()) }
    }
}
