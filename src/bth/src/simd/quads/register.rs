//! One of the four registers of a vector, used as a [piece](super::super::Simd::Piece).

use super::{LANES, QUAD, QUADS, Quad, lane_operations, split, split_mut};
use crate::simd::Lanewise;

/// The token of an instruction set, for the four lanes from `4 * index` on.
#[derive(Clone, Copy, Debug)]
pub(in crate::simd) struct Register<Q> {
    pub(super) quad: Q,
    pub(super) index: usize,
}

/// A bit for each lane of a register.
const LANE_BITS: [u32; QUAD] = [1, 2, 4, 8];

/// Methods that apply the operation of the same name.
macro_rules! operations {
    ($($name:ident($($arg:ident: $of:ident),*) -> $out:ident;)*) => { $(
        #[inline(always)]
        fn $name(self, $($arg: Q::$of),*) -> Q::$out {
            self.quad.$name($($arg),*)
        }
    )* };
}

impl<Q: Quad> Lanewise for Register<Q> {
    type F = Q::F;
    type U = Q::U;
    type M = Q::U;

    lane_operations!(operations);

    #[inline(always)]
    fn splat(self, x: f32) -> Q::F {
        self.quad.splat(x)
    }
    #[inline(always)]
    fn load(self, from: &[f32; LANES]) -> Q::F {
        self.quad.load(&split(from)[self.index % QUADS])
    }
    #[inline(always)]
    fn store(self, a: Q::F, to: &mut [f32; LANES]) {
        self.quad.store(a, &mut split_mut(to)[self.index % QUADS]);
    }
    #[inline(always)]
    fn max_abs(self, a: Q::F, b: Q::F) -> Q::F {
        self.max(self.abs(a), self.abs(b))
    }
    #[inline(always)]
    fn splat_u(self, x: u32) -> Q::U {
        self.quad.splat_u(x)
    }
    #[inline(always)]
    fn load_u(self, from: &[u32; LANES]) -> Q::U {
        self.quad.load_u(&split(from)[self.index % QUADS])
    }
    #[inline(always)]
    fn load_bytes(self, from: &[u8; LANES]) -> Q::U {
        self.quad.load_bytes(&split(from)[self.index % QUADS])
    }
    #[inline(always)]
    fn store_rows(self, [x, y, z]: [Q::F; 3], rows: &mut [[f32; 4]; LANES]) {
        let rows = &mut split_mut(rows)[self.index % QUADS];
        let block = self.quad.transpose([x, y, z, z]);
        for j in 0..QUAD {
            self.quad.store(block[j], &mut rows[j]);
        }
    }
    #[inline(always)]
    fn lookup_rows(self, rows: &[[f32; 4]; LANES], at: &[u8; LANES]) -> [Q::F; 3] {
        let at = &split(at)[self.index % QUADS];
        let mut block = [self.splat(0.0); QUAD];
        for j in 0..QUAD {
            block[j] = self.quad.load(&rows[usize::from(at[j]) % LANES]);
        }
        let [x, y, z, _] = self.quad.transpose(block);
        [x, y, z]
    }
    #[inline(always)]
    fn store_u(self, a: Q::U, to: &mut [u32; LANES]) {
        self.quad.store_u(a, &mut split_mut(to)[self.index % QUADS]);
    }
    #[inline(always)]
    fn add_where(self, a: Q::U, m: Q::U, b: Q::U) -> Q::U {
        self.add_u(a, self.and_u(m, b))
    }
    #[inline(always)]
    fn shl_u<const K: u32>(self, a: Q::U) -> Q::U {
        self.quad.shl_u::<K>(a)
    }
    #[inline(always)]
    fn select_u(self, m: Q::U, a: Q::U, b: Q::U) -> Q::U {
        self.bits(self.select(m, self.floats(a), self.floats(b)))
    }

    #[inline(always)]
    fn mask(self, bits: u32) -> Q::U {
        let lane = self.quad.load_u(&LANE_BITS);
        self.eq_u(self.and_u(self.splat_u(bits >> (QUAD * self.index)), lane), lane)
    }
    #[inline(always)]
    fn mask_bits(self, m: Q::U) -> u32 {
        self.quad.mask_bits(m) << (QUAD * self.index)
    }
    #[inline(always)]
    fn and(self, a: Q::U, b: Q::U) -> Q::U {
        self.and_u(a, b)
    }
    #[inline(always)]
    fn or(self, a: Q::U, b: Q::U) -> Q::U {
        self.or_u(a, b)
    }
}
