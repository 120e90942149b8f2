//! Where a ray that starts on a known surface is among the tetrahedra: a walk from the surface's
//! own tetrahedron towards the origin, usually of no step or one.

use super::records::{Entered, ReadRecords};
use super::walk::{TetPosition, TetSpace};
use crate::intersect::line::{Line, Projected, Sign};
use bth_format::layout::{FACE_BIT, TetFace};

/// Steps after which the surface counts as a bad hint and the ray is traced without it.
const MOST_STEPS: u32 = 64;
/// Bound on the error of [`side_of_plane`] in units of the sum of the absolute products: 8 roundings of
/// 2^-53, doubled.
const PLANE_ERROR: f64 = 16.0 / (1u64 << 53) as f64;

/// On which side of the plane through a, b, c the point is; positive where (b-a)×(c-a) points.
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

/// Faces opposite to each vertex of a positively oriented tetrahedron, oriented to that vertex.
const FACES: [[usize; 3]; 4] = [[1, 3, 2], [0, 2, 3], [0, 3, 1], [0, 1, 2]];

impl TetSpace<'_> {
    /// The place from which to walk for a ray that starts near a constrained face: in the tetrahedron that
    /// holds its origin, at the face through which the line came in. `None` if any sign on the way is
    /// uncertain, the origin lies outside the leaf, or it is too far off.
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
        'steps: for _ in 0..MOST_STEPS {
            for out in 0..3 {
                let face = FACES[out].map(|i| vertex[i]);
                match side_of_plane(face.map(|v| self.position(v)), self.line.origin) {
                    Sign::Positive => continue,
                    Sign::Uncertain => return None,
                    Sign::Negative => {}
                }
                let link = self.records.link(tet, &entered, vertex[out]);
                let (next, apex, behind) = self.beyond(tet, link, face)?;
                // OriginTerms from the other side the face turns around.
                vertex = [face[0], face[2], face[1], apex];
                entered = Entered { face: [vertex[0], vertex[1], vertex[2]], apex, behind };
                tet = next;
                continue 'steps;
            }
            return self.face_behind(tet, vertex, &entered);
        }
        None
    }

    /// The place in `tet` at the face through which the line enters it.
    fn face_behind(&self, tet: u32, vertex: [u32; 4], entered: &Entered) -> Option<TetPosition> {
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
