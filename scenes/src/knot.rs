//! Torus knots: tubes along a trefoil, closed and free of self-intersections.

use crate::Model;
use crate::math::{resolution_for, sin_cos};
use glam::{DVec3, Vec3};

/// Segments along the knot for each side around the tube.
const SEGMENTS_PER_SIDE: u32 = 10;
/// Radius of the tube; strands of the curve are more than three times as far apart.
const TUBE: f64 = 0.42;

/// A trefoil with 20·n² faces for the n that comes nearest to `faces` (2,880 gives 2,880).
pub fn torus_knot(faces: u32) -> Model {
    let sides = resolution_for(faces, 2 * SEGMENTS_PER_SIDE, 3);
    let segments = SEGMENTS_PER_SIDE * sides;
    let mut model = Model::default();
    for i in 0..segments {
        let [centre, side, up] = frame(f64::from(i) / f64::from(segments));
        for j in 0..sides {
            let (s, c) = sin_cos(f64::from(j) / f64::from(sides));
            model.push(centre + (side * (TUBE * c) + up * (TUBE * s)));
        }
    }
    for i in 0..segments {
        for j in 0..sides {
            let at = |i: u32, j: u32| (i % segments) * sides + j % sides;
            model.quad([at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)]);
        }
    }
    model
}

/// 27 torus knots of about `faces / 27` faces on a 3×3×3 grid, inside a box of 12 faces
/// that is seen from inside (77,772 gives 77,772).
pub fn torus_knots_in_a_box(faces: u32) -> Model {
    /// Distance of the knots' centres; a knot is less than 7 wide.
    const SPACING: f64 = 8.0;
    let knot = torus_knot((faces.saturating_sub(12) / 27).max(1));
    let mut model = Model::default();
    for cell in 0..27u32 {
        let offset = [cell % 3, cell / 3 % 3, cell / 9].map(|k| SPACING * (f64::from(k) - 1.0));
        let mut copy = knot.clone();
        for p in &mut copy.positions {
            // Turn a copy's axes so that neighbours do not look alike.
            p.rotate_left((cell % 3) as usize);
            *p = (Vec3::from_array(*p).as_dvec3() + DVec3::from_array(offset)).as_vec3().to_array();
        }
        model.append(&copy);
    }
    let half = 1.75 * SPACING;
    let corner: Vec<u32> = (0..8u32)
        .map(|k| model.push([k & 1, k >> 1 & 1, k >> 2].map(|b| if b == 0 { -half } else { half })))
        .collect();
    for face in [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]] {
        model.quad(face.map(|k: usize| corner[k]));
    }
    model
}

/// The point of the knot at `s` in [0, 1), and two unit vectors perpendicular to the curve there.
/// They are functions of the point and the tangent alone, so the tube closes without a twist.
fn frame(s: f64) -> [DVec3; 3] {
    let ((sin2, cos2), (sin3, cos3)) = (sin_cos(2.0 * s), sin_cos(3.0 * s));
    let ring = 2.0 + cos3;
    let centre = DVec3::new(ring * cos2, ring * sin2, sin3);
    // Derivative by s, without the common factor of one turn.
    let tangent =
        DVec3::new(-2.0 * ring * sin2 - 3.0 * sin3 * cos2, 2.0 * ring * cos2 - 3.0 * sin3 * sin2, 3.0 * cos3)
            .normalize();
    // From the middle of the torus's cross-section outwards; never along the tangent.
    let outwards = centre - DVec3::new(2.0 * cos2, 2.0 * sin2, 0.0);
    let up = tangent.cross(outwards).normalize();
    [centre, up.cross(tangent), up]
}
