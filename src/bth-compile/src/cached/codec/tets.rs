//! Bytes of a tetrahedralization.

use super::super::rows::{RowReader, Sink};
use super::Codec;
use crate::tets::{Behind, Face, TetMesh};

/// The flag of a constrained face in the number that encodes the neighbour across a face: a
/// tetrahedron, 2³¹ + a constrained face, or all bits set for the hull.
const FACE: u32 = 1 << 31;
const HULL: u32 = u32::MAX;

/// In the cache the faces of a tetrahedralization refer to triangles by their number within the
/// node.
impl Codec for TetMesh {
    fn write(&self, to: &mut impl Sink) {
        let code = |behind: &Behind| match *behind {
            Behind::Tet(tet) => tet,
            Behind::Face(face) => FACE | face,
            Behind::Hull => HULL,
        };
        to.add(&[self.lower, self.upper]);
        to.add(&self.vertices);
        to.add(&self.tets);
        to.add(&self.behind.iter().map(|b| b.each_ref().map(code)).collect::<Vec<_>>());
        let face = |f: &Face| [f.triangle, f.vertex[0], f.vertex[1], f.vertex[2], f.tet[0], f.tet[1]];
        to.add(&self.faces.iter().map(face).collect::<Vec<_>>());
        to.add(&[self.steiner_points]);
    }

    fn read(from: &mut RowReader<'_>) -> Option<Self> {
        let bounds: Vec<[f32; 3]> = from.take()?;
        let [lower, upper] = *bounds.as_slice() else { return None };
        let (vertices, tets): (Vec<[f32; 3]>, Vec<[u32; 4]>) = (from.take()?, from.take()?);
        let behind: Vec<[u32; 4]> = from.take()?;
        let faces: Vec<[u32; 6]> = from.take()?;
        let steiner_points = from.one()?;
        let vertex = |v: u32| (v as usize) < vertices.len();
        let tet = |t: u32| (t as usize) < tets.len();
        let link = |code: u32| match code {
            HULL => Some(Behind::Hull),
            code if code & FACE == 0 => tet(code).then_some(Behind::Tet(code)),
            code => ((code ^ FACE) < faces.len() as u32).then_some(Behind::Face(code ^ FACE)),
        };
        let links = |[a, b, c, d]: [u32; 4]| Some([link(a)?, link(b)?, link(c)?, link(d)?]);
        let behind: Vec<[Behind; 4]> = behind.into_iter().map(links).collect::<Option<_>>()?;
        let face = |[triangle, a, b, c, front, back]: [u32; 6]| {
            let fits = [a, b, c].into_iter().all(vertex) && tet(front) && tet(back);
            fits.then_some(Face { triangle, vertex: [a, b, c], tet: [front, back] })
        };
        let faces: Vec<Face> = faces.iter().copied().map(face).collect::<Option<_>>()?;
        let fits = behind.len() == tets.len() && tets.as_flattened().iter().all(|v| vertex(*v));
        fits.then_some(TetMesh { lower, upper, vertices, tets, behind, faces, steiner_points })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{decode, encode};
    use super::*;

    #[test]
    fn tetrahedralizations_come_back_and_links_to_nowhere_do_not() {
        let mesh = TetMesh {
            lower: [0.0; 3],
            upper: [1.0; 3],
            vertices: vec![[0.0; 3]; 5],
            tets: vec![[0, 1, 2, 3], [1, 2, 3, 4]],
            behind: vec![
                [Behind::Face(0), Behind::Hull, Behind::Hull, Behind::Hull],
                [Behind::Hull, Behind::Hull, Behind::Hull, Behind::Tet(0)],
            ],
            faces: vec![Face { triangle: 0, vertex: [1, 2, 3], tet: [0, 1] }],
            steiner_points: 2,
        };
        assert_eq!(decode::<TetMesh>(&encode(&mesh)), Some(mesh.clone()));
        let mut other = mesh.clone();
        other.behind[0][0] = Behind::Face(1);
        assert_eq!(decode::<TetMesh>(&encode(&other)), None);
        let mut other = mesh.clone();
        other.faces[0].tet[1] = 2;
        assert_eq!(decode::<TetMesh>(&encode(&other)), None);
        let mut other = mesh;
        other.tets[1][3] = 5;
        assert_eq!(decode::<TetMesh>(&encode(&other)), None);
    }
}
