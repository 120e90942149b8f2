//! Merges vertices that coincide in every frame.

use crate::rows::NONE;
use std::collections::HashMap;

/// Replaces the rows of `triangles` by those of vertices that differ in some frame, in order of first use; returns for each such
/// vertex its row in the source. All frames have equally many rows, and those of triangles are among them. -0 equals +0.
///
/// # Errors
/// Frame and row of a used position that is not finite: of the first row in order of use its first frame.
pub(super) fn weld(frames: &[Vec<[f32; 3]>], triangles: &mut [[u32; 3]]) -> Result<Vec<u32>, (usize, usize)> {
    let rows = frames.first().map_or(0, Vec::len);
    let mut welded = vec![NONE; rows];
    let mut kept: Vec<u32> = Vec::new();
    // Vertices of the same hash are compared in every frame.
    let mut of_hash: HashMap<u64, Vec<u32>> = HashMap::new();
    for corner in triangles.as_flattened_mut() {
        let row = *corner as usize;
        if welded[row] == NONE {
            if let Some(frame) = frames.iter().position(|frame| !frame[row].iter().all(|x| x.is_finite())) {
                return Err((frame, row));
            }
            let equal = |other: &&u32| {
                frames.iter().all(|frame| frame[row] == frame[kept[**other as usize] as usize])
            };
            let same = of_hash.entry(hash(frames, row)).or_default();
            welded[row] = same.iter().find(equal).copied().unwrap_or_else(|| {
                let new = kept.len() as u32;
                same.push(new);
                kept.push(row as u32);
                new
            });
        }
        *corner = welded[row];
    }
    Ok(kept)
}

/// A hash of a vertex's positions in all frames.
fn hash(frames: &[Vec<[f32; 3]>], row: usize) -> u64 {
    let mix = |hash: u64, x: f32| {
        (hash.rotate_left(23) ^ u64::from((x + 0.0).to_bits())).wrapping_mul(0x9e37_79b9_7f4a_7c15)
    };
    frames.iter().flat_map(|frame| frame[row]).fold(0, mix)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The definition, with linear searches.
    fn slow_weld(frames: &[Vec<[f32; 3]>], triangles: &mut [[u32; 3]]) -> Vec<u32> {
        let mut kept: Vec<u32> = Vec::new();
        for corner in triangles.as_flattened_mut() {
            let same = |row: &u32| frames.iter().all(|f| f[*row as usize] == f[*corner as usize]);
            *corner = kept.iter().position(same).unwrap_or_else(|| {
                kept.push(*corner);
                kept.len() - 1
            }) as u32;
        }
        kept
    }

    proptest! {
        #[test]
        fn welding_agrees_with_linear_search(
            rows in 1usize..30,
            values in prop::collection::vec(-1i8..2, 30 * 3 * 3),
            faces in prop::collection::vec(prop::array::uniform3(0u32..1000), 0..50),
        ) {
            let at = |frame: usize, row: usize| -> [f32; 3] {
                std::array::from_fn(|k| (f32::from(values[(frame * rows + row) * 3 + k]) * 0.6).trunc() * 0.5)
            };
            let frames: Vec<Vec<_>> = (0..3).map(|frame| (0..rows).map(|row| at(frame, row)).collect()).collect();
            let mut fast: Vec<_> = faces.iter().map(|f| f.map(|v| v % rows as u32)).collect();
            let mut slow = fast.clone();
            prop_assert_eq!(weld(&frames, &mut fast).unwrap(), slow_weld(&frames, &mut slow));
            prop_assert_eq!(fast, slow);
        }
    }

    #[test]
    fn vertices_that_part_in_a_later_frame_stay_apart_and_bad_ones_are_named() {
        let frames =
            [vec![[0.0; 3], [0.0; 3], [1.0; 3], [f32::NAN; 3]], vec![[0.0; 3], [2.0; 3], [1.0; 3], [3.0; 3]]];
        let mut triangles = [[2, 0, 1]];
        assert_eq!(weld(&frames, &mut triangles), Ok(vec![2, 0, 1]));
        assert_eq!(triangles, [[0, 1, 2]]);
        assert_eq!(weld(&frames, &mut [[2, 0, 3]]), Err((0, 3)));
    }
}
