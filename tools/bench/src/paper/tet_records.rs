//! The paper's tetrahedra for a scalar walk: Tet32 and Tet20 (Aman et al. 2021).

use bth_compile::tets::{Behind, TetMesh};

/// Marks a link to a constrained face.
pub(super) const FACE: u32 = 1 << 31;
/// A link to nothing: the hull.
pub(super) const HULL: u32 = u32::MAX;

/// A record: the fourth vertex from three, and what lies behind the face opposite to a vertex.
pub(super) trait TetRecord: Copy + Send + Sync {
    /// From vertices in ascending order and the links opposite to them.
    fn new(vertex: [u32; 4], next: [u32; 4]) -> Self;
    /// Exclusive or of all four vertices.
    fn xor(&self) -> u32;
    /// The link opposite to a vertex that is the greatest but so many.
    fn next(&self, rank: usize) -> u32;
}

/// 32 bytes.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(super) struct Tet32 {
    vertex: [u32; 3],
    xor: u32,
    next: [u32; 4],
}

/// 20 bytes.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(super) struct Tet20 {
    xor: u32,
    next: [u32; 4],
}

impl TetRecord for Tet32 {
    fn new(vertex: [u32; 4], next: [u32; 4]) -> Self {
        let [a, b, c, d] = vertex;
        Tet32 { vertex: [a, b, c], xor: a ^ b ^ c ^ d, next }
    }
    #[inline(always)]
    fn xor(&self) -> u32 {
        self.xor
    }
    #[inline(always)]
    fn next(&self, rank: usize) -> u32 {
        self.next[rank & 3]
    }
}

impl TetRecord for Tet20 {
    fn new(vertex: [u32; 4], next: [u32; 4]) -> Self {
        Tet20 { xor: vertex.iter().fold(0, |x, v| x ^ v), next }
    }
    #[inline(always)]
    fn xor(&self) -> u32 {
        self.xor
    }
    #[inline(always)]
    fn next(&self, rank: usize) -> u32 {
        self.next[rank & 3]
    }
}

/// A face of the hull: its corners, and the tetrahedron inside.
#[derive(Clone, Copy, Debug)]
pub(super) struct HullFace {
    pub(super) vertex: [u32; 3],
    pub(super) tet: u32,
}

/// A tetrahedralization in a record; rows count within it.
#[derive(Clone, Debug)]
pub(super) struct Tets<R> {
    pub(super) records: Vec<R>,
    pub(super) vertices: Vec<[f32; 3]>,
    /// Triangle and vertices of each constrained face, and its tetrahedra.
    pub(super) faces: Vec<(u32, [u32; 3], [u32; 2])>,
    pub(super) hull: Vec<HullFace>,
    /// Vertices of the tetrahedra, to find the one that holds the camera.
    pub(super) corners: Vec<[u32; 4]>,
}

impl<R: TetRecord> Tets<R> {
    pub(super) fn new(mesh: &TetMesh) -> Tets<R> {
        let mut hull = Vec::new();
        let mut records = Vec::with_capacity(mesh.tets.len());
        for (t, (tet, behind)) in mesh.tets.iter().zip(&mesh.behind).enumerate() {
            for k in (0..4).filter(|k| behind[*k] == Behind::Hull) {
                let vertex = [1, 2, 3].map(|i| tet[(k + i) % 4]);
                hull.push(HullFace { vertex, tet: t as u32 });
            }
            let next = behind.map(|b| match b {
                Behind::Tet(next) => next,
                Behind::Face(face) => FACE | face,
                Behind::Hull => HULL,
            });
            records.push(R::new(*tet, next));
        }
        let faces = mesh.faces.iter().map(|f| (f.triangle, f.vertex, f.tet)).collect();
        Tets { records, vertices: mesh.vertices.clone(), faces, hull, corners: mesh.tets.clone() }
    }

    /// Bytes that walks read.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.records[..])
            + size_of_val(&self.vertices[..])
            + size_of_val(&self.faces[..])
            + size_of_val(&self.hull[..])
    }
}

const _: () = assert!(size_of::<Tet32>() == 32 && size_of::<Tet20>() == 20);
