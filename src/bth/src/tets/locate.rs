//! Location of the tetrahedron that holds a ray's origin, given a constrained face near the origin.
//!
//! The search starts at the tetrahedron on the origin's side of that face. While the origin lies outside of the tetrahedron, the
//! search moves to the neighbour behind a face that separates the two; most often no step or one is needed.

use super::records::{Entered, ReadRecords};
use super::walk::{TetPosition, TetWalker};
use crate::intersect::line::{Line, Projected, Sign};
use bth_format::layout::{FACE_BIT, TetFace};

/// Greatest number of tetrahedra that are tested; if none of them holds the origin, the ray is traced without the hint.
const MAX_STEPS: u32 = 64;
/// Bound of the error of [`side_of_plane`] relative to the sum of the absolute products: 8 roundings of 2^-53, doubled.
const PLANE_ERROR: f64 = 16.0 / (1u64 << 53) as f64;
/// A triangle that is crossed at a t between this and 0 behind the origin may count as hit at t = 0, to which f32 rounds it. Any value from 2^-150
/// on is correct.
const LEAST_T: f64 = f32::MIN_POSITIVE as f64;

/// The side of the plane through a, b and c on which `point` lies, in object space; positive in the direction of (b-a)×(c-a).
fn side_of_plane([a, b, c]: [[f32; 3]; 3], point: [f64; 3]) -> Sign {
    let relative_to_point = |p: [f32; 3]| [0, 1, 2].map(|k| f64::from(p[k]) - point[k]);
    let (a, b, c) = (relative_to_point(a), relative_to_point(b), relative_to_point(c));
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

/// For each vertex of a positively oriented tetrahedron the indices of the corners of the opposite face, ordered so that the
/// normal of the face points to the vertex.
const FACES: [[usize; 3]; 4] = [[1, 3, 2], [0, 2, 3], [0, 3, 1], [0, 1, 2]];

impl TetWalker<'_> {
    /// The position at which the walk of a ray begins whose origin is near the constrained face with index `face_index`: the
    /// tetrahedron that holds the origin, and the face through which the line enters that tetrahedron. `None` if a sign is
    /// uncertain, if the origin lies outside of the leaf, or if it is not found within [`MAX_STEPS`] tetrahedra.
    pub(crate) fn locate(&self, face_index: u32) -> Option<TetPosition> {
        let constrained: &TetFace = &self.faces[face_index as usize];
        let [a, b, c] = constrained.vertex;
        let side = match side_of_plane(constrained.vertex.map(|v| self.position(v)), self.line.origin) {
            Sign::Positive => 0,
            Sign::Negative => 1,
            Sign::Uncertain => return None,
        };
        let mut tet = constrained.tet[side];
        let apex = constrained.opposite[side];
        // The tetrahedron is positively oriented: the last vertex lies on the positive side of the plane through the first three.
        let mut vertex = if side == 0 { [a, b, c, apex] } else { [a, c, b, apex] };
        // The apex of `entered` is always vertex[3]. The origin is on the inner side of the face opposite to it, so only the
        // faces opposite to the other three vertices are tested.
        let mut entered =
            Entered { face: [vertex[0], vertex[1], vertex[2]], apex, behind: FACE_BIT | face_index };
        'steps: for _ in 0..MAX_STEPS {
            for crossed in 0..3 {
                let face = FACES[crossed].map(|i| vertex[i]);
                match side_of_plane(face.map(|v| self.position(v)), self.line.origin) {
                    Sign::Positive => continue,
                    Sign::Uncertain => return None,
                    Sign::Negative => {}
                }
                let link = self.records.link(tet, &entered, vertex[crossed]);
                let (next, apex, behind) = self.beyond(tet, link, face)?;
                // As seen from the next tetrahedron, the orientation of the face is reversed.
                vertex = [face[0], face[2], face[1], apex];
                entered = Entered { face: [vertex[0], vertex[1], vertex[2]], apex, behind };
                tet = next;
                continue 'steps;
            }
            return self.entry_of_line(tet, vertex, &entered);
        }
        None
    }

    /// The position in `tet` at the face through which the line enters it: the face whose three edges the line passes on the
    /// positive side. `None` if no face certainly is that one, or if a triangle before the face might be hit at a t that is rounded to 0.
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
            let t = self.line.t_after(corner.each_ref(), self.error);
            if t.is_nan() || t >= -LEAST_T {
                return None;
            }
            let entered = Entered { face: indices.map(|i| vertex[i]), apex: vertex[apex], behind };
            return Some(TetPosition { tet, entered, corner });
        }
        None
    }
}
