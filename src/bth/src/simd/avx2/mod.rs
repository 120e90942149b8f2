//! Sixteen lanes in two AVX2 registers.
//!
//! The intrinsics of all `unsafe` blocks below may be executed, because an [`Avx2`] exists only
//! where [`Avx2::detect`] found the features that they need. The comments at the blocks prove the
//! accesses through pointers.
#![allow(unsafe_code)]

pub(super) mod doubles;
mod packing;
mod rows;

use self::packing::{compression, expansion};
use self::rows::{columns8, transpose4, transpose8};
use super::{
    IN_ORDER, LANES, Lanewise, Part, Simd, assert_indices, avx_doubles, one_piece, scalar, valid_indices,
    x86_token,
};
use std::arch::x86_64::*;

x86_token!(
    /// Proof that this machine has AVX2, FMA, BMI1, BMI2, LZCNT and POPCNT.
    Avx2, Avx2 = std::convert::identity, "avx2" "fma" "bmi1" "bmi2" "lzcnt" "popcnt"
);

type F = [__m256; 2];
type U = [__m256i; 2];
/// All bits of a lane are set, or none.
type M = [__m256i; 2];

impl Avx2 {
    /// Elements `at[i] % 16` of the table, for half of the lanes.
    #[inline(always)]
    fn lookup_half(self, table: F, at: __m256i) -> __m256 {
        // SAFETY: registers only.
        unsafe {
            // Bit 3 of the index selects the half of the table. Shifted to the sign bit, it
            // controls the blend.
            let low = _mm256_permutevar8x32_ps(table[0], at);
            let high = _mm256_permutevar8x32_ps(table[1], at);
            _mm256_blendv_ps(low, high, _mm256_castsi256_ps(_mm256_slli_epi32::<28>(at)))
        }
    }

    /// The lanes of two vectors as arrays.
    #[inline(always)]
    fn to_arrays(self, a: F, b: U) -> ([f32; LANES], [u32; LANES]) {
        let mut out = ([0.0; LANES], [0; LANES]);
        self.store(a, &mut out.0);
        self.store_u(b, &mut out.1);
        out
    }
}

/// Methods that apply the same intrinsics to both halves.
macro_rules! halves {
    ($($name:ident($($arg:ident: $of:ty),*) -> $out:ty = $do:expr;)*) => { $(
        #[inline(always)]
        fn $name(self, $($arg: $of),*) -> $out {
            // SAFETY: self proves the features, and only registers are accessed.
            let low = unsafe {
                $(let $arg = $arg[0];)*
                $do
            };
            // SAFETY: as above.
            let high = unsafe {
                $(let $arg = $arg[1];)*
                $do
            };
            [low, high]
        }
    )* };
}

/// Pointers to the two halves of an array of sixteen.
#[inline(always)]
fn split<T>(from: &[T; LANES]) -> [*const T; 2] {
    let (low, high) = from.split_at(8);
    [low.as_ptr(), high.as_ptr()]
}

#[inline(always)]
fn split_mut<T>(to: &mut [T; LANES]) -> [*mut T; 2] {
    let (low, high) = to.split_at_mut(8);
    [low.as_mut_ptr(), high.as_mut_ptr()]
}

impl Lanewise for Avx2 {
    type F = F;
    type U = U;
    type M = M;
    halves! {
        add(a: F, b: F) -> F = _mm256_add_ps(a, b);
        sub(a: F, b: F) -> F = _mm256_sub_ps(a, b);
        mul(a: F, b: F) -> F = _mm256_mul_ps(a, b);
        div(a: F, b: F) -> F = _mm256_div_ps(a, b);
        fma(a: F, b: F, c: F) -> F = _mm256_fmadd_ps(a, b, c);
        fnma(a: F, b: F, c: F) -> F = _mm256_fnmadd_ps(a, b, c);
        min(a: F, b: F) -> F = _mm256_min_ps(a, b);
        max(a: F, b: F) -> F = _mm256_max_ps(a, b);
        abs(a: F) -> F = _mm256_andnot_ps(_mm256_set1_ps(-0.0), a);
        max_abs(a: F, b: F) -> F =
            _mm256_max_ps(_mm256_andnot_ps(_mm256_set1_ps(-0.0), a), _mm256_andnot_ps(_mm256_set1_ps(-0.0), b));
        lt(a: F, b: F) -> M = _mm256_castps_si256(_mm256_cmp_ps::<_CMP_LT_OQ>(a, b));
        le(a: F, b: F) -> M = _mm256_castps_si256(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b));
        select(m: M, a: F, b: F) -> F = _mm256_blendv_ps(b, a, _mm256_castsi256_ps(m));
        add_u(a: U, b: U) -> U = _mm256_add_epi32(a, b);
        add_where(a: U, m: M, b: U) -> U = _mm256_add_epi32(a, _mm256_and_si256(m, b));
        and_u(a: U, b: U) -> U = _mm256_and_si256(a, b);
        or_u(a: U, b: U) -> U = _mm256_or_si256(a, b);
        xor_u(a: U, b: U) -> U = _mm256_xor_si256(a, b);
        eq_u(a: U, b: U) -> M = _mm256_cmpeq_epi32(a, b);
        // a < b unless max(a, b) is a.
        lt_u(a: U, b: U) -> M =
            _mm256_xor_si256(_mm256_cmpeq_epi32(_mm256_max_epu32(a, b), a), _mm256_set1_epi32(-1));
        select_u(m: M, a: U, b: U) -> U = _mm256_blendv_epi8(b, a, m);
        bits(a: F) -> U = _mm256_castps_si256(a);
        floats(a: U) -> F = _mm256_castsi256_ps(a);
        and(a: M, b: M) -> M = _mm256_and_si256(a, b);
        or(a: M, b: M) -> M = _mm256_or_si256(a, b);
        and_not(a: M, b: M) -> M = _mm256_andnot_si256(b, a);
    }
    #[inline(always)]
    fn splat(self, x: f32) -> F {
        // SAFETY: registers only.
        [unsafe { _mm256_set1_ps(x) }; 2]
    }
    #[inline(always)]
    fn splat_u(self, x: u32) -> U {
        // SAFETY: registers only.
        [unsafe { _mm256_set1_epi32(x as i32) }; 2]
    }
    #[inline(always)]
    fn load(self, from: &[f32; LANES]) -> F {
        let [low, high] = split(from);
        // SAFETY: eight readable floats each; unaligned loads.
        unsafe { [_mm256_loadu_ps(low), _mm256_loadu_ps(high)] }
    }
    #[inline(always)]
    fn store(self, a: F, to: &mut [f32; LANES]) {
        let [low, high] = split_mut(to);
        // SAFETY: eight writable floats each; unaligned stores.
        unsafe {
            _mm256_storeu_ps(low, a[0]);
            _mm256_storeu_ps(high, a[1]);
        }
    }
    #[inline(always)]
    fn load_u(self, from: &[u32; LANES]) -> U {
        let [low, high] = split(from);
        // SAFETY: as `load`.
        unsafe { [_mm256_loadu_si256(low.cast()), _mm256_loadu_si256(high.cast())] }
    }
    #[inline(always)]
    fn load_bytes(self, from: &[u8; LANES]) -> U {
        let [low, high] = split(from);
        // SAFETY: eight readable bytes each; unaligned loads.
        unsafe {
            [
                _mm256_cvtepu8_epi32(_mm_loadl_epi64(low.cast())),
                _mm256_cvtepu8_epi32(_mm_loadl_epi64(high.cast())),
            ]
        }
    }
    #[inline(always)]
    fn store_u(self, a: U, to: &mut [u32; LANES]) {
        let [low, high] = split_mut(to);
        // SAFETY: as `store`.
        unsafe {
            _mm256_storeu_si256(low.cast(), a[0]);
            _mm256_storeu_si256(high.cast(), a[1]);
        }
    }
    #[inline(always)]
    fn shl_u<const K: u32>(self, a: U) -> U {
        // SAFETY: registers only.
        unsafe {
            // The count is passed in a register, because an immediate would have to be an i32
            // constant.
            let count = _mm_cvtsi32_si128(K as i32);
            [_mm256_sll_epi32(a[0], count), _mm256_sll_epi32(a[1], count)]
        }
    }
    #[inline(always)]
    fn mask(self, bits: u32) -> M {
        // SAFETY: registers only.
        unsafe {
            let test =
                |bit: __m256i| _mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(bits as i32), bit), bit);
            [
                test(_mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128)),
                test(_mm256_setr_epi32(1 << 8, 2 << 8, 4 << 8, 8 << 8, 16 << 8, 32 << 8, 64 << 8, 128 << 8)),
            ]
        }
    }
    #[inline(always)]
    fn mask_bits(self, m: M) -> u32 {
        // SAFETY: registers only.
        let (low, high) = unsafe {
            (
                _mm256_movemask_ps(_mm256_castsi256_ps(m[0])) as u32,
                _mm256_movemask_ps(_mm256_castsi256_ps(m[1])) as u32,
            )
        };
        low | high << 8
    }
}

impl Simd for Avx2 {
    one_piece!();
    avx_doubles!();

    // With two registers for each vector, these parts are long, and calls take no measurable time.
    const INLINES_SHARED_PARTS: bool = false;

    #[inline(always)]
    fn lookup(self, table: F, at: U) -> F {
        [self.lookup_half(table, at[0]), self.lookup_half(table, at[1])]
    }
    #[inline(always)]
    fn lookup_u(self, table: U, at: U) -> U {
        self.bits(self.lookup(self.floats(table), at))
    }
    #[inline(always)]
    fn least(self, a: F) -> f32 {
        // SAFETY: registers only.
        unsafe {
            let m = _mm256_min_ps(a[0], a[1]);
            let m = _mm_min_ps(_mm256_castps256_ps128(m), _mm256_extractf128_ps::<1>(m));
            let m = _mm_min_ps(m, _mm_movehl_ps(m, m));
            _mm_cvtss_f32(_mm_min_ss(m, _mm_shuffle_ps::<1>(m, m)))
        }
    }
    #[inline(always)]
    fn rows4(self, m: M, from: &[[f32; 4]], row: U) -> [F; 4] {
        let row = valid_indices(self, m, row, from.len());
        // SAFETY: `valid_indices` returns indices of rows of the slice; unaligned loads.
        unsafe {
            macro_rules! halves {
                ($a:literal $b:literal) => {
                    _mm256_insertf128_ps::<1>(
                        _mm256_castps128_ps256(_mm_loadu_ps(from.as_ptr().add(row[$a] as usize).cast())),
                        _mm_loadu_ps(from.as_ptr().add(row[$b] as usize).cast()),
                    )
                };
            }
            let low = transpose4([halves!(0 4), halves!(1 5), halves!(2 6), halves!(3 7)]);
            let high = transpose4([halves!(8 12), halves!(9 13), halves!(10 14), halves!(11 15)]);
            [[low[0], high[0]], [low[1], high[1]], [low[2], high[2]], [low[3], high[3]]]
        }
    }
    #[inline(always)]
    fn rows8(self, m: M, from: &[[u32; 8]], row: U) -> [U; 8] {
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
    fn gather_u(self, m: M, from: &[u32], at: U) -> U {
        assert_indices(self, m, at, from.len());
        // SAFETY: the indices of set lanes lie in the slice and are not negative as i32; clear
        // lanes are not accessed.
        unsafe {
            let (zero, from) = (_mm256_setzero_si256(), from.as_ptr().cast());
            [
                _mm256_mask_i32gather_epi32::<4>(zero, from, at[0], m[0]),
                _mm256_mask_i32gather_epi32::<4>(zero, from, at[1], m[1]),
            ]
        }
    }
    #[inline(always)]
    fn gather_pair(self, m: M, from: &[[u32; 2]], at: U) -> (U, U) {
        let flat = from.as_flattened();
        let even = self.shl_u::<1>(at);
        let odd = self.or_u(even, self.splat_u(1));
        // The indices themselves are checked, because an index that is too great might wrap into
        // the range when it is doubled.
        assert_indices(self, m, at, from.len());
        (self.gather_u(m, flat, even), self.gather_u(m, flat, odd))
    }
    #[inline(always)]
    fn expand(self, a: F, m: M, from: &[f32; LANES]) -> F {
        let bits = self.mask_bits(m);
        let low = from.as_ptr();
        // The elements of the high half follow the elements of the low half, at most eight.
        let high = from[(bits as u8).count_ones() as usize..][..8].as_ptr();
        // SAFETY: eight readable floats each; unaligned loads.
        unsafe {
            let (low, high) = (_mm256_loadu_ps(low), _mm256_loadu_ps(high));
            let low = _mm256_permutevar8x32_ps(low, expansion(bits as u8));
            let high = _mm256_permutevar8x32_ps(high, expansion((bits >> 8) as u8));
            self.select(m, [low, high], a)
        }
    }
    #[inline(always)]
    fn expand_u(self, a: U, m: M, from: &[u32; LANES]) -> U {
        self.bits(self.expand(self.floats(a), m, &from.map(f32::from_bits)))
    }
    #[inline(always)]
    fn compress(self, bits: u32, a: U, to: &mut [u32; LANES]) -> usize {
        let mut floats = [0.0; LANES];
        let count = self.compress_f(bits, self.floats(a), &mut floats);
        self.store_u(self.bits(self.load(&floats)), to);
        count
    }
    #[inline(always)]
    fn compress_f(self, bits: u32, a: F, to: &mut [f32; LANES]) -> usize {
        let low = (bits as u8).count_ones() as usize;
        // SAFETY: the first store writes to[..8]. The second writes eight elements after the
        // compressed lanes of the low half, at most eight. The slices check both.
        unsafe {
            let packed = [
                _mm256_permutevar8x32_ps(a[0], compression(bits as u8)),
                _mm256_permutevar8x32_ps(a[1], compression((bits >> 8) as u8)),
            ];
            _mm256_storeu_ps(to[..8].as_mut_ptr(), packed[0]);
            _mm256_storeu_ps(to[low..][..8].as_mut_ptr(), packed[1]);
        }
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
        let (key, a) = self.to_arrays(key, a);
        scalar::compress_far_to_near(bits, &key, &a, to, keys)
    }
    #[inline(always)]
    fn keep_up_to(self, codes: &mut [u32], keys: &mut [f32], limit: f32) -> usize {
        scalar::keep_up_to(codes, keys, limit)
    }
    #[inline(always)]
    fn transpose(self, rows: [F; LANES]) -> [F; LANES] {
        let mut out = rows;
        for half in 0..2 {
            for side in 0..2 {
                let mut block = [rows[0][0]; 8];
                for i in 0..8 {
                    block[i] = rows[8 * half + i][side];
                }
                // SAFETY: registers only.
                let block = unsafe { transpose8(block) };
                for i in 0..8 {
                    out[8 * side + i][half] = block[i];
                }
            }
        }
        out
    }
}
