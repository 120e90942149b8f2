//! Four lanes in a vector of WebAssembly's SIMD128.
//!
//! A module is compiled for these instructions as a whole, so they may be executed wherever it was
//! loaded. The comments at the blocks prove the accesses through pointers.
#![allow(unsafe_code)]

use super::{LANES, QUAD, QUADS, Quad, Quads};
use crate::simd::{Kernel, Part};
use std::arch::wasm32::*;

/// The token of SIMD128.
#[derive(Clone, Copy, Debug)]
pub(in crate::simd) struct Simd128(());

impl Simd128 {
    #[inline(always)]
    pub(in crate::simd) fn new() -> Self {
        Simd128(())
    }

    /// Runs a kernel. Not inlined, as the kernels of other instruction sets.
    #[inline(never)]
    pub(in crate::simd) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        kernel.run(Quads(self))
    }
}

#[inline(never)]
fn part_entry<P: Part<Quads<Simd128>>>(simd: Quads<Simd128>, part: P) -> P::Output {
    part.run(simd)
}

/// Methods of vectors alone.
macro_rules! vectors {
    ($($name:ident($($arg:ident: $of:ty),*) -> $out:ty = $do:expr;)*) => { $(
        #[inline(always)]
        fn $name(self, $($arg: $of),*) -> $out {
            $do
        }
    )* };
}

impl Quad for Simd128 {
    type F = v128;
    type U = v128;

    #[inline(always)]
    fn call<P: Part<Quads<Self>>>(simd: Quads<Self>, part: P) -> P::Output {
        part_entry(simd, part)
    }

    vectors! {
        splat(x: f32) -> v128 = f32x4_splat(x);
        add(a: v128, b: v128) -> v128 = f32x4_add(a, b);
        sub(a: v128, b: v128) -> v128 = f32x4_sub(a, b);
        mul(a: v128, b: v128) -> v128 = f32x4_mul(a, b);
        div(a: v128, b: v128) -> v128 = f32x4_div(a, b);
        fma(a: v128, b: v128, c: v128) -> v128 = f32x4_add(f32x4_mul(a, b), c);
        fnma(a: v128, b: v128, c: v128) -> v128 = f32x4_sub(c, f32x4_mul(a, b));
        // The pseudo-minimum is its first operand unless the second is less: the operands are
        // exchanged.
        min(a: v128, b: v128) -> v128 = f32x4_pmin(b, a);
        max(a: v128, b: v128) -> v128 = f32x4_pmax(b, a);
        abs(a: v128) -> v128 = f32x4_abs(a);
        lt(a: v128, b: v128) -> v128 = f32x4_lt(a, b);
        le(a: v128, b: v128) -> v128 = f32x4_le(a, b);
        select(m: v128, a: v128, b: v128) -> v128 = v128_bitselect(a, b, m);
        least(a: v128) -> f32 = {
            let a = f32x4_pmin(a, i32x4_shuffle::<2, 3, 0, 1>(a, a));
            f32x4_extract_lane::<0>(f32x4_pmin(a, i32x4_shuffle::<1, 0, 3, 2>(a, a)))
        };
        transpose(rows: [v128; QUAD]) -> [v128; QUAD] = {
            let [a, b, c, d] = rows;
            let (low, low_2) = (i32x4_shuffle::<0, 4, 1, 5>(a, b), i32x4_shuffle::<0, 4, 1, 5>(c, d));
            let (high, high_2) = (i32x4_shuffle::<2, 6, 3, 7>(a, b), i32x4_shuffle::<2, 6, 3, 7>(c, d));
            [
                i64x2_shuffle::<0, 2>(low, low_2),
                i64x2_shuffle::<1, 3>(low, low_2),
                i64x2_shuffle::<0, 2>(high, high_2),
                i64x2_shuffle::<1, 3>(high, high_2),
            ]
        };
        splat_u(x: u32) -> v128 = u32x4_splat(x);
        load_bytes(from: &[u8; QUAD]) -> v128 =
            u32x4_extend_low_u16x8(u16x8_extend_low_u8x16(u32x4_splat(u32::from_le_bytes(*from))));
        add_u(a: v128, b: v128) -> v128 = u32x4_add(a, b);
        and_u(a: v128, b: v128) -> v128 = v128_and(a, b);
        or_u(a: v128, b: v128) -> v128 = v128_or(a, b);
        xor_u(a: v128, b: v128) -> v128 = v128_xor(a, b);
        and_not(a: v128, b: v128) -> v128 = v128_andnot(a, b);
        eq_u(a: v128, b: v128) -> v128 = u32x4_eq(a, b);
        lt_u(a: v128, b: v128) -> v128 = u32x4_lt(a, b);
        bits(a: v128) -> v128 = a;
        floats(a: v128) -> v128 = a;
        mask_bits(m: v128) -> u32 = u32::from(i32x4_bitmask(m));
        // Masks keep their value when signed words and halves are saturated.
        mask_bits_of_all(m: [v128; QUADS]) -> u32 = {
            let halves = [i16x8_narrow_i32x4(m[0], m[1]), i16x8_narrow_i32x4(m[2], m[3])];
            u32::from(i8x16_bitmask(i8x16_narrow_i16x8(halves[0], halves[1])))
        };
    }

    #[inline(always)]
    fn shl_u<const K: u32>(self, a: v128) -> v128 {
        u32x4_shl(a, K)
    }
    #[inline(always)]
    fn load(self, from: &[f32; QUAD]) -> v128 {
        // SAFETY: four readable floats; unaligned load.
        unsafe { v128_load(from.as_ptr().cast()) }
    }
    #[inline(always)]
    fn store(self, a: v128, to: &mut [f32; QUAD]) {
        // SAFETY: four writable floats; unaligned store.
        unsafe { v128_store(to.as_mut_ptr().cast(), a) }
    }
    #[inline(always)]
    fn load_u(self, from: &[u32; QUAD]) -> v128 {
        // SAFETY: four readable words; unaligned load.
        unsafe { v128_load(from.as_ptr().cast()) }
    }
    #[inline(always)]
    fn store_u(self, a: v128, to: &mut [u32; QUAD]) {
        // SAFETY: four writable words; unaligned store.
        unsafe { v128_store(to.as_mut_ptr().cast(), a) }
    }
    #[inline(always)]
    fn bytes(self, a: v128, at: &[u8; LANES]) -> v128 {
        // SAFETY: sixteen readable bytes; unaligned load.
        i8x16_swizzle(a, unsafe { v128_load(at.as_ptr().cast()) })
    }
    #[inline(always)]
    fn prefetch<T>(self, _address: *const T) {}
}
