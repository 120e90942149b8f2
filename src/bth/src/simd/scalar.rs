//! Sixteen lanes in arrays: the implementation for machines without vector code, and the oracle of
//! the tests of the others.
//!
//! Each operation is a loop over the lanes, which the compiler vectorizes with the baseline
//! instructions of the target. Kernels that are faster only with vectors are not compiled for it
//! ([`Simd::HAS_VECTORS`]): unrolled, they would be the largest part of the library.

use super::{LANES, Lanewise, Part, Simd, one_piece, plain_doubles};
use std::array::from_fn;

/// The token of scalar code, which runs on every machine.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scalar;

type F = [f32; LANES];
type U = [u32; LANES];
/// All bits of a lane are set, or none.
type M = [u32; LANES];

#[inline(always)]
fn all_bits(test: bool) -> u32 {
    if test { u32::MAX } else { 0 }
}

/// Indices of the set bits, in ascending order.
#[inline(always)]
pub(super) fn lanes(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = bits.trailing_zeros() as usize;
        bits &= bits.wrapping_sub(1);
        (lane < LANES).then_some(lane)
    })
}

#[inline(always)]
fn mask_bits(m: &M) -> u32 {
    let mut bits = 0;
    for i in 0..LANES {
        bits |= m[i] & 1 << i;
    }
    bits
}

#[inline(always)]
fn expand(a: &U, m: &M, from: &U) -> U {
    let mut out = *a;
    for (next, lane) in lanes(mask_bits(m)).enumerate() {
        out[lane] = from[next];
    }
    out
}

#[inline(always)]
fn compress(bits: u32, a: &U, to: &mut U) -> usize {
    let mut count = 0;
    for lane in lanes(bits) {
        to[count % LANES] = a[lane];
        count += 1;
    }
    count
}

/// [`Simd::compress_far_to_near`] in scalar code: an insertion sort of at most sixteen entries,
/// usually two or three.
#[inline(always)]
pub(super) fn compress_far_to_near(bits: u32, key: &F, a: &U, to: &mut U, keys: &mut F) -> usize {
    let mut count = 0;
    for lane in lanes(bits) {
        // The lane is written into the lowest bits of its key. Keys are compared as integers,
        // because an infinity becomes NaN by this.
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

/// [`Simd::transpose`] in scalar code.
#[inline(always)]
fn transpose(rows: &[F; LANES]) -> [F; LANES] {
    let mut out = [[0.0; LANES]; LANES];
    for (i, row) in rows.iter().enumerate() {
        for lane in 0..LANES {
            out[lane][i] = row[lane];
        }
    }
    out
}

/// [`Simd::keep_up_to`] in scalar code.
#[inline(always)]
pub(super) fn keep_up_to(codes: &mut [u32], keys: &mut [f32], limit: f32) -> usize {
    let mut kept = 0;
    for i in 0..codes.len().min(keys.len()) {
        (codes[kept], keys[kept]) = (codes[i], keys[i]);
        kept += usize::from(keys[i] <= limit);
    }
    kept
}

/// [`Simd::rows4`] and [`Simd::rows8`].
#[inline(always)]
fn columns<T: Copy + Default, const N: usize>(m: &M, from: &[[T; N]], row: &U) -> [[T; LANES]; N] {
    let mut out = [[T::default(); LANES]; N];
    for i in 0..LANES {
        if m[i] != 0 {
            let row = &from[row[i] as usize];
            for k in 0..N {
                out[k][i] = row[k];
            }
        }
    }
    out
}

#[inline(always)]
fn gather(m: &M, from: &[u32], at: &U) -> U {
    from_fn(|i| if m[i] != 0 { from[at[i] as usize] } else { 0 })
}

#[inline(always)]
fn gather_pair(m: &M, from: &[[u32; 2]], at: &U) -> (U, U) {
    let pair: [[u32; 2]; LANES] = from_fn(|i| if m[i] != 0 { from[at[i] as usize] } else { [0; 2] });
    (pair.map(|p| p[0]), pair.map(|p| p[1]))
}

/// Defines methods of whole vectors, each a loop over the lanes.
macro_rules! loops {
    ($($name:ident($($arg:ident: $of:ty),*) -> $out:ty = $lane:expr;)*) => { $(
        #[inline(always)]
        fn $name(self, $($arg: $of),*) -> $out {
            from_fn(|i| {
                $(let $arg = $arg[i];)*
                $lane
            })
        }
    )* };
}

#[inline(always)]
fn lookup(table: &U, at: &U) -> U {
    from_fn(|i| table[at[i] as usize % LANES])
}

#[inline(always)]
fn words(a: F) -> U {
    zerocopy::transmute!(a)
}

#[inline(always)]
fn floats(a: U) -> F {
    zerocopy::transmute!(a)
}

/// [`Simd::greatest_of_three`].
#[inline(always)]
pub(super) fn greatest_of_three(a: [f32; 4]) -> [f32; 4] {
    let [x, y, z, _] = a.map(f32::to_bits);
    [f32::from_bits(x.max(y).max(z)); 4]
}

impl Lanewise for Scalar {
    type F = F;
    type U = U;
    type M = M;
    loops! {
        add(a: F, b: F) -> F = a + b;
        sub(a: F, b: F) -> F = a - b;
        mul(a: F, b: F) -> F = a * b;
        div(a: F, b: F) -> F = a / b;
        fma(a: F, b: F, c: F) -> F = a * b + c;
        fnma(a: F, b: F, c: F) -> F = c - a * b;
        min(a: F, b: F) -> F = if a < b { a } else { b };
        max(a: F, b: F) -> F = if a > b { a } else { b };
        abs(a: F) -> F = a.abs();
        max_abs(a: F, b: F) -> F = if a.abs() > b.abs() { a.abs() } else { b.abs() };
        lt(a: F, b: F) -> M = all_bits(a < b);
        le(a: F, b: F) -> M = all_bits(a <= b);
        select_u(m: M, a: U, b: U) -> U = a & m | b & !m;
        add_u(a: U, b: U) -> U = a.wrapping_add(b);
        add_where(a: U, m: M, b: U) -> U = a.wrapping_add(b & m);
        and_u(a: U, b: U) -> U = a & b;
        or_u(a: U, b: U) -> U = a | b;
        xor_u(a: U, b: U) -> U = a ^ b;
        eq_u(a: U, b: U) -> M = all_bits(a == b);
        lt_u(a: U, b: U) -> M = all_bits(a < b);
        and(a: M, b: M) -> M = a & b;
        or(a: M, b: M) -> M = a | b;
        and_not(a: M, b: M) -> M = a & !b;
    }
    #[inline(always)]
    fn mask_bits(self, m: M) -> u32 {
        mask_bits(&m)
    }
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
    fn select(self, m: M, a: F, b: F) -> F {
        floats(self.select_u(m, words(a), words(b)))
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
    fn shl_u<const K: u32>(self, a: U) -> U {
        from_fn(|i| a[i] << K)
    }
    #[inline(always)]
    fn bits(self, a: F) -> U {
        words(a)
    }
    #[inline(always)]
    fn floats(self, a: U) -> F {
        floats(a)
    }
    #[inline(always)]
    fn mask(self, bits: u32) -> M {
        from_fn(|i| all_bits(bits >> i & 1 != 0))
    }
}

impl Simd for Scalar {
    one_piece!();
    plain_doubles!();

    const HAS_VECTORS: bool = false;
    const INLINES_PARTS: bool = false;

    #[inline(always)]
    fn least(self, a: F) -> f32 {
        a.iter().fold(f32::INFINITY, |m, &x| if x < m { x } else { m })
    }
    #[inline(never)]
    fn call<P: Part<Self>>(self, part: P) -> P::Output {
        part.run(self)
    }
    #[inline(always)]
    fn lookup(self, table: F, at: U) -> F {
        floats(lookup(&words(table), &at))
    }
    #[inline(always)]
    fn rows4(self, m: M, from: &[[f32; 4]], row: U) -> [F; 4] {
        columns(&m, from, &row)
    }
    #[inline(always)]
    fn rows8(self, m: M, from: &[[u32; 8]], row: U) -> [U; 8] {
        columns(&m, from, &row)
    }
    #[inline(always)]
    fn columns8(self, rows: &[[u32; 8]; LANES]) -> [U; 8] {
        from_fn(|k| from_fn(|i| rows[i][k]))
    }
    #[inline(always)]
    fn expand(self, a: F, m: M, from: &F) -> F {
        floats(expand(&words(a), &m, &words(*from)))
    }
    #[inline(always)]
    fn lookup_u(self, table: U, at: U) -> U {
        lookup(&table, &at)
    }
    #[inline(always)]
    fn gather_u(self, m: M, from: &[u32], at: U) -> U {
        gather(&m, from, &at)
    }
    #[inline(always)]
    fn gather_pair(self, m: M, from: &[[u32; 2]], at: U) -> (U, U) {
        gather_pair(&m, from, &at)
    }
    #[inline(always)]
    fn expand_u(self, a: U, m: M, from: &U) -> U {
        expand(&a, &m, from)
    }
    #[inline(always)]
    fn compress(self, bits: u32, a: U, to: &mut U) -> usize {
        compress(bits, &a, to)
    }
    #[inline(always)]
    fn compress_f(self, bits: u32, a: F, to: &mut F) -> usize {
        let mut packed = words(*to);
        let count = compress(bits, &words(a), &mut packed);
        *to = floats(packed);
        count
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
        transpose(&rows)
    }
    #[inline(always)]
    fn prefetch<T>(self, _address: *const T) {}
}
