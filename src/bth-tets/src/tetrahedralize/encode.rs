//! The file's sections for tet leaves: rows numbered across all leaves.

use bth_format::layout::{FACE_BIT, HullFace, Link, Link32, NONE, TetFace, TetLeaf, TetVertex};
use zerocopy::IntoBytes;

use super::{Behind, TetMesh};

/// Sections of the file; see `bth::layout` for the rows.
#[derive(Clone, Debug, Default)]
pub struct Encoded {
    /// `TET_LEAVES`, one per mesh, in their order.
    pub leaves: Vec<TetLeaf>,
    /// Bytes of `TETS`.
    pub tets: Vec<u8>,
    /// Rows of `TETS`.
    pub tet_count: u32,
    /// `TET_VERTICES`.
    pub vertices: Vec<TetVertex>,
    /// `TET_FACES`.
    pub faces: Vec<TetFace>,
    /// `HULL_FACES`.
    pub hulls: Vec<HullFace>,
    /// `TRIANGLE_FACES`: per triangle of the source its row of `TET_FACES`, or `NONE`.
    pub face_of_triangle: Vec<u32>,
}

/// Encodes meshes as [`super::build()`] returned them, which holds their sum within the format's
/// limits. `triangles` is the number in the source.
///
/// # Panics
/// When a face names a triangle beyond `triangles`.
pub fn encode(meshes: &[TetMesh], triangles: usize) -> Encoded {
    let mut to = Encoded { face_of_triangle: vec![NONE; triangles], ..Encoded::default() };
    let count: usize = meshes.iter().map(|m| m.tets.len()).sum();
    to.tets.reserve_exact(count * size_of::<Link32>());
    for mesh in meshes {
        let base = Base { tet: to.tet_count, vertex: to.vertices.len() as u32, face: to.faces.len() as u32 };
        let first_hull = to.hulls.len() as u32;
        to.vertices.extend(mesh.vertices.iter().map(|&position| TetVertex { position, reserved: 0 }));
        for (row, face) in mesh.faces.iter().enumerate() {
            to.face_of_triangle[face.triangle as usize] = base.face + row as u32;
            to.faces.push(TetFace {
                vertex: face.vertex.map(|v| base.vertex + v),
                triangle: face.triangle,
                tet: face.tet.map(|t| base.tet + t),
                opposite: face.tet.map(|t| base.vertex + apex(mesh.tets[t as usize], face.vertex)),
            });
        }
        for (t, (tet, behind)) in mesh.tets.iter().zip(&mesh.behind).enumerate() {
            to.hulls.extend((0..4).filter(|&k| behind[k] == Behind::Hull).map(|k| {
                let vertex = inwards(mesh, *tet, k).map(|v| base.vertex + v);
                HullFace { vertex, tet: base.tet + t as u32, opposite: base.vertex + tet[k] }
            }));
            let link = std::array::from_fn(|k| base.link(mesh, t, k));
            to.tets.extend_from_slice(Link32 { link }.as_bytes());
        }
        to.tet_count += mesh.tets.len() as u32;
        to.leaves.push(TetLeaf {
            lower: mesh.lower,
            upper: mesh.upper,
            first_tet: base.tet,
            tets: mesh.tets.len() as u32,
            first_vertex: base.vertex,
            vertices: mesh.vertices.len() as u32,
            first_face: base.face,
            faces: mesh.faces.len() as u32,
            first_hull,
            hulls: to.hulls.len() as u32 - first_hull,
            subtree: NONE,
            flags: 0,
        });
    }
    to
}

/// First rows of a leaf in each section.
struct Base {
    tet: u32,
    vertex: u32,
    face: u32,
}

impl Base {
    /// Link of tetrahedron `t` across the face opposite to its vertex `k`.
    fn link(&self, mesh: &TetMesh, t: usize, k: usize) -> Link {
        let (next, beyond) = match mesh.behind[t][k] {
            Behind::Hull => return Link { next: NONE, opposite: NONE },
            Behind::Tet(n) => (self.tet + n, n),
            Behind::Face(f) => {
                let [front, back] = mesh.faces[f as usize].tet;
                (FACE_BIT | (self.face + f), if front as usize == t { back } else { front })
            }
        };
        let tet = mesh.tets[t];
        let face = [tet[(k + 1) % 4], tet[(k + 2) % 4], tet[(k + 3) % 4]];
        Link { next, opposite: self.vertex + apex(mesh.tets[beyond as usize], face) }
    }
}

/// The vertex of a tetrahedron that does not belong to a face of it.
fn apex(tet: [u32; 4], face: [u32; 3]) -> u32 {
    tet.into_iter().fold(0, |x, v| x ^ v) ^ face[0] ^ face[1] ^ face[2]
}

/// The face opposite to vertex `k`, ordered such that its normal points to that vertex.
fn inwards(mesh: &TetMesh, tet: [u32; 4], k: usize) -> [u32; 3] {
    let [a, b, c] = [tet[(k + 1) % 4], tet[(k + 2) % 4], tet[(k + 3) % 4]];
    let position = |v: u32| mesh.vertices[v as usize];
    if super::orientation::in_front([a, b, c].map(position), position(tet[k])) {
        [a, b, c]
    } else {
        [a, c, b]
    }
}
