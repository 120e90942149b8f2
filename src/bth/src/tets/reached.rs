//! The exact test of constrained faces that lanes have reached, sixteen at a time in f64, and whether the walks of their rays go on.
//!
//! Whatever f64 does not decide is decided for one ray at a time ([`super::decide`]), so answers have the same bits.

use super::batch::WalkBatch;
use super::exit_lanes::Exits;
use super::lanes::Lanes;
use super::queue::PreparedWalks;
use super::records::Entered;
use super::walk::WalkOutcome;
use super::walks::{Reached, WalkStart, vertices};
use crate::intersect::exact_lanes::{Estimates, F32Lanes, Pairs};
use crate::intersect::prepare::gather_rays;
use crate::query::{Query, TriangleRef};
use crate::simd::{LANES, Part, Simd};
use bth_format::layout::FACE_BIT;
use zerocopy::{FromBytes, IntoBytes};

/// [`WalkBatch::test_sixteen`] as a part of kernels.
pub(super) struct TestFaces<'a, 'b> {
    pub(super) batch: &'a mut WalkBatch<'b>,
    /// At least one face, and at most sixteen.
    pub(super) reached: &'a [Reached],
}

impl<S: Simd> Part<S> for TestFaces<'_, '_> {
    type Output = ();
    #[inline(always)]
    fn run(self, s: S) {
        self.batch.test_sixteen(s, self.reached);
    }
}

/// Sixteen faces behind which walks may go on: the tetrahedra there, and the words that the walks begin with.
struct Behind {
    exits: Exits,
    tet: [u32; LANES],
    apex: [u32; LANES],
    /// Vertices of the faces, counterclockwise along the ray.
    face: [[u32; LANES]; 3],
}

#[inline(always)]
fn store<S: Simd>(s: S, from: [S::F; 3], to: &mut [F32Lanes; 3]) {
    for k in 0..3 {
        s.store(from[k], &mut to[k]);
    }
}

impl WalkBatch<'_> {
    /// Tests constrained faces that the lines of their rays certainly cross, and ends walks or returns rays to the lanes in the
    /// tetrahedra behind the faces.
    #[inline(always)]
    pub(super) fn test_reached_faces<S: Simd>(&mut self, s: S) {
        let mut reached = std::mem::take(self.walks.reached);
        for reached in reached.chunks(LANES) {
            s.call(TestFaces { batch: self, reached });
        }
        reached.clear();
        // Faces that were added during the tests are kept.
        reached.append(self.walks.reached);
        *self.walks.reached = reached;
    }

    #[inline(always)]
    fn test_sixteen<S: Simd>(&mut self, s: S, reached: &[Reached]) {
        let all = (1u32 << reached.len()) - 1;
        let m = s.mask(all);
        let [mut ray, mut face] = [[0; LANES]; 2];
        for (lane, reached) in reached.iter().enumerate().take(LANES) {
            (ray[lane], face[lane]) = (reached.ray, reached.face);
        }
        let faces = self.walks.object.tet_faces.as_bytes();
        let faces = <[[u32; 8]]>::ref_from_bytes(faces).ok().expect("a face is eight words");
        let vertices = vertices(self.walks.object);
        // The fields of a `TetFace`, in their order.
        let [v0, v1, v2, triangle, above, below, apex_above, apex_below] = s.rows8(m, faces, s.load_u(&face));
        let [ox, oy, oz, _, dx, dy, dz, _] = gather_rays(s, m, self.walks.rays, s.load_u(&ray));
        let (origin, direction, face_vertex) = ([ox, oy, oz], [dx, dy, dz], [v0, v1, v2]);
        let mut corner = [[s.splat(0.0); 3]; 3];
        let mut pairs = Pairs::NONE;
        for k in 0..3 {
            let [x, y, z, _] = s.rows4(m, vertices, face_vertex[k]);
            corner[k] = [x, y, z];
            store(s, corner[k], &mut pairs.corner[k]);
        }
        store(s, origin, &mut pairs.origin);
        store(s, direction, &mut pairs.direction);
        let estimates = Estimates::new(s, &pairs);

        let mut ids = [0; LANES];
        s.store_u(triangle, &mut ids);
        let mut limit = [0.0; LANES];
        let (mut open, mut bits) = (0u32, all);
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize % LANES;
            bits &= bits - 1;
            if estimates.certain >> lane & 1 == 0 {
                self.test_face(reached[lane]);
                continue;
            }
            let query = &mut self.queries[ray[lane] as usize];
            let triangle = TriangleRef::id(ids[lane], self.walks.object.triangle_ids);
            if query.offer(triangle, estimates.intersection(lane)) {
                self.walks.finish(ray[lane], WalkOutcome::Done);
            } else {
                limit[lane] = query.limit();
                open |= 1 << lane;
            }
        }
        if open == 0 {
            return;
        }

        let against = s.mask(estimates.against_normal());
        let mut behind =
            Behind { exits: Exits::NONE, tet: [0; LANES], apex: [0; LANES], face: [[0; LANES]; 3] };
        let apex = s.select_u(against, apex_below, apex_above);
        s.store_u(apex, &mut behind.apex);
        s.store_u(s.select_u(against, below, above), &mut behind.tet);
        s.store_u(v0, &mut behind.face[0]);
        s.store_u(s.select_u(against, v2, v1), &mut behind.face[1]);
        s.store_u(s.select_u(against, v1, v2), &mut behind.face[2]);
        let lanes: Lanes<S> = PreparedWalks::of_rays(s, m, self.walks.rays, s.load_u(&ray)).lanes;
        let exits = &mut behind.exits;
        let [x, y, z, _] = s.rows4(s.mask(open), vertices, apex);
        store(s, lanes.permute(s, origin), &mut exits.origin);
        store(s, lanes.permute(s, direction), &mut exits.direction);
        store(s, lanes.permute(s, corner[0]), &mut exits.vertex[0]);
        store(s, lanes.permute(s, [x, y, z]), &mut exits.vertex[3]);
        for k in 1..3 {
            let mut either = [s.splat(0.0); 3];
            for axis in 0..3 {
                either[axis] = s.select(against, corner[3 - k][axis], corner[k][axis]);
            }
            store(s, lanes.permute(s, either), &mut exits.vertex[k]);
        }
        let t_before = exits.t_before();
        while open != 0 {
            let lane = open.trailing_zeros() as usize % LANES;
            open &= open - 1;
            // No face further along the line can change the result if the line certainly leaves the tetrahedron beyond the limit.
            if t_before[lane] > limit[lane] {
                self.walks.finish(ray[lane], WalkOutcome::Left);
                continue;
            }
            let entered = Entered {
                face: [behind.face[0][lane], behind.face[1][lane], behind.face[2][lane]],
                apex: behind.apex[lane],
                behind: face[lane] | FACE_BIT,
            };
            self.return_to_lanes(WalkStart { ray: ray[lane], tet: behind.tet[lane], entered });
        }
    }
}
