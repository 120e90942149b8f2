//! Compression of the lanes whose bit is set, one register after the other.

use super::{LANES, QUAD, Quad, Quads, U};

/// For each set of four lanes the indices of its lanes in order, as bytes of a register.
const COMPRESSION: [[u8; LANES]; 1 << QUAD] = {
    let mut out = [[0; LANES]; 1 << QUAD];
    let mut bits = 0;
    while bits < out.len() {
        let (mut lane, mut packed) = (0, 0);
        while lane < QUAD {
            if bits >> lane & 1 != 0 {
                let mut byte = 0;
                while byte < size_of::<u32>() {
                    out[bits][size_of::<u32>() * packed + byte] = (size_of::<u32>() * lane + byte) as u8;
                    byte += 1;
                }
                packed += 1;
            }
            lane += 1;
        }
        bits += 1;
    }
    out
};

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
