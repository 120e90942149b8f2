//! Files that pass all checks of [`bth::open`] and make rays as slow as a file can.

use super::valid::{TetParts, file};
use bth_compile::memory::{PositionRows, TriangleMesh};
use bth_compile::pipeline::{CompileOptions, Structure, compile_cached};
use bth_compile::write::{ObjectParts, Source};
use bth_compile::{Silent, cached::Cache};
use bth_format::layout::*;

/// Triangles through one line, the z axis: a ray along it hits all of their boxes at once.
pub fn bundle(triangles: u32) -> Vec<u8> {
    let corner = |i: u32, turn: f32| {
        let angle = i as f32 / triangles as f32 + turn;
        [angle.cos(), angle.sin(), turn - 2.0]
    };
    let positions: Vec<_> =
        (0..triangles).flat_map(|i| [0.0, 2.1, 4.2].map(|turn| corner(i, turn))).collect();
    let rows: Vec<_> = (0..triangles).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let mesh = TriangleMesh { positions: PositionRows::F32(&positions), triangles: &rows };
    let options = CompileOptions { structure: Structure::Bvh, ..CompileOptions::default() };
    let compiled = compile_cached(mesh, &options, &Cache::none(), &|_| true, &Silent).expect("it compiles");
    compiled.content.expect("bytes").bytes().expect("bytes in memory").into_owned()
}

/// A strip of tetrahedra whose vertices, but for the last, lie on the x axis: a line along it may
/// touch all faces, so that no sign tells where it leaves a tetrahedron.
pub fn strip(tets: u32) -> Vec<u8> {
    let mut points: Vec<_> = (0..tets + 2).map(|i| [i as f32 / tets as f32, 0.0, 0.0]).collect();
    points.push([2.0, 1.0, 1.0]);
    let mut parts = TetParts {
        vertices: points.iter().map(|p| TetVertex { position: *p, reserved: 0 }).collect(),
        faces: vec![TetFace { vertex: [1, 2, 3], triangle: 0, tet: [0, 1], opposite: [0, 4] }],
        ..TetParts::default()
    };
    for t in 0..tets {
        let vertices = [t, t + 1, t + 2, t + 3];
        let (mut next, mut opposite) = ([NONE; 4], [NONE; 4]);
        if t + 1 < tets {
            (next[0], opposite[0]) = (if t == 0 { FACE_BIT } else { t + 1 }, t + 4);
        }
        if t > 0 {
            (next[3], opposite[3]) = (if t == 1 { FACE_BIT } else { t - 1 }, t - 1);
        }
        for slot in (0..4).filter(|slot| next[*slot] == NONE) {
            let face: Vec<u32> = vertices.into_iter().filter(|v| *v != vertices[slot]).collect();
            let vertex = [face[0], face[1], face[2]];
            parts.hulls.push(HullFace { vertex, tet: t, opposite: vertices[slot] });
        }
        parts.push_record(next, opposite);
    }
    parts.leaves = vec![TetLeaf {
        lower: [0.0; 3],
        upper: [2.0, 1.0, 1.0],
        first_tet: 0,
        tets,
        first_vertex: 0,
        vertices: tets + 3,
        first_face: 0,
        faces: 1,
        first_hull: 0,
        hulls: parts.hulls.len() as u32,
        subtree: NONE,
        flags: 0,
    }];
    let triangle = [points[1], points[2], points[3]];
    file(&ObjectParts {
        bounds: Some(([0.0; 3], [2.0, 1.0, 1.0])),
        root: Child::Tets(0).code(),
        triangles: 1,
        tet_leaves: &parts.leaves,
        tets: &parts.records,
        tet_vertices: &parts.vertices,
        tet_faces: &parts.faces,
        hull_faces: &parts.hulls,
        triangle_faces: &[0],
        source: Some(Source { positions: &triangle, triangles: &[[0, 1, 2]], ..Source::default() }),
        ..ObjectParts::default()
    })
}
