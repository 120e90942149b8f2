//! What rounding positions to f32 moves and drops, for models that lie farther from the origin than
//! they are large. Nearer ones lose less than their size times 2^-24.

use crate::mesh::Rounding;
use crate::monitor::Monitor;
use crate::raw::Raw;
use crate::zero_area::is_zero_area;
use rayon::prelude::*;

/// Positions that move by more than this are counted, relative to the size of the model: half a
/// unit in the last place of f32.
const COUNTED: f64 = 1.0 / (1u64 << 24) as f64;

/// Moves that a picture of the model can show, relative to its size: half a pixel of 4,096. Only
/// they are worth a warning.
const SHOWN: f64 = 1.0 / (1u64 << 13) as f64;

/// Counts what rounding does to a mesh whose source has more digits than f32 keeps, and warns where
/// it can be seen. `None` if no position moves by more than the size of the model times 2^-24. The
/// size is the longest side of the box of all finite positions.
pub(crate) fn check(raw: &Raw<'_>, monitor: &dyn Monitor) -> Option<Rounding> {
    let (rows, triangles) = (&raw.positions, &raw.triangles);
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
    if farthest <= size || rows.is_empty() {
        return None;
    }
    let exact = (raw.exact.as_ref()?)();
    if exact.len() != rows.len() {
        return None;
    }
    let moves = rows.par_iter().zip(&exact).filter(|(p, _)| finite(p));
    let moves =
        moves.map(|(p, exact)| (0..3).fold(0.0, |most: f64, k| most.max((f64::from(p[k]) - exact[k]).abs())));
    let (positions, farthest) = moves
        .fold(|| (0, 0.0), |sum, by| more(sum, (u64::from(by > COUNTED * size), by)))
        .reduce(|| (0, 0.0), more);
    if positions == 0 {
        return None;
    }
    let corners = |triangle: &[u32; 3]| triangle.map(|row| exact[row as usize]);
    let rounded = |triangle: &[u32; 3]| triangle.map(|row| rows[row as usize]);
    let is_finite = |triangle: &[u32; 3]| rounded(triangle).iter().all(|p| finite(&p));
    let collapsed = |triangle: &&[u32; 3]| {
        is_finite(triangle) && is_zero_area(rounded(triangle)) && !is_zero_area(corners(triangle))
    };
    let lost = triangles.par_iter().filter(collapsed).count() as u64;
    let found = Rounding { positions, farthest, triangles: lost };
    if lost > 0 || farthest > SHOWN * size {
        monitor.warn(&format!(
            "rounding to 32-bit numbers moves {positions} of {} positions, by up to {farthest:.2e} ({:.1e} of the \
             model's size), and {lost} of {} triangles lose their area. Move the model near the origin before you \
             export it",
            rows.len(),
            farthest / size,
            triangles.len(),
        ));
    }
    Some(found)
}

/// The sum of two counts, and the larger of two distances.
fn more(a: (u64, f64), b: (u64, f64)) -> (u64, f64) {
    (a.0 + b.0, a.1.max(b.1))
}
