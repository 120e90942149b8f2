//! Four lanes in a register of NEON.
//!
//! NEON is part of every AArch64 target that this crate supports, so the intrinsics of all `unsafe`
//! blocks below may be executed. The comments at the blocks prove the accesses through pointers.
#![allow(unsafe_code)]

use super::{LANES, QUAD, QUADS, Quad, Quads};
use crate::simd::{Kernel, Part};
use std::arch::aarch64::*;
use std::arch::asm;

const _: () = assert!(cfg!(target_feature = "neon"), "an AArch64 target without NEON");

/// The token of NEON.
#[derive(Clone, Copy, Debug)]
pub(in crate::simd) struct Neon(());

impl Neon {
    #[inline(always)]
    pub(in crate::simd) fn new() -> Self {
        Neon(())
    }

    /// Runs a kernel. Not inlined, as the kernels of other instruction sets.
    #[inline(never)]
    pub(in crate::simd) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        kernel.run(Quads(self))
    }
}

#[inline(never)]
fn part_entry<P: Part<Quads<Neon>>>(simd: Quads<Neon>, part: P) -> P::Output {
    part.run(simd)
}

type F = float32x4_t;
type U = uint32x4_t;

/// Methods of registers alone.
macro_rules! registers {
    ($($name:ident($($arg:ident: $of:ty),*) -> $out:ty = $do:expr;)*) => { $(
        #[inline(always)]
        fn $name(self, $($arg: $of),*) -> $out {
            // SAFETY: all targets have NEON, and only registers are accessed.
            unsafe { $do }
        }
    )* };
}

impl Quad for Neon {
    type F = F;
    type U = U;

    #[inline(always)]
    fn call<P: Part<Quads<Self>>>(simd: Quads<Self>, part: P) -> P::Output {
        part_entry(simd, part)
    }

    registers! {
        splat(x: f32) -> F = vdupq_n_f32(x);
        add(a: F, b: F) -> F = vaddq_f32(a, b);
        sub(a: F, b: F) -> F = vsubq_f32(a, b);
        mul(a: F, b: F) -> F = vmulq_f32(a, b);
        div(a: F, b: F) -> F = vdivq_f32(a, b);
        fma(a: F, b: F, c: F) -> F = vfmaq_f32(c, a, b);
        fnma(a: F, b: F, c: F) -> F = vfmsq_f32(c, a, b);
        // The minimum and maximum of NEON are NaN where either operand is, or the other operand:
        // here it is `b`.
        min(a: F, b: F) -> F = vbslq_f32(vcltq_f32(a, b), a, b);
        max(a: F, b: F) -> F = vbslq_f32(vcgtq_f32(a, b), a, b);
        abs(a: F) -> F = vabsq_f32(a);
        lt(a: F, b: F) -> U = vcltq_f32(a, b);
        le(a: F, b: F) -> U = vcleq_f32(a, b);
        select(m: U, a: F, b: F) -> F = vbslq_f32(m, a, b);
        least(a: F) -> f32 = vminvq_f32(a);
        transpose(rows: [F; QUAD]) -> [F; QUAD] = {
            let [a, b, c, d] = rows;
            let (low, low_2) = (vzip1q_f32(a, c), vzip1q_f32(b, d));
            let (high, high_2) = (vzip2q_f32(a, c), vzip2q_f32(b, d));
            [vzip1q_f32(low, low_2), vzip2q_f32(low, low_2), vzip1q_f32(high, high_2), vzip2q_f32(high, high_2)]
        };
        splat_u(x: u32) -> U = vdupq_n_u32(x);
        add_u(a: U, b: U) -> U = vaddq_u32(a, b);
        and_u(a: U, b: U) -> U = vandq_u32(a, b);
        or_u(a: U, b: U) -> U = vorrq_u32(a, b);
        xor_u(a: U, b: U) -> U = veorq_u32(a, b);
        and_not(a: U, b: U) -> U = vbicq_u32(a, b);
        eq_u(a: U, b: U) -> U = vceqq_u32(a, b);
        lt_u(a: U, b: U) -> U = vcltq_u32(a, b);
        bits(a: F) -> U = vreinterpretq_u32_f32(a);
        floats(a: U) -> F = vreinterpretq_f32_u32(a);
        mask_bits(m: U) -> u32 = vaddvq_u32(vandq_u32(m, vcombine_u32(vcreate_u32(2 << 32 | 1), vcreate_u32(8 << 32 | 4))));
        // The masks are narrowed to bytes, and each byte keeps one bit. Neighbouring bytes are then
        // added until two remain.
        mask_bits_of_all(m: [U; QUADS]) -> u32 = {
            let low = vuzp1q_u16(vreinterpretq_u16_u32(m[0]), vreinterpretq_u16_u32(m[1]));
            let high = vuzp1q_u16(vreinterpretq_u16_u32(m[2]), vreinterpretq_u16_u32(m[3]));
            let bytes = vuzp1q_u8(vreinterpretq_u8_u16(low), vreinterpretq_u8_u16(high));
            let bits = vandq_u8(bytes, vreinterpretq_u8_u64(vdupq_n_u64(0x8040_2010_0804_0201)));
            let sums = vpaddq_u8(bits, bits);
            let sums = vpaddq_u8(sums, sums);
            let sums = vpaddq_u8(sums, sums);
            u32::from(vgetq_lane_u16::<0>(vreinterpretq_u16_u8(sums)))
        };
    }

    #[inline(always)]
    fn load(self, from: &[f32; QUAD]) -> F {
        // SAFETY: four readable floats.
        unsafe { vld1q_f32(from.as_ptr()) }
    }
    #[inline(always)]
    fn store(self, a: F, to: &mut [f32; QUAD]) {
        // SAFETY: four writable floats.
        unsafe { vst1q_f32(to.as_mut_ptr(), a) }
    }
    #[inline(always)]
    fn load_u(self, from: &[u32; QUAD]) -> U {
        // SAFETY: four readable words.
        unsafe { vld1q_u32(from.as_ptr()) }
    }
    #[inline(always)]
    fn store_u(self, a: U, to: &mut [u32; QUAD]) {
        // SAFETY: four writable words.
        unsafe { vst1q_u32(to.as_mut_ptr(), a) }
    }
    #[inline(always)]
    fn load_bytes(self, from: &[u8; QUAD]) -> U {
        // SAFETY: registers only.
        unsafe { vmovl_u16(vget_low_u16(vmovl_u8(vcreate_u8(u32::from_le_bytes(*from).into())))) }
    }
    #[inline(always)]
    fn shl_u<const K: u32>(self, a: U) -> U {
        // SAFETY: registers only. The count is passed in a register, because an immediate would
        // have to be an i32 constant.
        unsafe { vshlq_u32(a, vdupq_n_s32(K as i32)) }
    }
    #[inline(always)]
    fn bytes(self, a: U, at: &[u8; LANES]) -> U {
        // SAFETY: sixteen readable bytes.
        unsafe { vreinterpretq_u32_u8(vqtbl1q_u8(vreinterpretq_u8_u32(a), vld1q_u8(at.as_ptr()))) }
    }
    #[inline(always)]
    fn prefetch<T>(self, address: *const T) {
        // SAFETY: a hint that never faults, whatever the address, and changes neither memory nor
        // registers.
        unsafe {
            asm!("prfm pldl1keep, [{0}]", in(reg) address, options(nostack, preserves_flags, readonly));
        }
    }
}
