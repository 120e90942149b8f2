//! What rounding positions to f32 moves and drops, for models that lie farther from the origin than
//! they are large. Nearer ones lose less than their size times 2^-24.

use crate::exact::in_range;
use crate::mesh::{Positions, Rounding};
use crate::monitor::Monitor;
use crate::zero_area::is_zero_area;
use rayon::prelude::*;

/// Positions that move by more than this are counted, relative to the size of the model: half a
/// unit in the last place of f32.
const COUNTED: f64 = 1.0 / (1u64 << 24) as f64;

/// Moves that a picture of the model can show, relative to its size: half a pixel of 4,096. Only
/// they are worth a warning.
const SHOWN: f64 = 1.0 / (1u64 << 13) as f64;

/// What becomes of positions that have more digits than f32 keeps.
#[derive(Default)]
pub(crate) struct Rounded {
    /// What rounding moves and drops, if positions are rounded.
    pub(crate) rounding: Option<Rounding>,
    /// What it would move and drop, if they are not.
    pub(crate) avoided: Option<Rounding>,
    /// The positions, row by row, if they are kept in f64.
    pub(crate) exact: Option<Vec<[f64; 3]>>,
}

/// Decides in which numbers positions are kept, counts what rounding does to a mesh, and warns
/// where it can be seen. `again` reads the positions in f64; it is absent if the numbers of the
/// source are f32. Nothing is counted if no position moves by more than the size of the mesh times
/// 2^-24. The size is the longest side of the box of all finite positions.
pub(crate) fn check(
    (rows, triangles): (&[[f32; 3]], &[[u32; 3]]),
    again: Option<&dyn Fn() -> Vec<[f64; 3]>>,
    positions: Positions,
    monitor: &dyn Monitor,
) -> Rounded {
    let finite = |p: &&[f32; 3]| p.iter().all(|x| x.is_finite());
    let (mut lower, mut upper) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for position in rows.iter().filter(finite) {
        for k in 0..3 {
            let x = f64::from(position[k]);
            (lower[k], upper[k]) = (lower[k].min(x), upper[k].max(x));
        }
    }
    let size = (0..3).fold(0.0, |size: f64, k| size.max(upper[k] - lower[k]));
    let farthest = (0..3).fold(0.0, |most: f64, k| most.max(-lower[k]).max(upper[k]));
    let is_near = farthest <= size && positions != Positions::F64;
    let Some(again) = again.filter(|_| !is_near && !rows.is_empty()) else { return Rounded::default() };
    let exact = again();
    if exact.len() != rows.len() {
        return Rounded::default();
    }
    let moves = rows.par_iter().zip(&exact).filter(|(p, _)| finite(p));
    let moves =
        moves.map(|(p, exact)| (0..3).fold(0.0, |most: f64, k| most.max((f64::from(p[k]) - exact[k]).abs())));
    let (moved, farthest) = moves
        .fold(|| (0, 0.0), |sum, by| more(sum, (u64::from(by > COUNTED * size), by)))
        .reduce(|| (0, 0.0), more);
    let is_kept = match positions {
        Positions::F32 => false,
        Positions::Auto => moved > 0,
        Positions::F64 => farthest > 0.0,
    };
    if moved == 0 && !is_kept {
        return Rounded::default();
    }
    let corners = |triangle: &[u32; 3]| triangle.map(|row| exact[row as usize]);
    let rounded = |triangle: &[u32; 3]| triangle.map(|row| rows[row as usize]);
    let is_finite = |triangle: &[u32; 3]| rounded(triangle).iter().all(|p| finite(&p));
    let collapsed = |triangle: &&[u32; 3]| {
        is_finite(triangle) && is_zero_area(rounded(triangle)) && !is_zero_area(corners(triangle))
    };
    let lost = triangles.par_iter().filter(collapsed).count() as u64;
    let found = Rounding { positions: moved, farthest, triangles: lost };
    if is_kept && let Some(exact) = kept(rows, &exact) {
        return Rounded { rounding: None, avoided: Some(found), exact: Some(exact) };
    }
    if lost > 0 || farthest > SHOWN * size {
        monitor.warn(&format!(
            "rounding to 32-bit numbers moves {moved} of {} positions, by up to {farthest:.2e} ({:.1e} of the \
             model's size), and {lost} of {} triangles lose their area. Keep positions in 64-bit numbers \
             (`--positions f64`), or move the model near the origin before you export it",
            rows.len(),
            farthest / size,
            triangles.len(),
        ));
    }
    Rounded { rounding: Some(found), ..Rounded::default() }
}

/// The positions as files keep them; zeros for those that are not finite, which no face may use.
/// `None` if a coordinate is beyond f32, though it rounds to the largest number.
fn kept(rows: &[[f32; 3]], exact: &[[f64; 3]]) -> Option<Vec<[f64; 3]>> {
    let is_finite = |p: &[f32; 3]| p.iter().all(|x| x.is_finite());
    let one =
        |(p, exact): (&[f32; 3], &[f64; 3])| if is_finite(p) { in_range(*exact) } else { Some([0.0; 3]) };
    rows.par_iter().zip(exact).map(one).collect()
}

/// The sum of two counts, and the larger of two distances.
fn more(a: (u64, f64), b: (u64, f64)) -> (u64, f64) {
    (a.0 + b.0, a.1.max(b.1))
}
