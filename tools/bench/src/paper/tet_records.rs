//! The paper's tetrahedra for a scalar walk: Tet32 and Tet20 (Aman et al. 2021).

use bth_compile::tets::{Behind, TetMesh};

/// Marks a link to a constrained face.
pub(super) const FACE: u32 = 1 << 31;
/// A link to nothing: the hull.
pub(super) const HULL: u32 = u32::MAX;

/// A record: the fourth vertex from three, and what is behind the face opposite to each vertex. The
/// vertices are in ascending order. Tet32 stores three of them, too.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(super) struct TetRecord<const STORED: usize> {
    stored: [u32; STORED],
    /// Exclusive or of all four vertices.
    pub(super) xor: u32,
    /// Links, by the rank of the opposite vertex.
    pub(super) next: [u32; 4],
}

/// Stored vertices of Tet32.
pub(super) const TET32: usize = 3;
/// Stored vertices of Tet20.
pub(super) const TET20: usize = 0;

const _: () = assert!(size_of::<TetRecord<TET32>>() == 32 && size_of::<TetRecord<TET20>>() == 20);

/// A face of the hull: its corners, and the tetrahedron inside.
#[derive(Clone, Copy, Debug)]
pub(super) struct HullFace {
    pub(super) vertex: [u32; 3],
    pub(super) tet: u32,
}

/// A tetrahedralization in a record; rows count within it.
#[derive(Clone, Debug)]
pub(super) struct Tets<const STORED: usize> {
    pub(super) records: Vec<TetRecord<STORED>>,
    pub(super) vertices: Vec<[f32; 3]>,
    /// Triangle and vertices of each constrained face, and its tetrahedra.
    pub(super) faces: Vec<(u32, [u32; 3], [u32; 2])>,
    pub(super) hull: Vec<HullFace>,
    /// Vertices of the tetrahedra, to find the one that holds the camera.
    pub(super) corners: Vec<[u32; 4]>,
}

impl<const STORED: usize> Tets<STORED> {
    pub(super) fn new(mesh: &TetMesh) -> Tets<STORED> {
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
            let stored = std::array::from_fn(|k| tet[k]);
            records.push(TetRecord { stored, xor: tet.iter().fold(0, |x, v| x ^ v), next });
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
