//! Merges bit-equal positions.

use crate::rows::NONE;

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
    let mut welded_rows = vec![NONE; positions.len()];
    let mut table = Table::with_capacity(positions.len().min(triangles.len().saturating_mul(3)));
    let mut distinct = Vec::new();
    for corner in triangles.as_flattened_mut() {
        let row = *corner as usize;
        if welded_rows[row] == NONE {
            let position = positions[row].map(|x| x + 0.0);
            if !position.iter().all(|x| x.is_finite()) {
                return Err(row);
            }
            welded_rows[row] = table.find_or_insert(position, &mut distinct);
        }
        *corner = welded_rows[row];
    }
    let unused = positions.iter().zip(&welded_rows).filter(|(_, row)| **row == NONE);
    let non_finite_unused = unused.filter(|(p, _)| !p.iter().all(|x| x.is_finite())).count() as u64;
    distinct.shrink_to_fit();
    Ok(Welded { positions: distinct, non_finite_unused })
}

/// A hash table with open addressing whose slots are rows of the distinct positions. It needs a quarter of the memory of
/// a map that holds the keys, and its order does not depend on a random seed.
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

    #[inline]
    fn find_or_insert(&mut self, position: [f32; 3], distinct: &mut Vec<[f32; 3]>) -> u32 {
        let key = position.map(f32::to_bits);
        let mask = self.slots.len() - 1;
        let mut slot = (hash(key) >> self.shift) as usize;
        loop {
            match self.slots[slot] {
                NONE => {
                    let row = distinct.len() as u32;
                    self.slots[slot] = row;
                    distinct.push(position);
                    return row;
                }
                row if distinct[row as usize].map(f32::to_bits) == key => return row,
                _ => slot = (slot + 1) & mask,
            }
        }
    }
}

/// Mixes all bits into the upper ones: multiply and fold (as in Wang Yi's wyhash), then Fibonacci hashing.
#[inline]
fn hash([x, y, z]: [u32; 3]) -> u64 {
    let a = (u64::from(x) | u64::from(y) << 32) ^ 0xa076_1d64_78bd_642f;
    let b = u64::from(z) ^ 0xe703_7ed1_a0b4_28db;
    let product = u128::from(a) * u128::from(b);
    ((product as u64) ^ (product >> 64) as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
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
