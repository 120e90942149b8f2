//! A hall: floor, steps, columns, arches, a barrel vault and window bars.
//!
//! Every part is closed. Parts rest on and lean against each other without being welded, so
//! that many faces touch, overlap in a plane or form T-junctions, as in real architecture.
//! Bars and steps are long and thin.

use crate::Model;
use crate::math::sin_cos;

/// Width of a bay along the hall (y), half the clear width (x) and height of the columns (z).
const BAY: f64 = 4.0;
const HALF_WIDTH: f64 = 5.0;
const COLUMN_HEIGHT: f64 = 6.0;
const BAYS: u32 = 6;
const STEPS: u32 = 8;

/// A hall of six bays. Round parts get as many sides as bring the count near to `faces`.
pub fn hall(faces: u32) -> Model {
    // 14 columns, 12 arches and the vault have 14·n² + 156·n faces, the rest 1,140.
    let rest = (f64::from(faces) - 1140.0).max(0.0);
    let sides = (((156.0f64 * 156.0 + 56.0 * rest).sqrt() - 156.0) / 28.0 + 0.5).floor().max(6.0) as u32;
    let mut model = Model::default();
    let length = BAY * f64::from(BAYS);
    let (outer, end) = (HALF_WIDTH + 2.0, length + 2.0);
    cuboid(&mut model, [-outer, -2.0, -0.5], [outer, end, 0.0]);
    for side in [-1.0, 1.0] {
        // The walls rest on the floor and carry bars from end to end.
        let wall = side * (outer - 0.25);
        cuboid(&mut model, [wall - 0.25, -2.0, 0.0], [wall + 0.25, end, COLUMN_HEIGHT + 3.0]);
        for i in 0..40 {
            let z = 1.0 + 0.15 * f64::from(i);
            let x = side * (outer - 0.51);
            cuboid(&mut model, [x - 0.01, -1.9, z], [x + 0.01, end - 0.1, z + 0.02]);
        }
    }
    for i in 0..=BAYS {
        let y = BAY * f64::from(i);
        for x in [-HALF_WIDTH, HALF_WIDTH] {
            column(&mut model, [x, y], sides);
        }
    }
    for i in 0..BAYS {
        let y = BAY * (f64::from(i) + 0.5);
        for x in [-HALF_WIDTH, HALF_WIDTH] {
            // An arch from column to column along the hall.
            let arc = Arc { centre: [y, COLUMN_HEIGHT], radii: [BAY / 2.0 - 0.5, BAY / 2.0], sides };
            arc.extrude(&mut model, |[a, b], c| [x + c, a, b], [-0.4, 0.4]);
        }
    }
    // The vault rests on the arches' crowns.
    let top = COLUMN_HEIGHT + BAY / 2.0;
    let vault = Arc { centre: [0.0, top], radii: [HALF_WIDTH, HALF_WIDTH + 0.3], sides: 4 * sides };
    vault.extrude(&mut model, |[a, b], c| [a, -c, b], [-length, 0.0]);
    for i in 0..STEPS {
        let (near, height) = (length - 3.0 + 0.35 * f64::from(i), 0.18 * f64::from(i));
        cuboid(&mut model, [-HALF_WIDTH + 1.0, near, height], [HALF_WIDTH - 1.0, end, height + 0.18]);
    }
    model
}

/// Half a ring in a plane: what an arch or vault is cut from.
struct Arc {
    centre: [f64; 2],
    radii: [f64; 2],
    sides: u32,
}

impl Arc {
    /// Extrudes the half ring; `place` maps a point of the plane and a depth to space and keeps
    /// the handedness.
    fn extrude(&self, model: &mut Model, place: impl Fn([f64; 2], f64) -> [f64; 3], depth: [f64; 2]) {
        let base = model.positions.len() as u32;
        for i in 0..=self.sides {
            let (s, c) = sin_cos(0.5 * f64::from(i) / f64::from(self.sides));
            for d in depth {
                for r in self.radii {
                    model.push(place([self.centre[0] + r * c, self.centre[1] + r * s], d));
                }
            }
        }
        // Rows of four: inner and outer at the first depth, then at the second.
        let ring = [0, 1, 3, 2];
        for i in 0..self.sides {
            let at = |i: u32, k: usize| base + 4 * i + ring[k % 4];
            for k in 0..4 {
                model.quad([at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)]);
            }
        }
        let last = base + 4 * self.sides;
        model.quad(ring.map(|k| base + k));
        model.quad([2, 3, 1, 0].map(|k| last + k));
    }
}

/// A column of the hall: a lathe of `sides` sides with a swelling shaft, closed by fans.
fn column(model: &mut Model, [x, y]: [f64; 2], sides: u32) {
    let rings = (sides / 2).max(4);
    let base = model.positions.len() as u32;
    for i in 0..=rings {
        let s = f64::from(i) / f64::from(rings);
        let radius = if i == 0 || i == rings { 0.5 } else { 0.35 + 0.06 * sin_cos(s / 2.0).0 };
        for j in 0..sides {
            let (sin, cos) = sin_cos(f64::from(j) / f64::from(sides));
            model.push([x + radius * cos, y + radius * sin, COLUMN_HEIGHT * s]);
        }
    }
    for i in 0..rings {
        for j in 0..sides {
            let at = |i: u32, j: u32| base + i * sides + j % sides;
            model.quad([at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)]);
        }
    }
    let bottom = model.push([x, y, 0.0]);
    let top = model.push([x, y, COLUMN_HEIGHT]);
    for j in 0..sides {
        let next = (j + 1) % sides;
        model.triangles.push([bottom, base + next, base + j]);
        model.triangles.push([top, base + rings * sides + j, base + rings * sides + next]);
    }
}

/// A box along the axes.
fn cuboid(model: &mut Model, lower: [f64; 3], upper: [f64; 3]) {
    let corner: Vec<u32> = (0..8usize)
        .map(|k| model.push([0, 1, 2].map(|axis| if k >> axis & 1 == 0 { lower[axis] } else { upper[axis] })))
        .collect();
    for face in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
        model.quad(face.map(|k: usize| corner[k]));
    }
}
