//! Merges bit-equal positions.

use crate::rows::NONE;
use rayon::prelude::*;
use std::sync::atomic::AtomicU32;
use std::sync::atomic::Ordering::Relaxed;

/// The result of [`weld`].
#[derive(Debug, PartialEq)]
pub(super) struct Welded {
    /// Distinct positions in order of first use, with +0 in the place of -0.
    pub(super) positions: Vec<[f32; 3]>,
    /// Positions that are not finite and that no face uses.
    pub(super) non_finite_unused: u64,
}

/// Replaces the rows of `triangles` by rows of distinct positions. These are in order of first use, so the result does
/// not depend on unused positions. -0 equals +0.
///
/// # Errors
/// The row of the first used position that is not finite.
pub(super) fn weld(positions: &[[f32; 3]], triangles: &mut [[u32; 3]]) -> Result<Welded, usize> {
    let corners = triangles.as_flattened_mut();
    let finite = |row: u32| positions[row as usize].iter().all(|x| x.is_finite());
    let non_finite = (0..positions.len() as u32).into_par_iter().filter(|row| !finite(*row)).count() as u64;
    if non_finite > 0
        && let Some(row) = corners.par_iter().find_first(|row| !finite(**row))
    {
        return Err(*row as usize);
    }
    let same_as = first_equal_rows(positions);
    let first_uses = first_uses(corners, &same_as);
    let same_as = |row: u32| same_as[row as usize].load(Relaxed);
    let first_use = |row: u32| first_uses[row as usize].load(Relaxed);

    // A distinct position is first used at one corner; counting these corners in order numbers the positions.
    let uses = |part: usize, corners: &[u32]| {
        let first = part * CORNERS_AT_ONCE;
        let rows = corners.iter().map(|corner| same_as(*corner)).enumerate();
        rows.filter(move |(at, row)| first_use(*row) == (first + at) as u32)
            .map(|(_, row)| row)
            .collect::<Vec<_>>()
    };
    let parts: Vec<Vec<u32>> =
        corners.par_chunks(CORNERS_AT_ONCE).enumerate().map(|(part, corners)| uses(part, corners)).collect();
    let used: Vec<u32> = parts.concat();
    let welded_rows = atomics(positions.len());
    used.par_iter()
        .enumerate()
        .for_each(|(welded, row)| welded_rows[*row as usize].store(welded as u32, Relaxed));
    corners.par_iter_mut().for_each(|corner| *corner = welded_rows[same_as(*corner) as usize].load(Relaxed));
    let positions = used.par_iter().map(|row| positive_zeros(positions[*row as usize])).collect();
    Ok(Welded { positions, non_finite_unused: non_finite })
}

/// Corners that one task numbers.
const CORNERS_AT_ONCE: usize = 1 << 16;

/// The position with +0 in the place of -0.
fn positive_zeros(position: [f32; 3]) -> [f32; 3] {
    position.map(|x| x + 0.0)
}

/// For each position the first row of one that is equal to it.
fn first_equal_rows(positions: &[[f32; 3]]) -> Vec<AtomicU32> {
    let key = |row: u32| positive_zeros(positions[row as usize]).map(f32::to_bits);
    // Equal positions are in the same share, and a share's table stays in a cache.
    let shares = (positions.len() / ROWS_OF_A_SHARE).next_power_of_two().min(MOST_SHARES);
    let share_of = |row: u32| (hash(key(row)) as usize) & (shares - 1);
    let sort_in = |mut parts: Vec<Vec<u32>>, row: u32| {
        parts[share_of(row)].push(row);
        parts
    };
    let rows = (0..positions.len() as u32).into_par_iter().with_min_len(ROWS_OF_A_SHARE);
    let sorted: Vec<Vec<Vec<u32>>> = rows.fold(|| vec![Vec::new(); shares], sort_in).collect();
    let first_equal = atomics(positions.len());
    (0..shares).into_par_iter().for_each(|share| {
        let parts = || sorted.iter().map(|parts| &parts[share]);
        let mut table = Table::with_capacity(parts().map(Vec::len).sum());
        for &row in parts().flatten() {
            first_equal[row as usize].store(table.find_or_insert(row, key), Relaxed);
        }
    });
    first_equal
}

/// About how many rows one table holds, and the greatest number of tables.
const ROWS_OF_A_SHARE: usize = 1 << 14;
const MOST_SHARES: usize = 1 << 10;

/// A hash table with open addressing whose slots are rows. Its order does not depend on a random seed.
struct Table {
    slots: Vec<u32>,
    shift: u32,
}

impl Table {
    /// A table for `count` entries at a load of at most one half.
    fn with_capacity(count: usize) -> Table {
        let size = (count.max(4) * 2).next_power_of_two();
        Table { slots: vec![NONE; size], shift: 64 - size.trailing_zeros() }
    }

    /// The row of that key that was inserted first.
    #[inline]
    fn find_or_insert(&mut self, row: u32, key: impl Fn(u32) -> [u32; 3]) -> u32 {
        let mask = self.slots.len() - 1;
        let mut slot = (hash(key(row)) >> self.shift) as usize;
        loop {
            match self.slots[slot] {
                NONE => {
                    self.slots[slot] = row;
                    return row;
                }
                other if key(other) == key(row) => return other,
                _ => slot = (slot + 1) & mask,
            }
        }
    }
}

/// Mixes all bits into the upper and lower ones: multiply and fold (as in Wang Yi's wyhash), then Fibonacci hashing.
#[inline]
fn hash([x, y, z]: [u32; 3]) -> u64 {
    let a = (u64::from(x) | u64::from(y) << 32) ^ 0xa076_1d64_78bd_642f;
    let b = u64::from(z) ^ 0xe703_7ed1_a0b4_28db;
    let product = u128::from(a) * u128::from(b);
    ((product as u64) ^ (product >> 64) as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
}

/// For each first row of equal positions the first corner that has one of them, or `NONE`.
fn first_uses(corners: &[u32], same_as: &[AtomicU32]) -> Vec<AtomicU32> {
    let first_uses = atomics(same_as.len());
    corners.par_iter().zip(0..corners.len() as u32).for_each(|(row, at)| {
        let first_use = &first_uses[same_as[*row as usize].load(Relaxed) as usize];
        // Most corners are not the first; to look is cheaper than to write.
        if at < first_use.load(Relaxed) {
            first_use.fetch_min(at, Relaxed);
        }
    });
    first_uses
}

/// `NONE` for each row.
fn atomics(count: usize) -> Vec<AtomicU32> {
    (0..count).into_par_iter().map(|_| AtomicU32::new(NONE)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The definition, with linear searches.
    fn slow_weld(positions: &[[f32; 3]], triangles: &mut [[u32; 3]]) -> Vec<[f32; 3]> {
        let mut distinct: Vec<[f32; 3]> = Vec::new();
        for corner in triangles.as_flattened_mut() {
            let position = positions[*corner as usize];
            *corner = match distinct.iter().position(|p| *p == position) {
                Some(row) => row as u32,
                None => {
                    distinct.push(position);
                    distinct.len() as u32 - 1
                }
            };
        }
        distinct
    }

    proptest! {
        #[test]
        fn weld_agrees_with_linear_search(
            grid in prop::collection::vec(prop::array::uniform3(-2i8..3), 1..40),
            faces in prop::collection::vec(prop::array::uniform3(0usize..1000), 0..60),
        ) {
            // A half keeps the sign of a zero: both zeros occur.
            let positions: Vec<_> = grid.iter().map(|p| p.map(|x| (f32::from(x) * 0.4).trunc() * 0.5)).collect();
            let triangles: Vec<_> = faces.iter().map(|f| f.map(|v| (v % positions.len()) as u32)).collect();
            let (mut fast, mut slow) = (triangles.clone(), triangles);
            let expected = slow_weld(&positions, &mut slow);
            let welded = weld(&positions, &mut fast).unwrap();
            prop_assert_eq!(welded.positions, expected);
            prop_assert_eq!(fast, slow);
        }
    }

    #[test]
    fn weld_agrees_with_a_map_across_parts() {
        let mut random = bth_random::Rng::new(7);
        let positions: Vec<[f32; 3]> =
            (0..50_000).map(|_| [(); 3].map(|()| random.below(30) as f32 - 15.0)).collect();
        let mut triangles: Vec<[u32; 3]> = (0..CORNERS_AT_ONCE)
            .map(|_| [(); 3].map(|()| random.below(positions.len() as u64) as u32))
            .collect();
        let (mut rows, mut expected) = (std::collections::HashMap::new(), Vec::new());
        let slow: Vec<u32> = triangles
            .as_flattened()
            .iter()
            .map(|&corner| {
                let position = positions[corner as usize].map(|x| x + 0.0);
                *rows.entry(position.map(f32::to_bits)).or_insert_with(|| {
                    expected.push(position);
                    expected.len() as u32 - 1
                })
            })
            .collect();
        let welded = weld(&positions, &mut triangles).unwrap();
        assert_eq!(welded.positions, expected);
        assert_eq!(triangles.as_flattened(), slow);
    }

    #[test]
    fn negative_zero_welds_with_zero_and_is_written_as_zero() {
        let positions = [[-0.0, 0.0, 1.0], [0.0, -0.0, 1.0], [2.0, 0.0, 0.0]];
        let mut triangles = [[0, 1, 2]];
        let welded = weld(&positions, &mut triangles).unwrap();
        assert_eq!(triangles, [[0, 0, 1]]);
        assert_eq!(welded.positions[0].map(f32::to_bits), [0, 0, 1.0f32.to_bits()]);
    }

    #[test]
    fn unused_positions_go_and_only_used_ones_must_be_finite() {
        let positions = [[f32::NAN; 3], [1.0; 3], [2.0; 3], [3.0; 3], [9.0; 3]];
        let welded = weld(&positions, &mut [[3, 1, 2]]).unwrap();
        assert_eq!(welded.positions, [[3.0; 3], [1.0; 3], [2.0; 3]]);
        assert_eq!(welded.non_finite_unused, 1);
        assert_eq!(weld(&positions, &mut [[3, 1, 0]]), Err(0));
    }
}
