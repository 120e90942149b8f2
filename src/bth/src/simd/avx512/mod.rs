//! Sixteen lanes in one AVX-512 register.
//!
//! The intrinsics of all `unsafe` blocks below may be executed, because an [`Avx512`] exists only
//! where [`Avx512::detect`] found the features that they need. The comments at the blocks prove the
//! accesses through pointers.
#![allow(unsafe_code)]

mod rows;
mod sort;
mod transpose;

use self::rows::{COLUMNS5, ROWS5, columns8, concat_quarters};
use self::sort::{keys_with_lanes, nearest_of_four, store_far_to_near};
use self::transpose::{transpose4, transpose16};
use super::{
    IN_ORDER, LANES, Lanewise, Part, Simd, assert_indices, avx_doubles, one_piece, valid_indices, x86_token,
};
use std::arch::x86_64::*;

x86_token!(
    /// Proof that this machine has AVX-512 F, BW, CD, DQ and VL, AVX2, FMA, BMI1, BMI2, LZCNT and
    /// POPCNT.
    Avx512, Avx512 = std::convert::identity, "avx512f" "avx512bw" "avx512cd" "avx512dq" "avx512vl"
    "avx2" "fma" "bmi1" "bmi2" "lzcnt" "popcnt"
);

type F = __m512;
type U = __m512i;

/// Methods that are one intrinsic on registers.
macro_rules! intrinsics {
    ($($name:ident($($arg:ident: $of:ty),*) -> $out:ty = $do:expr;)*) => { $(
        #[inline(always)]
        fn $name(self, $($arg: $of),*) -> $out {
            // SAFETY: self proves the features, and only registers are accessed.
            unsafe { $do }
        }
    )* };
}

impl Lanewise for Avx512 {
    type F = F;
    type U = U;
    type M = u16;
    intrinsics! {
        splat(x: f32) -> F = _mm512_set1_ps(x);
        add(a: F, b: F) -> F = _mm512_add_ps(a, b);
        sub(a: F, b: F) -> F = _mm512_sub_ps(a, b);
        mul(a: F, b: F) -> F = _mm512_mul_ps(a, b);
        div(a: F, b: F) -> F = _mm512_div_ps(a, b);
        fma(a: F, b: F, c: F) -> F = _mm512_fmadd_ps(a, b, c);
        fnma(a: F, b: F, c: F) -> F = _mm512_fnmadd_ps(a, b, c);
        min(a: F, b: F) -> F = _mm512_min_ps(a, b);
        max(a: F, b: F) -> F = _mm512_max_ps(a, b);
        abs(a: F) -> F = _mm512_abs_ps(a);
        // Immediate 0b1011: the greater in magnitude, with the sign bit cleared.
        max_abs(a: F, b: F) -> F = _mm512_range_ps::<0b1011>(a, b);
        lt(a: F, b: F) -> u16 = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, b);
        le(a: F, b: F) -> u16 = _mm512_cmp_ps_mask::<_CMP_LE_OQ>(a, b);
        select(m: u16, a: F, b: F) -> F = _mm512_mask_mov_ps(b, m, a);
        splat_u(x: u32) -> U = _mm512_set1_epi32(x as i32);
        add_u(a: U, b: U) -> U = _mm512_add_epi32(a, b);
        add_where(a: U, m: u16, b: U) -> U = _mm512_mask_add_epi32(a, m, a, b);
        and_u(a: U, b: U) -> U = _mm512_and_si512(a, b);
        or_u(a: U, b: U) -> U = _mm512_or_si512(a, b);
        xor_u(a: U, b: U) -> U = _mm512_xor_si512(a, b);
        eq_u(a: U, b: U) -> u16 = _mm512_cmpeq_epi32_mask(a, b);
        lt_u(a: U, b: U) -> u16 = _mm512_cmplt_epu32_mask(a, b);
        select_u(m: u16, a: U, b: U) -> U = _mm512_mask_mov_epi32(b, m, a);
        bits(a: F) -> U = _mm512_castps_si512(a);
        floats(a: U) -> F = _mm512_castsi512_ps(a);
    }
    #[inline(always)]
    fn load(self, from: &[f32; LANES]) -> F {
        // SAFETY: sixteen readable floats; unaligned loads.
        unsafe { _mm512_loadu_ps(from.as_ptr()) }
    }
    #[inline(always)]
    fn store(self, a: F, to: &mut [f32; LANES]) {
        // SAFETY: sixteen writable floats; unaligned stores.
        unsafe { _mm512_storeu_ps(to.as_mut_ptr(), a) }
    }
    #[inline(always)]
    fn load_u(self, from: &[u32; LANES]) -> U {
        // SAFETY: as `load`.
        unsafe { _mm512_loadu_si512(from.as_ptr().cast()) }
    }
    #[inline(always)]
    fn load_bytes(self, from: &[u8; LANES]) -> U {
        // SAFETY: sixteen readable bytes; an unaligned load.
        unsafe { _mm512_cvtepu8_epi32(_mm_loadu_si128(from.as_ptr().cast())) }
    }
    #[inline(always)]
    fn store_u(self, a: U, to: &mut [u32; LANES]) {
        // SAFETY: as `store`.
        unsafe { _mm512_storeu_si512(to.as_mut_ptr().cast(), a) }
    }
    #[inline(always)]
    fn shl_u<const K: u32>(self, a: U) -> U {
        // SAFETY: registers only.
        unsafe { _mm512_slli_epi32::<K>(a) }
    }
    #[inline(always)]
    fn mask(self, bits: u32) -> u16 {
        bits as u16
    }
    #[inline(always)]
    fn mask_bits(self, m: u16) -> u32 {
        m.into()
    }
    #[inline(always)]
    fn and(self, a: u16, b: u16) -> u16 {
        a & b
    }
    #[inline(always)]
    fn or(self, a: u16, b: u16) -> u16 {
        a | b
    }
    #[inline(always)]
    fn and_not(self, a: u16, b: u16) -> u16 {
        a & !b
    }
}

impl Simd for Avx512 {
    one_piece!();
    avx_doubles!();

    intrinsics! {
        lookup(table: F, at: U) -> F = _mm512_permutexvar_ps(at, table);
        least(a: F) -> f32 = _mm512_reduce_min_ps(a);
        lookup_u(table: U, at: U) -> U = _mm512_permutexvar_epi32(at, table);
    }

    #[inline(always)]
    fn rows4(self, m: u16, from: &[[f32; 4]], row: U) -> [F; 4] {
        let row = valid_indices(self, m, row, from.len());
        // SAFETY: `valid_indices` returns indices of rows of the slice; unaligned loads.
        unsafe {
            macro_rules! load {
                ($i:literal) => {
                    _mm_loadu_ps(from.as_ptr().add(row[$i] as usize).cast())
                };
            }
            // Four rows, each in a quarter of the lanes.
            macro_rules! quarters {
                ($($i:literal)*) => { concat_quarters(self, [$(load!($i)),*]) };
            }
            let (a, b) = (quarters!(0 4 8 12), quarters!(1 5 9 13));
            let (c, d) = (quarters!(2 6 10 14), quarters!(3 7 11 15));
            transpose4([a, b, c, d])
        }
    }
    #[inline(always)]
    fn rows8(self, m: u16, from: &[[u32; 8]], row: U) -> [U; 8] {
        let row = valid_indices(self, m, row, from.len());
        // SAFETY: `valid_indices` returns indices of rows of the slice.
        unsafe { columns8(self, from.as_ptr(), row) }
    }
    #[inline(always)]
    fn columns8(self, rows: &[[u32; 8]; LANES]) -> [U; 8] {
        // SAFETY: there are sixteen rows.
        unsafe { columns8(self, rows.as_ptr(), IN_ORDER) }
    }
    #[inline(always)]
    fn store_rows5(self, columns: [U; 5], to: &mut [[u32; 5]; LANES]) {
        let to = to.as_flattened_mut();
        for (part, to) in to.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
            let row = self.load_u(&ROWS5[part]);
            let mut words = self.lookup_u(columns[0], row);
            for k in 1..5 {
                // SAFETY: registers only.
                words = unsafe { _mm512_mask_permutexvar_epi32(words, COLUMNS5[part][k], row, columns[k]) };
            }
            self.store_u(words, to);
        }
    }
    const HAS_FAST_F64_LOOKUP: bool = true;
    #[inline(always)]
    fn lookup_f64<const FIRST_HALF: bool>(self, table: &[f64; LANES], at: U) -> [f64; LANES] {
        let mut out = [0.0; LANES];
        // SAFETY: self proves the features; the first and the last eight elements of arrays of
        // sixteen are read and written.
        unsafe {
            let (low, high) = (_mm512_loadu_pd(table.as_ptr()), _mm512_loadu_pd(table.as_ptr().add(8)));
            let first = _mm512_cvtepu32_epi64(_mm512_castsi512_si256(at));
            let second = _mm512_cvtepu32_epi64(_mm512_extracti64x4_epi64::<1>(at));
            // A permutation of one register uses three bits of each index, of two registers four.
            let [first, second] = if FIRST_HALF {
                [_mm512_permutexvar_pd(first, low), _mm512_permutexvar_pd(second, low)]
            } else {
                [_mm512_permutex2var_pd(low, first, high), _mm512_permutex2var_pd(low, second, high)]
            };
            _mm512_storeu_pd(out.as_mut_ptr(), first);
            _mm512_storeu_pd(out.as_mut_ptr().add(8), second);
        }
        out
    }
    #[inline(always)]
    fn gather_u(self, m: u16, from: &[u32], at: U) -> U {
        assert_indices(self, m, at, from.len());
        // SAFETY: the indices of set lanes lie in the slice and are not negative as i32; clear
        // lanes are not accessed.
        unsafe { _mm512_mask_i32gather_epi32::<4>(_mm512_setzero_si512(), m, at, from.as_ptr().cast()) }
    }
    #[inline(always)]
    fn gather_pair(self, m: u16, from: &[[u32; 2]], at: U) -> (U, U) {
        let at = valid_indices(self, m, at, from.len());
        // SAFETY: `valid_indices` returns indices of elements of the slice; unaligned loads of
        // eight bytes.
        unsafe {
            macro_rules! load {
                ($i:literal) => {
                    from.as_ptr().add(at[$i] as usize).cast()
                };
            }
            // `two` loads two elements to a register of four lanes, and `quarters` two elements to
            // each quarter of the lanes.
            macro_rules! two {
                ($a:literal $b:literal) => {
                    _mm_castpd_ps(_mm_loadh_pd(_mm_load_sd(load!($a)), load!($b)))
                };
            }
            macro_rules! quarters {
                ($($a:literal $b:literal)*) => { concat_quarters(self, [$(two!($a $b)),*]) };
            }
            let (low, high) = (quarters!(0 1 4 5 8 9 12 13), quarters!(2 3 6 7 10 11 14 15));
            let first = _mm512_shuffle_ps::<0b10_00_10_00>(low, high);
            let second = _mm512_shuffle_ps::<0b11_01_11_01>(low, high);
            (self.bits(first), self.bits(second))
        }
    }
    #[inline(always)]
    fn expand(self, a: F, m: u16, from: &[f32; LANES]) -> F {
        // Expanding loads are slow on some machines, so the elements are loaded first.
        // SAFETY: registers only.
        unsafe { _mm512_mask_expand_ps(a, m, self.load(from)) }
    }
    #[inline(always)]
    fn expand_u(self, a: U, m: u16, from: &[u32; LANES]) -> U {
        // SAFETY: as `expand`.
        unsafe { _mm512_mask_expand_epi32(a, m, self.load_u(from)) }
    }
    const HAS_FAST_COMPRESS: bool = true;
    #[inline(always)]
    fn compress(self, bits: u32, a: U, to: &mut [u32; LANES]) -> usize {
        // SAFETY: all sixteen lanes are stored to an array of sixteen.
        unsafe {
            // Compression to a register and a store of all lanes are much faster than a compressing
            // store.
            _mm512_storeu_si512(to.as_mut_ptr().cast(), _mm512_maskz_compress_epi32(bits as u16, a));
        }
        (bits & 0xffff).count_ones() as usize
    }
    #[inline(always)]
    fn compress_f(self, bits: u32, a: F, to: &mut [f32; LANES]) -> usize {
        // SAFETY: as `compress`.
        unsafe { _mm512_storeu_ps(to.as_mut_ptr(), _mm512_maskz_compress_ps(bits as u16, a)) };
        (bits & 0xffff).count_ones() as usize
    }
    #[inline(always)]
    fn compress_far_to_near(
        self,
        bits: u32,
        key: F,
        a: U,
        to: &mut [u32; LANES],
        keys: &mut [f32; LANES],
    ) -> usize {
        // SAFETY: `self` proves the features.
        unsafe { store_far_to_near::<false>(bits as u16, keys_with_lanes(key), a, to, keys) }
    }
    #[inline(always)]
    fn sort_far_to_near(
        self,
        bits: u32,
        key: F,
        a: U,
        to: &mut [u32; LANES],
        keys: &mut [f32; LANES],
    ) -> (usize, usize) {
        // SAFETY: `self` proves the features.
        unsafe {
            let key = keys_with_lanes(key);
            let count = store_far_to_near::<true>(bits as u16, key, a, to, keys);
            // The traversal of a single ray depends on the latency of the nearest: a minimum is
            // faster than the sorted keys.
            let nearest =
                if count <= 4 { nearest_of_four(bits as u16, key) } else { keys[count - 1].to_bits() };
            (count, nearest as usize % LANES)
        }
    }
    #[inline(always)]
    fn keep_up_to(self, codes: &mut [u32], keys: &mut [f32], limit: f32) -> usize {
        let len = codes.len().min(keys.len());
        let (mut from, mut kept) = (0, 0);
        let limit = self.splat(limit);
        while from < len {
            let valid = if len - from >= LANES { u16::MAX } else { (1 << (len - from)) - 1 };
            // SAFETY: the masked loads read only elements below len. The masked stores write
            // `count` elements from `kept` on, and kept + count is at most the number of elements
            // read so far.
            unsafe {
                let key = _mm512_maskz_loadu_ps(valid, keys.as_ptr().add(from));
                let code = _mm512_maskz_loadu_epi32(valid, codes.as_ptr().add(from).cast());
                let keep = _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(valid, key, limit);
                let count = keep.count_ones();
                let stored = ((1u32 << count) - 1) as u16;
                _mm512_mask_storeu_ps(
                    keys.as_mut_ptr().add(kept),
                    stored,
                    _mm512_maskz_compress_ps(keep, key),
                );
                let code = _mm512_maskz_compress_epi32(keep, code);
                _mm512_mask_storeu_epi32(codes.as_mut_ptr().add(kept).cast(), stored, code);
                kept += count as usize;
            }
            from += LANES;
        }
        kept
    }
    #[inline(always)]
    fn transpose(self, rows: [F; LANES]) -> [F; LANES] {
        // SAFETY: self proves the features; registers only.
        unsafe { transpose16(rows) }
    }
    #[inline(always)]
    fn least_of_each(self, rows: [F; LANES]) -> F {
        // SAFETY: as `transpose`.
        unsafe { transpose::least_of_each(rows) }
    }
}
