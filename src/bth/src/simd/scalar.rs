//! Sixteen lanes in plain arrays: for machines without vector code, and what the others are tested against.

use super::{LANES, Simd};
use std::array::from_fn;

/// Plain code.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scalar;

type F = [f32; LANES];
type U = [u32; LANES];

#[inline(always)]
fn compare(mut test: impl FnMut(usize) -> bool) -> u32 {
    let mut bits = 0;
    for i in 0..LANES {
        bits |= u32::from(test(i)) << i;
    }
    bits
}

#[inline(always)]
fn set(bits: u32, lane: usize) -> bool {
    bits >> lane & 1 != 0
}

/// The lanes that are set.
#[inline(always)]
pub(super) fn lanes(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = bits.trailing_zeros() as usize;
        bits &= bits.wrapping_sub(1);
        (lane < LANES).then_some(lane)
    })
}

#[inline(always)]
fn expand<T: Copy>(a: [T; LANES], bits: u32, from: &[T; LANES]) -> [T; LANES] {
    let mut out = a;
    for (next, lane) in lanes(bits).enumerate() {
        out[lane] = from[next];
    }
    out
}

#[inline(always)]
fn compress<T: Copy>(bits: u32, a: &[T; LANES], to: &mut [T; LANES]) -> usize {
    let mut count = 0;
    for lane in lanes(bits) {
        to[count % LANES] = a[lane];
        count += 1;
    }
    count
}

/// [`Simd::compress_far_to_near`] in plain code: an insertion sort of at most sixteen, usually two or three.
#[inline(always)]
pub(super) fn compress_far_to_near(bits: u32, key: &F, a: &U, to: &mut U, keys: &mut F) -> usize {
    let mut count = 0;
    for lane in lanes(bits) {
        // The lane goes into the lowest bits of its key; as integers, because that makes NaN of an infinity.
        let key = key[lane].to_bits() & !15 | lane as u32;
        let mut at = count % LANES;
        while at > 0 && (keys[at - 1].to_bits() as i32) < key as i32 {
            (keys[at], to[at]) = (keys[at - 1], to[at - 1]);
            at -= 1;
        }
        (keys[at], to[at]) = (f32::from_bits(key), a[lane]);
        count += 1;
    }
    count
}

/// [`Simd::transpose`] in plain code.
#[inline(always)]
pub(super) fn transpose(rows: [F; LANES]) -> [F; LANES] {
    let mut out = [[0.0; LANES]; LANES];
    for (i, row) in rows.iter().enumerate() {
        for lane in 0..LANES {
            out[lane][i] = row[lane];
        }
    }
    out
}

/// [`Simd::keep_up_to`] in plain code.
#[inline(always)]
pub(super) fn keep_up_to(codes: &mut [u32], keys: &mut [f32], limit: f32) -> usize {
    let mut kept = 0;
    for i in 0..codes.len().min(keys.len()) {
        (codes[kept], keys[kept]) = (codes[i], keys[i]);
        kept += usize::from(keys[i] <= limit);
    }
    kept
}

/// Rows by their columns.
#[inline(always)]
fn columns<T: Copy + Default, const N: usize>(m: u32, from: &[[T; N]], row: U) -> [[T; LANES]; N] {
    let mut out = [[T::default(); LANES]; N];
    for i in 0..LANES {
        if set(m, i) {
            let row = &from[row[i] as usize];
            for k in 0..N {
                out[k][i] = row[k];
            }
        }
    }
    out
}

impl Simd for Scalar {
    type F = F;
    type U = U;
    type M = u32;

    #[inline(always)]
    fn splat(self, x: f32) -> F {
        [x; LANES]
    }
    #[inline(always)]
    fn load(self, from: &F) -> F {
        *from
    }
    #[inline(always)]
    fn store(self, a: F, to: &mut F) {
        *to = a;
    }
    #[inline(always)]
    fn add(self, a: F, b: F) -> F {
        from_fn(|i| a[i] + b[i])
    }
    #[inline(always)]
    fn sub(self, a: F, b: F) -> F {
        from_fn(|i| a[i] - b[i])
    }
    #[inline(always)]
    fn mul(self, a: F, b: F) -> F {
        from_fn(|i| a[i] * b[i])
    }
    #[inline(always)]
    fn div(self, a: F, b: F) -> F {
        from_fn(|i| a[i] / b[i])
    }
    #[inline(always)]
    fn fma(self, a: F, b: F, c: F) -> F {
        from_fn(|i| a[i] * b[i] + c[i])
    }
    #[inline(always)]
    fn fnma(self, a: F, b: F, c: F) -> F {
        from_fn(|i| c[i] - a[i] * b[i])
    }
    #[inline(always)]
    fn min(self, a: F, b: F) -> F {
        from_fn(|i| if a[i] < b[i] { a[i] } else { b[i] })
    }
    #[inline(always)]
    fn max(self, a: F, b: F) -> F {
        from_fn(|i| if a[i] > b[i] { a[i] } else { b[i] })
    }
    #[inline(always)]
    fn abs(self, a: F) -> F {
        a.map(f32::abs)
    }
    #[inline(always)]
    fn max_abs(self, a: F, b: F) -> F {
        self.max(self.abs(a), self.abs(b))
    }
    #[inline(always)]
    fn lt(self, a: F, b: F) -> u32 {
        compare(|i| a[i] < b[i])
    }
    #[inline(always)]
    fn le(self, a: F, b: F) -> u32 {
        compare(|i| a[i] <= b[i])
    }
    #[inline(always)]
    fn select(self, m: u32, a: F, b: F) -> F {
        from_fn(|i| if set(m, i) { a[i] } else { b[i] })
    }
    #[inline(always)]
    fn lookup(self, table: F, at: U) -> F {
        at.map(|i| table[i as usize % LANES])
    }
    #[inline(always)]
    fn least(self, a: F) -> f32 {
        a.into_iter().fold(f32::INFINITY, |m, x| if x < m { x } else { m })
    }
    #[inline(always)]
    fn rows4(self, m: u32, from: &[[f32; 4]], row: U) -> [F; 4] {
        columns(m, from, row)
    }
    #[inline(always)]
    fn rows8(self, m: u32, from: &[[u32; 8]], row: U) -> [U; 8] {
        columns(m, from, row)
    }
    #[inline(always)]
    fn columns8(self, rows: &[[u32; 8]; LANES]) -> [U; 8] {
        from_fn(|k| from_fn(|i| rows[i][k]))
    }
    #[inline(always)]
    fn expand(self, a: F, m: u32, from: &F) -> F {
        expand(a, m, from)
    }

    #[inline(always)]
    fn splat_u(self, x: u32) -> U {
        [x; LANES]
    }
    #[inline(always)]
    fn load_u(self, from: &U) -> U {
        *from
    }
    #[inline(always)]
    fn load_bytes(self, from: &[u8; LANES]) -> U {
        from.map(u32::from)
    }
    #[inline(always)]
    fn store_u(self, a: U, to: &mut U) {
        *to = a;
    }
    #[inline(always)]
    fn add_u(self, a: U, b: U) -> U {
        from_fn(|i| a[i].wrapping_add(b[i]))
    }
    #[inline(always)]
    fn add_where(self, a: U, m: u32, b: U) -> U {
        from_fn(|i| if set(m, i) { a[i].wrapping_add(b[i]) } else { a[i] })
    }
    #[inline(always)]
    fn and_u(self, a: U, b: U) -> U {
        from_fn(|i| a[i] & b[i])
    }
    #[inline(always)]
    fn or_u(self, a: U, b: U) -> U {
        from_fn(|i| a[i] | b[i])
    }
    #[inline(always)]
    fn xor_u(self, a: U, b: U) -> U {
        from_fn(|i| a[i] ^ b[i])
    }
    #[inline(always)]
    fn shl_u<const K: u32>(self, a: U) -> U {
        a.map(|x| x << K)
    }
    #[inline(always)]
    fn eq_u(self, a: U, b: U) -> u32 {
        compare(|i| a[i] == b[i])
    }
    #[inline(always)]
    fn lt_u(self, a: U, b: U) -> u32 {
        compare(|i| a[i] < b[i])
    }
    #[inline(always)]
    fn select_u(self, m: u32, a: U, b: U) -> U {
        from_fn(|i| if set(m, i) { a[i] } else { b[i] })
    }
    #[inline(always)]
    fn lookup_u(self, table: U, at: U) -> U {
        at.map(|i| table[i as usize % LANES])
    }
    #[inline(always)]
    fn gather_u(self, m: u32, from: &[u32], at: U) -> U {
        from_fn(|i| if set(m, i) { from[at[i] as usize] } else { 0 })
    }
    #[inline(always)]
    fn gather_pair(self, m: u32, from: &[[u32; 2]], at: U) -> (U, U) {
        let pair: [[u32; 2]; LANES] = from_fn(|i| if set(m, i) { from[at[i] as usize] } else { [0; 2] });
        (pair.map(|p| p[0]), pair.map(|p| p[1]))
    }
    #[inline(always)]
    fn expand_u(self, a: U, m: u32, from: &U) -> U {
        expand(a, m, from)
    }
    #[inline(always)]
    fn bits(self, a: F) -> U {
        a.map(f32::to_bits)
    }
    #[inline(always)]
    fn floats(self, a: U) -> F {
        a.map(f32::from_bits)
    }
    #[inline(always)]
    fn numbers(self, a: U) -> F {
        a.map(|x| x as f32)
    }

    #[inline(always)]
    fn mask(self, bits: u32) -> u32 {
        bits
    }
    #[inline(always)]
    fn mask_bits(self, m: u32) -> u32 {
        m
    }
    #[inline(always)]
    fn and(self, a: u32, b: u32) -> u32 {
        a & b
    }
    #[inline(always)]
    fn or(self, a: u32, b: u32) -> u32 {
        a | b
    }
    #[inline(always)]
    fn and_not(self, a: u32, b: u32) -> u32 {
        a & !b
    }

    #[inline(always)]
    fn compress(self, bits: u32, a: U, to: &mut U) -> usize {
        compress(bits, &a, to)
    }
    #[inline(always)]
    fn compress_f(self, bits: u32, a: F, to: &mut F) -> usize {
        compress(bits, &a, to)
    }
    #[inline(always)]
    fn compress_far_to_near(self, bits: u32, key: F, a: U, to: &mut U, keys: &mut F) -> usize {
        compress_far_to_near(bits, &key, &a, to, keys)
    }
    #[inline(always)]
    fn keep_up_to(self, codes: &mut [u32], keys: &mut [f32], limit: f32) -> usize {
        keep_up_to(codes, keys, limit)
    }
    #[inline(always)]
    fn transpose(self, rows: [F; LANES]) -> [F; LANES] {
        transpose(rows)
    }
    #[inline(always)]
    fn prefetch<T>(self, _place: *const T) {}
}
