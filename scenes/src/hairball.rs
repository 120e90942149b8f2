//! Curly open tubes that grow out of a ball and cross each other.

use crate::Model;
use crate::math::{Random, Vec3, add, cross, dot, normalize, scale, sin_cos, sub};

/// Sides of a hair.
const SIDES: u32 = 5;
/// Segments of a hair.
const SEGMENTS: u32 = 12;
/// Triangles of a hair.
pub const FACES_PER_HAIR: u32 = 2 * SIDES * SEGMENTS;

/// A hairball of `faces / 120` hairs, at least one.
pub fn hairball(faces: u32) -> Model {
    /// Length of a segment.
    const STEP: f64 = 0.07;
    /// Radius at the root; a hair ends with a third of it.
    const RADIUS: f64 = 0.006;
    let mut random = Random::new(27);
    let mut model = Model::default();
    for _ in 0..(faces / FACES_PER_HAIR).max(1) {
        let mut direction = random.direction();
        let mut centre = scale(direction, random.range(0.15, 0.35));
        let mut side = perpendicular(direction);
        let bend = random.in_ball();
        let base = model.positions.len() as u32;
        for i in 0..=SEGMENTS {
            let up = cross(direction, side);
            let radius = RADIUS * (1.0 - 2.0 / 3.0 * f64::from(i) / f64::from(SEGMENTS));
            for j in 0..SIDES {
                let (s, c) = sin_cos(f64::from(j) / f64::from(SIDES));
                model.push(add(centre, add(scale(side, radius * c), scale(up, radius * s))));
            }
            direction = normalize(add(direction, add(scale(bend, 0.25), scale(random.in_ball(), 0.35))));
            // Carry the side along with the least rotation, so that the tube does not twist.
            let carried = sub(side, scale(direction, dot(side, direction)));
            side = if dot(carried, carried) > 1e-6 { normalize(carried) } else { perpendicular(direction) };
            centre = add(centre, scale(direction, STEP));
        }
        for i in 0..SEGMENTS {
            for j in 0..SIDES {
                let at = |i: u32, j: u32| base + i * SIDES + j % SIDES;
                model.quad([at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)]);
            }
        }
    }
    model
}

/// A unit vector across a unit vector.
fn perpendicular(d: Vec3) -> Vec3 {
    let axis = if d[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    normalize(cross(d, axis))
}
