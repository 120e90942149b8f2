//! Curly open tubes that grow out of a ball and cross each other.

use crate::Model;
use crate::math::sin_cos;
use bth_random::Rng;
use glam::DVec3;

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
    let mut rng = Rng::new(27);
    let mut model = Model::default();
    for _ in 0..(faces / FACES_PER_HAIR).max(1) {
        let mut direction = DVec3::from_array(rng.unit_vector());
        let mut centre = direction * rng.between(0.15, 0.35);
        let mut side = perpendicular(direction);
        let bend = DVec3::from_array(rng.point_in_ball());
        let base = model.positions.len() as u32;
        for i in 0..=SEGMENTS {
            let up = direction.cross(side);
            let radius = RADIUS * (1.0 - 2.0 / 3.0 * f64::from(i) / f64::from(SEGMENTS));
            for j in 0..SIDES {
                let (s, c) = sin_cos(f64::from(j) / f64::from(SIDES));
                model.push(centre + (side * (radius * c) + up * (radius * s)));
            }
            let curl = DVec3::from_array(rng.point_in_ball());
            direction = (direction + (bend * 0.25 + curl * 0.35)).normalize();
            // Carry the side along with minimal rotation, so that the tube does not twist.
            let carried = side - direction * side.dot(direction);
            side =
                if carried.length_squared() > 1e-6 { carried.normalize() } else { perpendicular(direction) };
            centre += direction * STEP;
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

/// A unit vector perpendicular to the unit vector `d`.
fn perpendicular(d: DVec3) -> DVec3 {
    let axis = if d.x.abs() < 0.6 { DVec3::X } else { DVec3::Y };
    d.cross(axis).normalize()
}
