//! Merges bit-equal positions.

use bth_format::layout::NONE;
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::atomic::AtomicU32;
use std::sync::atomic::Ordering::Relaxed;

/// Numbers the classes of equal rows that triangles use in order of first use, and replaces the
/// rows of `triangles` by these numbers. So the result does not depend on unused rows. `same_as`
/// has for each row the first row that is equal to it. Returns that row for each number.
pub(super) fn number(same_as: &[AtomicU32], triangles: &mut [[u32; 3]]) -> Vec<u32> {
    let corners = triangles.as_flattened_mut();
    let first_uses = first_uses(corners, same_as);
    let same = |row: u32| same_as[row as usize].load(Relaxed);
    let first_use = |row: u32| first_uses[row as usize].load(Relaxed);

    // Each class is first used at one corner. Counting these corners in order numbers the classes.
    let uses = |part: usize, corners: &[u32]| {
        let first = part * CORNERS_AT_ONCE;
        let rows = corners.iter().map(|corner| same(*corner)).enumerate();
        rows.filter(move |(at, row)| first_use(*row) == (first + at) as u32)
            .map(|(_, row)| row)
            .collect::<Vec<_>>()
    };
    let parts: Vec<Vec<u32>> =
        corners.par_chunks(CORNERS_AT_ONCE).enumerate().map(|(part, corners)| uses(part, corners)).collect();
    let used: Vec<u32> = parts.concat();
    let numbers = atomics(same_as.len());
    let keep = |(number, row): (usize, &u32)| numbers[*row as usize].store(number as u32, Relaxed);
    used.par_iter().enumerate().for_each(keep);
    corners.par_iter_mut().for_each(|corner| *corner = numbers[same(*corner) as usize].load(Relaxed));
    used
}

/// Corners that one task numbers.
const CORNERS_AT_ONCE: usize = 1 << 16;

/// A number in f32 or f64.
pub(super) trait Number: Copy + Sync {
    /// Its bits; -0 has the bits of 0.
    fn bits(self) -> u64;
}

impl Number for f32 {
    fn bits(self) -> u64 {
        u64::from((self + 0.0).to_bits())
    }
}

impl Number for f64 {
    fn bits(self) -> u64 {
        (self + 0.0).to_bits()
    }
}

/// Returns for each position the first row of one that is equal to it. -0 equals +0.
pub(super) fn equal_positions<T: Number>(positions: &[[T; 3]]) -> Vec<AtomicU32> {
    let key = |row: u32| positions[row as usize].map(T::bits);
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

/// About how many rows one table holds, and the largest number of tables.
const ROWS_OF_A_SHARE: usize = 1 << 14;
const MOST_SHARES: usize = 1 << 10;

/// A hash table with open addressing whose slots are rows. Its order does not depend on a random
/// seed.
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
    fn find_or_insert(&mut self, row: u32, key: impl Fn(u32) -> [u64; 3]) -> u32 {
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

/// Mixes all bits into the upper and lower ones: multiply and fold (as in Wang Yi's wyhash), then
/// Fibonacci hashing.
#[inline]
fn hash([x, y, z]: [u64; 3]) -> u64 {
    let a = x ^ y.rotate_left(32) ^ 0xa076_1d64_78bd_642f;
    let b = z ^ 0xe703_7ed1_a0b4_28db;
    let product = u128::from(a) * u128::from(b);
    ((product as u64) ^ (product >> 64) as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
}

/// Returns for each vertex the first row that is equal to it in every frame. All frames have
/// equally many rows. -0 equals +0.
pub(super) fn equal_in_all_frames(frames: &[&[[f32; 3]]]) -> Vec<AtomicU32> {
    // Vertices of the same hash are compared in every frame.
    let mut of_hash: HashMap<u64, Vec<usize>> = HashMap::new();
    let first = |row: usize| {
        let same = of_hash.entry(hash_in_all_frames(frames, row)).or_default();
        let equal = |other: &&usize| frames.iter().all(|frame| frame[row] == frame[**other]);
        let found = same.iter().find(equal).copied();
        if found.is_none() {
            same.push(row);
        }
        AtomicU32::new(found.unwrap_or(row) as u32)
    };
    (0..frames[0].len()).map(first).collect()
}

/// Hashes a vertex's positions in all frames.
fn hash_in_all_frames(frames: &[&[[f32; 3]]], row: usize) -> u64 {
    let mix = |hash: u64, x: f32| {
        (hash.rotate_left(23) ^ u64::from((x + 0.0).to_bits())).wrapping_mul(0x9e37_79b9_7f4a_7c15)
    };
    frames.iter().flat_map(|frame| frame[row]).fold(0, mix)
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
    use crate::deformation::{Influences, RawDeformation, RawMorph};
    use crate::import::weld_and_count;
    use crate::monitor::Silent;
    use proptest::prelude::*;

    type Frames<'f> = &'f [&'f [[f32; 3]]];

    /// Welds vertices of several frames; the error is the frame and the row.
    fn weld(
        frames: Frames<'_>,
        triangles: &mut [[u32; 3]],
        moved: Option<&RawDeformation>,
    ) -> Result<(Vec<u32>, u64), [usize; 2]> {
        let mut bad = [0; 2];
        let found = weld_and_count(frames, None, triangles.to_vec(), moved, false, &Silent, |frame, row| {
            bad = [frame, row];
            crate::error::Error::Cancelled
        });
        let welded = found.map_err(|_| bad)?;
        triangles.copy_from_slice(&welded.mesh.triangles);
        Ok((welded.kept, welded.report.non_finite_unused))
    }

    /// The definition, with linear searches.
    fn slow_weld(triangles: &mut [[u32; 3]], same: impl Fn(u32, u32) -> bool) -> Vec<u32> {
        let mut kept: Vec<u32> = Vec::new();
        for corner in triangles.as_flattened_mut() {
            *corner = kept.iter().position(|row| same(*row, *corner)).unwrap_or_else(|| {
                kept.push(*corner);
                kept.len() - 1
            }) as u32;
        }
        kept
    }

    proptest! {
        /// Positions alone, in several frames, and with a joint and a morph.
        #[test]
        fn welding_agrees_with_linear_search(
            rows in 1usize..40,
            values in prop::collection::vec(-2i8..3, 40 * 3 * 3),
            faces in prop::collection::vec(prop::array::uniform3(0u32..1000), 0..60),
            count in 1usize..4, moves: bool,
        ) {
            // A half keeps the sign of a zero: both zeros occur.
            let number = |k: usize| (f32::from(values[k]) * 0.4).trunc() * 0.5;
            let at = |frame: usize, row: usize| [0, 1, 2].map(|k| number((frame * rows + row) * 3 + k));
            let frames: Vec<Vec<_>> =
                (0..count).map(|frame| (0..rows).map(|row| at(frame, row)).collect()).collect();
            let all: Vec<&[_]> = frames.iter().map(Vec::as_slice).collect();
            let (frames, moved) = if moves { (&all[..1], Some(moved(all[count - 1]))) } else { (&all[..], None) };
            let same = |a: u32, b: u32| {
                let [a, b] = [a as usize, b as usize];
                let joint = |row: usize| all[count - 1][row][0] > 0.0;
                frames.iter().all(|frame| frame[a] == frame[b])
                    && (!moves || joint(a) == joint(b) && all[count - 1][a] == all[count - 1][b])
            };
            let mut fast: Vec<_> = faces.iter().map(|f| f.map(|v| v % rows as u32)).collect();
            let mut slow = fast.clone();
            let expected = slow_weld(&mut slow, same);
            let (kept, _) = weld(frames, &mut fast, moved.as_ref()).unwrap();
            prop_assert_eq!(fast, slow);
            prop_assert!(kept.len() == expected.len() && kept.iter().zip(expected).all(|(a, b)| same(*a, b)));
        }
    }

    /// Two joints and one morph, by the numbers of the vertices.
    fn moved(deltas: &[[f32; 3]]) -> RawDeformation {
        let mut moved = RawDeformation { sets: 1, joint_count: 2, ..RawDeformation::default() };
        for delta in deltas {
            let mut influences = Influences::default();
            influences.joints[0] = u16::from(delta[0] > 0.0);
            influences.weights[0] = 1.0;
            moved.influences.push(influences);
        }
        let mut morph = RawMorph::default();
        let deltas: Vec<_> = deltas.iter().map(|delta| delta.map(|x| x + 0.0)).collect();
        morph.append(0, &deltas);
        moved.positions.push(morph);
        moved
    }

    #[test]
    fn welding_agrees_with_a_map_across_parts() {
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
        let kept = number(&equal_positions(&positions), &mut triangles);
        assert_eq!(kept.iter().map(|row| positions[*row as usize]).collect::<Vec<_>>(), expected);
        assert_eq!(triangles.as_flattened(), slow);
    }

    #[test]
    fn unused_positions_go_and_only_used_ones_must_be_finite() {
        let positions = [[f32::NAN; 3], [1.0; 3], [2.0; 3], [3.0; 3], [9.0; 3]];
        assert_eq!(weld(&[&positions], &mut [[3, 1, 2]], None), Ok((vec![3, 1, 2], 1)));
        assert_eq!(weld(&[&positions], &mut [[3, 1, 0]], None), Err([0, 0]));
        // The first row in the order of use, and its first frame.
        let later = [[1.0; 3], [f32::NAN; 3], [0.0; 3], [f32::INFINITY; 3], [0.0; 3]];
        assert_eq!(weld(&[&positions, &later], &mut [[2, 3, 0]], None), Err([1, 3]));
    }

    #[test]
    fn vertices_that_part_in_a_later_frame_stay_apart() {
        let frames: [&[_]; 2] = [&[[0.0; 3], [-0.0; 3], [1.0; 3]], &[[0.0; 3], [2.0; 3], [1.0; 3]]];
        let mut triangles = [[2, 0, 1]];
        assert_eq!(weld(&frames[..1], &mut triangles.clone(), None), Ok((vec![2, 0], 0)));
        assert_eq!(weld(&frames, &mut triangles, None), Ok((vec![2, 0, 1], 0)));
        assert_eq!(triangles, [[0, 1, 2]]);
    }
}
