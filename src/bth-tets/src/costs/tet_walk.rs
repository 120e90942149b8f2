//! Rays through a tetrahedralization in double precision, to count their steps.
//!
//! A ray through an edge may take one step more or less than in the runtime.

use crate::{Behind, TetMesh};
use bth_bvh::sampling::SampleRay;
use bth_bvh::sampling::crosses;
use bth_bvh::vectors::double_area;
use glam::DVec3;

/// Result of a walk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Walked {
    /// Tetrahedra that the ray passes through.
    pub steps: u32,
    /// True if the ray ended at a triangle.
    pub hit: bool,
    /// True if the ray left the box; the traversal of the BVH then continues.
    pub left: bool,
}

/// A tetrahedralization, ready to be walked.
#[derive(Clone, Debug)]
pub struct TetWalker<'a> {
    mesh: &'a TetMesh,
    /// Tetrahedra at the hull, with the vertex opposite to the hull's face.
    hull: Vec<(u32, usize)>,
    /// Rows of faces by triangle id, ascending.
    face_of: Vec<(u32, u32)>,
}

impl<'a> TetWalker<'a> {
    /// Finds the hull faces and the rows of the triangles' faces, where walks begin.
    pub fn new(mesh: &'a TetMesh) -> Self {
        let hulls = |(t, behind): (usize, &[Behind; 4])| {
            let hull = behind.map(|b| b == Behind::Hull);
            (0..4).filter(move |k| hull[*k]).map(move |k| (t as u32, k))
        };
        let mut face_of: Vec<(u32, u32)> =
            mesh.faces.iter().enumerate().map(|(row, face)| (face.triangle, row as u32)).collect();
        face_of.sort_unstable();
        let hull = mesh.behind.iter().enumerate().flat_map(hulls).collect();
        TetWalker { mesh, hull, face_of }
    }

    fn corner(&self, tet: u32, k: usize) -> DVec3 {
        self.mesh.vertices[self.mesh.tets[tet as usize][k] as usize].map(f64::from).into()
    }

    /// Corners of the face opposite to vertex `k`.
    fn face(&self, tet: u32, k: usize) -> [DVec3; 3] {
        [1, 2, 3].map(|i| self.corner(tet, (k + i) % 4))
    }

    /// The walk of a ray: from its triangle if that is one of the node's, else from where it enters
    /// the box; `None` if it misses the box.
    pub fn walk(&self, ray: &SampleRay) -> Option<Walked> {
        let start = ray.from.and_then(|triangle| {
            let row = self.face_of.binary_search_by_key(&triangle, |(id, _)| *id).ok()?;
            let row = self.face_of[row].1;
            let face = &self.mesh.faces[row as usize];
            let corners = face.vertex.map(|v| self.mesh.vertices[v as usize].map(f64::from).into());
            let front = double_area(corners).dot(ray.direction.into()) > 0.0;
            let tet = face.tet[usize::from(!front)];
            let k = self.mesh.behind[tet as usize].iter().position(|b| *b == Behind::Face(row))?;
            Some((tet, k))
        });
        let (tet, k) = match start {
            Some(start) => start,
            None => self.entry(ray)?,
        };
        Some(self.go(ray, tet, k))
    }

    /// The tetrahedron and hull face at which a ray from outside enters: the nearest that it hits.
    fn entry(&self, ray: &SampleRay) -> Option<(u32, usize)> {
        let mut best: Option<(f64, (u32, usize))> = None;
        for &(tet, k) in &self.hull {
            let limit = best.map_or(ray.tmax, |b| b.0);
            if let Some(t) = crosses(ray, self.face(tet, k), limit) {
                best = Some((t, (tet, k)));
            }
        }
        best.map(|b| b.1)
    }

    fn go(&self, ray: &SampleRay, mut tet: u32, mut entered: usize) -> Walked {
        let (origin, direction) = (DVec3::from(ray.origin), DVec3::from(ray.direction));
        for steps in 1..=self.mesh.tets.len() as u32 {
            // The ray leaves through the nearest of the planes that it crosses outwards.
            let mut out = (f64::INFINITY, entered);
            for k in (0..4).filter(|k| *k != entered) {
                let [a, b, c] = self.face(tet, k);
                let normal = double_area([a, b, c]);
                let inner = normal.dot(self.corner(tet, k) - a);
                let outward = -normal.dot(direction) * inner.signum();
                if outward > 0.0 {
                    let t = normal.dot(a - origin) / normal.dot(direction);
                    out = if t < out.0 { (t, k) } else { out };
                }
            }
            if out.0 > ray.tmax || out.0 == f64::INFINITY {
                return Walked { steps, hit: false, left: false };
            }
            match self.mesh.behind[tet as usize][out.1] {
                Behind::Face(_) => return Walked { steps, hit: true, left: false },
                Behind::Hull => return Walked { steps, hit: false, left: true },
                Behind::Tet(next) => {
                    let back = self.mesh.behind[next as usize].iter().position(|b| *b == Behind::Tet(tet));
                    (tet, entered) = (next, back.unwrap_or(0));
                }
            }
        }
        Walked { steps: self.mesh.tets.len() as u32, hit: false, left: true }
    }
}
