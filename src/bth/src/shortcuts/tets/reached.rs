//! The exact test of constrained faces that lanes have reached, sixteen at a time in f64, and
//! whether the walks of their rays go on.
//!
//! Whatever f64 does not decide is decided for one ray at a time ([`super::decide`]), so answers
//! have the same bits.

use super::batch::WalkBatch;
use super::exit_lanes::Exits;
use super::lanes::Lanes;
use super::queue::PreparedWalks;
use super::walk::{Entered, WalkOutcome};
use super::walks::{Reached, WalkStart, Walks, vertices};
use crate::intersect::exact_lanes::{Estimates, F32Lanes, Pairs};
use crate::intersect::prepare::gather_rays;
use crate::query::TriangleRef;
use crate::simd::{LANES, Part, Simd};
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

/// Sixteen faces and the rays that have reached them.
struct Faces<S: Simd> {
    /// Lanes that hold one.
    all: u32,
    /// Indices of the rays in the batch.
    ray: [u32; LANES],
    origin: [S::F; 3],
    direction: [S::F; 3],
    /// The fields of [`bth_format::layout::TetFace`], and the corners' positions.
    vertex: [S::U; 3],
    triangle: S::U,
    tet: [S::U; 2],
    opposite: [S::U; 2],
    corner: [[S::F; 3]; 3],
}

impl<S: Simd> Faces<S> {
    #[inline(always)]
    fn read(s: S, walks: &Walks<'_>, reached: &[Reached]) -> Self {
        let all = (1u32 << reached.len()) - 1;
        let [mut ray, mut face] = [[0; LANES]; 2];
        for (lane, reached) in reached.iter().enumerate().take(LANES) {
            (ray[lane], face[lane]) = (reached.ray, reached.face);
        }
        let m = s.mask(all);
        let rows = walks.object.tet_faces.as_bytes();
        let rows = <[[u32; 8]]>::ref_from_bytes(rows).ok().expect("a face is eight words");
        let [v0, v1, v2, triangle, above, below, opposite_above, opposite_below] =
            s.rows8(m, rows, s.load_u(&face));
        let [ox, oy, oz, _, dx, dy, dz, _] = gather_rays(s, m, walks.rays, s.load_u(&ray));
        let vertex = [v0, v1, v2];
        let mut corner = [[s.splat(0.0); 3]; 3];
        for k in 0..3 {
            let [x, y, z, _] = s.rows4(m, vertices(walks.object), vertex[k]);
            corner[k] = [x, y, z];
        }
        Faces {
            all,
            ray,
            origin: [ox, oy, oz],
            direction: [dx, dy, dz],
            vertex,
            triangle,
            tet: [above, below],
            opposite: [opposite_above, opposite_below],
            corner,
        }
    }

    #[inline(always)]
    fn estimates(&self, s: S) -> Estimates {
        let mut pairs = Pairs::NONE;
        store(s, self.origin, &mut pairs.origin);
        store(s, self.direction, &mut pairs.direction);
        for k in 0..3 {
            store(s, self.corner[k], &mut pairs.corner[k]);
        }
        Estimates::new(s, &pairs)
    }

    /// What lies behind the faces of the lanes `open`, given the lanes whose rays pass `against`
    /// the normals of the faces.
    #[inline(always)]
    fn behind(&self, s: S, walks: &Walks<'_>, open: u32, against: u32) -> Behind {
        let against = s.mask(against);
        let mut behind =
            Behind { exits: Exits::NONE, tet: [0; LANES], apex: [0; LANES], face: [[0; LANES]; 3] };
        let apex = s.select_u(against, self.opposite[1], self.opposite[0]);
        s.store_u(apex, &mut behind.apex);
        s.store_u(s.select_u(against, self.tet[1], self.tet[0]), &mut behind.tet);
        s.store_u(self.vertex[0], &mut behind.face[0]);
        s.store_u(s.select_u(against, self.vertex[2], self.vertex[1]), &mut behind.face[1]);
        s.store_u(s.select_u(against, self.vertex[1], self.vertex[2]), &mut behind.face[2]);
        let axes: Lanes<S> =
            PreparedWalks::of_rays(s, s.mask(self.all), walks.rays, s.load_u(&self.ray)).lanes;
        let Exits { origin, direction, vertex } = &mut behind.exits;
        let [x, y, z, _] = s.rows4(s.mask(open), vertices(walks.object), apex);
        store(s, axes.permute(s, self.origin), origin);
        store(s, axes.permute(s, self.direction), direction);
        store(s, axes.permute(s, self.corner[0]), &mut vertex[0]);
        store(s, axes.permute(s, [x, y, z]), &mut vertex[3]);
        for k in 1..3 {
            let mut either = [s.splat(0.0); 3];
            for axis in 0..3 {
                either[axis] = s.select(against, self.corner[3 - k][axis], self.corner[k][axis]);
            }
            store(s, axes.permute(s, either), &mut vertex[k]);
        }
        behind
    }
}

/// Sixteen faces behind which walks may go on: the tetrahedra there, and the words that the walks
/// begin with.
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
    /// Tests constrained faces that the lines of their rays certainly cross, and ends walks or
    /// returns rays to the lanes in the tetrahedra behind the faces.
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
        let faces = Faces::read(s, &self.walks, reached);
        let estimates = faces.estimates(s);
        let mut triangle = [0; LANES];
        s.store_u(faces.triangle, &mut triangle);
        let mut limit = [0.0; LANES];
        let mut open = self.offer(&faces.ray, &triangle, &estimates, faces.all, &mut limit);
        let mut uncertain = faces.all & !estimates.certain;
        while uncertain != 0 {
            let lane = uncertain.trailing_zeros() as usize % LANES;
            uncertain &= uncertain - 1;
            self.test_face(reached[lane]);
        }
        if open == 0 {
            return;
        }
        let behind = faces.behind(s, &self.walks, open, estimates.against_normal());
        let t_before = behind.exits.t_before();
        while open != 0 {
            let lane = open.trailing_zeros() as usize % LANES;
            open &= open - 1;
            let ray = faces.ray[lane];
            // No face further along the line can change the result if the line certainly leaves the
            // tetrahedron beyond the limit.
            if t_before[lane] > limit[lane] {
                self.walks.finish(ray, WalkOutcome::Left);
                continue;
            }
            let entered = Entered {
                face: [behind.face[0][lane], behind.face[1][lane], behind.face[2][lane]],
                apex: behind.apex[lane],
            };
            self.return_to_lanes(WalkStart { ray, tet: behind.tet[lane], entered });
        }
    }

    /// Offers those intersections of the lanes `all` that are certain, with triangles given by
    /// their ids, to the queries of the rays. Returns the bits of the rays whose walks may go on,
    /// with the limits of their queries.
    fn offer(
        &mut self,
        rays: &[u32; LANES],
        triangles: &[u32; LANES],
        estimates: &Estimates,
        all: u32,
        limit: &mut [f64; LANES],
    ) -> u32 {
        let (mut open, mut certain) = (0, all & estimates.certain);
        while certain != 0 {
            let lane = certain.trailing_zeros() as usize % LANES;
            certain &= certain - 1;
            let query = &mut self.queries[rays[lane] as usize];
            let triangle = TriangleRef::id(triangles[lane], self.walks.object.triangle_ids);
            if query.offer(triangle, estimates.intersection(lane)) {
                self.walks.finish(rays[lane], WalkOutcome::Done);
            } else {
                limit[lane] = query.limit();
                open |= 1 << lane;
            }
        }
        open
    }
}
