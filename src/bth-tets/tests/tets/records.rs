//! Records decode to what was encoded.

use bth_format::layout::{FACE_BIT, Link32, NONE};
use bth_import::Silent;
use bth_tets::{Behind, Encoded, Face, TetMesh, build, encode};
use zerocopy::FromBytes;

use crate::meshes::{bvh, nodes_of_at_most, torus};
use crate::with_worker;

/// Five tetrahedra around one constrained face, shifted along x. They do not fill a box: only their
/// links matter here.
fn five(shift: f32, triangle: u32) -> TetMesh {
    let vertices: Vec<[f32; 3]> =
        (0..8).map(|i| [shift + (i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32]).collect();
    let tets = vec![[0, 1, 2, 4], [0, 1, 2, 3], [0, 1, 4, 5], [0, 2, 4, 6], [1, 2, 3, 7]];
    let hull = [Behind::Hull; 4];
    let mut behind = vec![hull; 5];
    behind[0] = [Behind::Hull, Behind::Tet(3), Behind::Tet(2), Behind::Face(0)];
    behind[1] = [Behind::Tet(4), Behind::Hull, Behind::Hull, Behind::Face(0)];
    behind[2][3] = Behind::Tet(0);
    behind[3][3] = Behind::Tet(0);
    behind[4][3] = Behind::Tet(1);
    let faces = vec![Face { triangle, vertex: [0, 1, 2], tet: [0, 1] }];
    TetMesh {
        lower: [shift, 0.0, 0.0],
        upper: [shift + 1.0, 1.0, 1.0],
        vertices,
        tets,
        behind,
        faces,
        steiner_points: 0,
    }
}

/// Decodes every record by the specification's rules and compares it with the mesh.
fn assert_decodes(meshes: &[TetMesh], encoded: &Encoded) {
    assert_eq!(encoded.tets.len(), encoded.tet_count as usize * size_of::<Link32>());
    assert_eq!(encoded.leaves.len(), meshes.len());
    for (leaf, mesh) in encoded.leaves.iter().zip(meshes) {
        assert_eq!((leaf.lower, leaf.upper), (mesh.lower, mesh.upper));
        let vertices = &encoded.vertices[leaf.first_vertex as usize..][..leaf.vertices as usize];
        assert!(vertices.iter().map(|v| v.position).eq(mesh.vertices.iter().copied()));
        let hulls = &encoded.hulls[leaf.first_hull as usize..][..leaf.hulls as usize];
        assert_eq!(hulls.len(), mesh.behind.as_flattened().iter().filter(|b| **b == Behind::Hull).count());
        for hull in hulls {
            let tet = mesh.tets[(hull.tet - leaf.first_tet) as usize].map(|v| v + leaf.first_vertex);
            let mut all = [hull.vertex[0], hull.vertex[1], hull.vertex[2], hull.opposite];
            all.sort_unstable();
            assert_eq!(all, tet);
        }
        for (row, face) in mesh.faces.iter().enumerate() {
            let record = encoded.faces[leaf.first_face as usize + row];
            assert_eq!(record.vertex, face.vertex.map(|v| v + leaf.first_vertex));
            assert_eq!(record.triangle, face.triangle);
            assert_eq!(encoded.face_of_triangle[face.triangle as usize], leaf.first_face + row as u32);
            for side in 0..2 {
                assert_eq!(record.tet[side], face.tet[side] + leaf.first_tet);
                let tet = mesh.tets[face.tet[side] as usize];
                let apex = tet.into_iter().find(|v| !face.vertex.contains(v)).unwrap();
                assert_eq!(record.opposite[side], apex + leaf.first_vertex);
            }
        }
        for (t, tet) in mesh.tets.iter().enumerate() {
            let (records, rest) = encoded.tets.as_chunks::<{ size_of::<Link32>() }>();
            assert!(rest.is_empty());
            let record = Link32::read_from_bytes(&records[leaf.first_tet as usize + t]).unwrap();
            let next = record.link.map(|l| l.next);
            assert_eq!(next, mesh.behind[t].map(|b| code(b, leaf.first_tet, leaf.first_face)));
            for (k, link) in record.link.into_iter().enumerate() {
                let beyond = match mesh.behind[t][k] {
                    Behind::Hull => None,
                    Behind::Tet(n) => Some(n),
                    Behind::Face(f) => mesh.faces[f as usize].tet.into_iter().find(|&n| n != t as u32),
                };
                let apex = beyond.map(|n| {
                    let face: Vec<u32> = (0..4).filter(|&i| i != k).map(|i| tet[i]).collect();
                    mesh.tets[n as usize].into_iter().find(|v| !face.contains(v)).unwrap()
                });
                assert_eq!(link.opposite, apex.map_or(NONE, |v| v + leaf.first_vertex));
            }
        }
    }
}

fn code(behind: Behind, first_tet: u32, first_face: u32) -> u32 {
    match behind {
        Behind::Tet(t) => first_tet + t,
        Behind::Face(f) => FACE_BIT | (first_face + f),
        Behind::Hull => NONE,
    }
}

#[test]
fn records_decode_to_what_was_encoded() {
    let meshes = [five(0.0, 2), five(4.0, 0)];
    let encoded = encode(&meshes, 4);
    assert_eq!(encoded.face_of_triangle, [1, NONE, 0, NONE]);
    assert_eq!((encoded.leaves[1].first_tet, encoded.leaves[1].first_vertex), (5, 8));
    assert_eq!(encoded.leaves[1].first_face, 1);
    assert_decodes(&meshes, &encoded);
}

#[test]
fn nothing_encodes_to_nothing() {
    let encoded = encode(&[], 3);
    assert_eq!(encoded.face_of_triangle, [NONE; 3]);
    assert!(encoded.leaves.is_empty() && encoded.tets.is_empty() && encoded.hulls.is_empty());
}

#[test]
fn records_of_a_real_tetrahedralization_decode() {
    let Some(options) = with_worker("records") else { return };
    let mesh = torus(30, 15);
    let bvh = bvh(&mesh);
    let (built, _) = build(&mesh, &bvh, &nodes_of_at_most(&bvh, 300), &options, &Silent).unwrap();
    let meshes: Vec<TetMesh> = built.into_iter().map(|(_, m)| m).collect();
    assert!(meshes.len() > 1);
    let encoded = encode(&meshes, mesh.triangles.len());
    assert_decodes(&meshes, &encoded);
    assert!(encoded.face_of_triangle.iter().all(|&row| row != NONE));
    for hull in &encoded.hulls {
        let p = |v: u32| encoded.vertices[v as usize].position.map(f64::from);
        let [a, b, c] = hull.vertex.map(p);
        let d = p(hull.opposite);
        let [e, f, g] = [b, c, d].map(|x| [0, 1, 2].map(|k| x[k] - a[k]));
        let n = [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]];
        assert!(n[0] * g[0] + n[1] * g[1] + n[2] * g[2] > 0.0, "a hull face looks outwards");
    }
}
