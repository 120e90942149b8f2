//! Location of a ray's origin among the tetrahedra, given a constrained face near it: a walk from the tetrahedron at the face towards
//! the origin, most often of no step or one.

use super::records::{Entered, ReadRecords};
use super::walk::{TetPosition, TetSpace};
use crate::intersect::line::{Line, Projected, Sign};
use bth_format::layout::{FACE_BIT, TetFace};

/// Greatest number of steps; after it the ray is traced without the hint.
const MAX_STEPS: u32 = 64;
/// Bound of the error of [`side_of_plane`] relative to the sum of the absolute products: 8 roundings of 2^-53, doubled.
const PLANE_ERROR: f64 = 16.0 / (1u64 << 53) as f64;

/// The side of the plane through a, b and c on which the point lies; positive in the direction of (b-a)×(c-a).
fn side_of_plane([a, b, c]: [[f32; 3]; 3], point: [f64; 3]) -> Sign {
    let from = |p: [f32; 3]| [0, 1, 2].map(|k| f64::from(p[k]) - point[k]);
    let (a, b, c) = (from(a), from(b), from(c));
    let (mut volume, mut size) = (0.0, 0.0);
    for (i, j, k) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
        let (x, y) = (b[j] * c[k], b[k] * c[j]);
        volume += a[i] * (x - y);
        size += a[i].abs() * (x.abs() + y.abs());
    }
    // det[a-p, b-p, c-p] is positive behind the plane.
    if volume < -PLANE_ERROR * size {
        Sign::Positive
    } else if volume > PLANE_ERROR * size {
        Sign::Negative
    } else {
        Sign::Uncertain
    }
}

/// For each vertex of a positively oriented tetrahedron the opposite face, with its normal towards the vertex.
const FACES: [[usize; 3]; 4] = [[1, 3, 2], [0, 2, 3], [0, 3, 1], [0, 1, 2]];

impl TetSpace<'_> {
    /// The position from which a ray walks that starts near the constrained face `row`: the tetrahedron that holds its origin, and the
    /// face through which its line enters that. `None` if a sign is uncertain, if the origin lies outside of the leaf, or if it is
    /// more than MAX_STEPS tetrahedra away.
    pub(crate) fn locate(&self, row: u32) -> Option<TetPosition> {
        let start: &TetFace = &self.faces[row as usize];
        let [a, b, c] = start.vertex;
        let side = match side_of_plane(start.vertex.map(|v| self.position(v)), self.line.origin) {
            Sign::Positive => 0,
            Sign::Negative => 1,
            Sign::Uncertain => return None,
        };
        let mut tet = start.tet[side];
        let apex = start.opposite[side];
        // Positively oriented: the last vertex lies on the positive side of the first three.
        let mut vertex = if side == 0 { [a, b, c, apex] } else { [a, c, b, apex] };
        // The apex of `entered` is always vertex[3].
        let mut entered = Entered { face: [vertex[0], vertex[1], vertex[2]], apex, behind: FACE_BIT | row };
        'steps: for _ in 0..MAX_STEPS {
            for out in 0..3 {
                let face = FACES[out].map(|i| vertex[i]);
                match side_of_plane(face.map(|v| self.position(v)), self.line.origin) {
                    Sign::Positive => continue,
                    Sign::Uncertain => return None,
                    Sign::Negative => {}
                }
                let link = self.records.link(tet, &entered, vertex[out]);
                let (next, apex, behind) = self.beyond(tet, link, face)?;
                // Seen from the next tetrahedron the orientation of the face is reversed.
                vertex = [face[0], face[2], face[1], apex];
                entered = Entered { face: [vertex[0], vertex[1], vertex[2]], apex, behind };
                tet = next;
                continue 'steps;
            }
            return self.entry_of_line(tet, vertex, &entered);
        }
        None
    }

    /// The position in `tet` at the face through which the line enters it.
    fn entry_of_line(&self, tet: u32, vertex: [u32; 4], entered: &Entered) -> Option<TetPosition> {
        let projected: [Projected; 4] = vertex.map(|v| self.project(v));
        for (apex, indices) in FACES.iter().enumerate() {
            let corner = indices.map(|i| projected[i]);
            if (0..3).any(|i| Line::side(&corner[i], &corner[(i + 1) % 3], self.error) != Sign::Positive) {
                continue;
            }
            let behind = match vertex[apex] == entered.apex {
                true => entered.behind,
                false => self.records.link(tet, entered, vertex[apex]).next,
            };
            let entered = Entered { face: indices.map(|i| vertex[i]), apex: vertex[apex], behind };
            return Some(TetPosition { tet, entered, corner });
        }
        None
    }
}
