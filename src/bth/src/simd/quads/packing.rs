//! Expansion and compression of the lanes whose bit is set, one register after the other.

use super::{LANES, QUAD, Quad, Quads, U};
use crate::simd::Lanewise;

/// For each set of four lanes the indices of its lanes in order, as bytes of a register.
const COMPRESSION: [[u8; LANES]; 1 << QUAD] = tables(true);
/// For each set of four lanes the number of its lanes below each lane, which is the index of the
/// lane's element in a packed row, as bytes of a register: the inverse of [`COMPRESSION`].
const EXPANSION: [[u8; LANES]; 1 << QUAD] = tables(false);

const fn tables(compress: bool) -> [[u8; LANES]; 1 << QUAD] {
    let mut out = [[0; LANES]; 1 << QUAD];
    let mut bits = 0;
    while bits < out.len() {
        let (mut lane, mut packed) = (0, 0);
        while lane < QUAD {
            if bits >> lane & 1 != 0 {
                let (to, from) = if compress { (packed, lane) } else { (lane, packed) };
                let mut byte = 0;
                while byte < size_of::<u32>() {
                    out[bits][size_of::<u32>() * to + byte] = (size_of::<u32>() * from + byte) as u8;
                    byte += 1;
                }
                packed += 1;
            }
            lane += 1;
        }
        bits += 1;
    }
    out
}

/// The four bits of a register.
#[inline(always)]
fn bits_of(bits: u32, register: usize) -> usize {
    (bits >> (QUAD * register)) as usize % (1 << QUAD)
}

/// Implements [`crate::simd::Simd::compress`].
#[inline(always)]
pub(super) fn compress<Q: Quad>(s: Quads<Q>, bits: u32, a: U<Q>, to: &mut [u32; LANES]) -> usize {
    let mut count = 0;
    for i in 0..a.len() {
        let bits = bits_of(bits, i);
        // At most four lanes precede each register before it, so a whole register fits.
        let to = to[count..].first_chunk_mut().expect("there is room for the remaining registers");
        s.0.store_u(s.0.bytes(a[i], &COMPRESSION[bits]), to);
        count += bits.count_ones() as usize;
    }
    count
}

/// Implements [`crate::simd::Simd::expand_u`].
#[inline(always)]
pub(super) fn expand<Q: Quad>(s: Quads<Q>, a: U<Q>, m: U<Q>, from: &[u32; LANES]) -> U<Q> {
    let (bits, mut out, mut first) = (s.mask_bits(m), a, 0);
    for i in 0..a.len() {
        let bits = bits_of(bits, i);
        let from = from[first..].first_chunk().expect("there are elements for the remaining registers");
        out[i] = s.0.bytes(s.0.load_u(from), &EXPANSION[bits]);
        first += bits.count_ones() as usize;
    }
    s.select_u(m, out, a)
}
