//! Transposition of rows to vectors of sixteen lanes and back, in blocks of four by four.

use super::register::Register;
use super::{F, LANES, QUAD, QUADS, Quad, Quads, U, split_mut};
use crate::simd::Lanewise;

/// Implements [`crate::simd::Simd::rows4`] for indices of all lanes.
#[inline(always)]
pub(super) fn rows4<Q: Quad>(s: Quads<Q>, from: &[[f32; 4]], row: [u32; LANES]) -> [F<Q>; 4] {
    let mut out = [s.splat(0.0); 4];
    for i in 0..QUADS {
        let mut block = [s.0.splat(0.0); QUAD];
        for j in 0..QUAD {
            block[j] = s.0.load(&from[row[QUAD * i + j] as usize]);
        }
        let block = s.0.transpose(block);
        for k in 0..4 {
            out[k][i] = block[k];
        }
    }
    out
}

/// Implements [`crate::simd::Simd::rows8`] for indices of all lanes.
#[inline(always)]
pub(super) fn rows8<Q: Quad>(s: Quads<Q>, from: &[[u32; 8]], row: [u32; LANES]) -> [U<Q>; 8] {
    let mut out = [s.splat_u(0); 8];
    for i in 0..QUADS {
        let mut halves = [[s.0.splat(0.0); QUAD]; 2];
        for j in 0..QUAD {
            let (low, high) = from[row[QUAD * i + j] as usize].split_at(QUAD);
            halves[0][j] = s.0.floats(s.0.load_u(low.first_chunk().expect("half of a row")));
            halves[1][j] = s.0.floats(s.0.load_u(high.first_chunk().expect("half of a row")));
        }
        for half in 0..2 {
            let block = s.0.transpose(halves[half]);
            for k in 0..QUAD {
                out[QUAD * half + k][i] = s.0.bits(block[k]);
            }
        }
    }
    out
}

/// Implements [`crate::simd::Simd::store_rows5`].
#[inline(always)]
pub(super) fn store_rows5<Q: Quad>(s: Quads<Q>, columns: [U<Q>; 5], to: &mut [[u32; 5]; LANES]) {
    let mut last = [0; LANES];
    s.store_u(columns[4], &mut last);
    for i in 0..QUADS {
        let mut block = [s.0.splat(0.0); QUAD];
        for k in 0..QUAD {
            block[k] = s.0.floats(columns[k][i]);
        }
        let block = s.0.transpose(block);
        for j in 0..QUAD {
            let row = &mut to[QUAD * i + j];
            s.0.store_u(s.0.bits(block[j]), row.first_chunk_mut().expect("four of five words"));
            row[4] = last[QUAD * i + j];
        }
    }
}

/// Implements [`crate::simd::Simd::store_transposed`].
#[inline(always)]
pub(super) fn store_transposed<Q: Quad, const N: usize>(
    piece: Register<Q>,
    columns: [Q::F; LANES],
    to: &mut [[[f32; LANES]; N]; LANES],
    line: usize,
) {
    let to = &mut split_mut(to)[piece.index % QUADS];
    for k in 0..QUADS {
        let mut block = [columns[0]; QUAD];
        for j in 0..QUAD {
            block[j] = columns[QUAD * k + j];
        }
        let block = piece.quad.transpose(block);
        for j in 0..QUAD {
            piece.quad.store(block[j], &mut split_mut(&mut to[j][line])[k]);
        }
    }
}

/// Implements [`crate::simd::Simd::transpose`].
#[inline(always)]
pub(super) fn transpose<Q: Quad>(s: Quads<Q>, rows: [F<Q>; LANES]) -> [F<Q>; LANES] {
    let mut out = rows;
    for i in 0..QUADS {
        for k in 0..QUADS {
            let mut block = [s.0.splat(0.0); QUAD];
            for j in 0..QUAD {
                block[j] = rows[QUAD * i + j][k];
            }
            let block = s.0.transpose(block);
            for j in 0..QUAD {
                out[QUAD * k + j][i] = block[j];
            }
        }
    }
    out
}

/// Implements [`crate::simd::Simd::least_of_each`]: each row is reduced to one register before four
/// of them are transposed.
#[inline(always)]
pub(super) fn least_of_each<Q: Quad>(s: Quads<Q>, rows: [F<Q>; LANES]) -> F<Q> {
    let mut out = rows[0];
    for i in 0..QUADS {
        let mut block = [s.0.splat(0.0); QUAD];
        for j in 0..QUAD {
            let [a, b, c, d] = rows[QUAD * i + j];
            block[j] = s.0.min(s.0.min(a, b), s.0.min(c, d));
        }
        let [a, b, c, d] = s.0.transpose(block);
        out[i] = s.0.min(s.0.min(a, b), s.0.min(c, d));
    }
    out
}
