//! A sheet that rolls up, with waves across: a surface that deforms much and stays in one piece.

use crate::Model;
use crate::math::sin_cos;

/// Squares along the sheet, in the direction in which it rolls up.
const ALONG: u32 = 256;
/// Squares across.
const ACROSS: u32 = 128;
/// Width of the sheet, whose length is 1.
const WIDTH: f64 = 0.5;
/// Radius of the innermost turn.
const INNER: f64 = 0.012;
/// Distance of successive turns.
const PITCH: f64 = 0.012;
/// Height of the waves.
const WAVE: f64 = 0.008;

/// A sheet of 65,536 faces with a share rolled up, from its end at x = 1 on, into a spiral of turns
/// that lie on each other. Waves across it have moved on by `phase` turns. All sheets have the same
/// faces and the same number of positions.
pub fn sheet(rolled: f64, phase: f64) -> Model {
    let mut model = Model::default();
    let flat = 1.0 - rolled;
    // A turn of radius r takes 2πr of the length, so the square of the radius falls linearly along
    // the sheet.
    let radius = |s: f64| (INNER * INNER + PITCH * (1.0 - s) / std::f64::consts::PI).sqrt();
    let outer = radius(flat);
    for i in 0..=ALONG {
        let s = f64::from(i) / f64::from(ALONG);
        let (x, y) = if s <= flat {
            (s, 0.0)
        } else {
            let here = radius(s);
            let (sin, cos) = sin_cos((outer - here) / PITCH);
            (flat + here * sin, outer - here * cos)
        };
        for j in 0..=ACROSS {
            let z = f64::from(j) / f64::from(ACROSS);
            let (wave, _) = sin_cos(2.0 * z + phase);
            model.push([x, y + WAVE * wave, WIDTH * (z - 0.5)]);
        }
    }
    for i in 0..ALONG {
        for j in 0..ACROSS {
            let at = |i: u32, j: u32| i * (ACROSS + 1) + j;
            model.quad([at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)]);
        }
    }
    model
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_keeps_its_length_when_it_is_rolled_up() {
        for rolled in [0.0, 0.3, 0.9] {
            let model = sheet(rolled, 0.25);
            let at = |i: u32| model.positions[(i * (ACROSS + 1)) as usize].map(f64::from);
            let step = |i: u32| {
                let (a, b) = (at(i), at(i + 1));
                [0, 1, 2].map(|k| (b[k] - a[k]).powi(2)).iter().sum::<f64>().sqrt()
            };
            let length: f64 = (0..ALONG).map(step).sum();
            assert!((length - 1.0).abs() < 0.03, "{rolled}: {length}");
        }
        let (open, closed) = (sheet(0.0, 0.0), sheet(0.9, 0.7));
        assert_eq!(open.triangles, closed.triangles);
        assert_eq!(open.positions.len(), closed.positions.len());
    }
}
