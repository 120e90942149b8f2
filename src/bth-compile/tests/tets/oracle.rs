//! Slow, obvious checks of a finished tetrahedralization, independent of the stage's own.

use std::collections::HashMap;

use bth_compile::bvh::BinaryBvh;
use bth_compile::tets::{Behind, TetMesh};
use bth_import::Mesh;
use robust::{Coord3D, orient3d};

use crate::meshes::Random;

fn orientation(a: [f32; 3], b: [f32; 3], c: [f32; 3], d: [f32; 3]) -> f64 {
    let [a, b, c, d] = [a, b, c, d].map(|p| p.map(f64::from)).map(|[x, y, z]| Coord3D { x, y, z });
    orient3d(a, b, c, d)
}

/// Asserts everything that the documentation of `TetMesh` promises for this node.
pub(crate) fn assert_holds(mesh: &Mesh, bvh: &BinaryBvh, node: u32, tets: &TetMesh) {
    let position = |v: u32| tets.vertices[v as usize];
    let node = bvh.nodes[node as usize];
    assert!((0..3).all(|k| tets.lower[k] < node.lower[k] && node.upper[k] < tets.upper[k]));
    assert_eq!(tets.tets.len(), tets.behind.len());

    // Every vertex is used, different from the others and inside the box.
    let mut bits: Vec<_> = tets.vertices.iter().map(|p| p.map(f32::to_bits)).collect();
    bits.sort_unstable();
    assert!(bits.is_sorted_by(|a, b| a < b));
    let mut used = vec![false; tets.vertices.len()];
    tets.tets.as_flattened().iter().for_each(|&v| used[v as usize] = true);
    assert!(used.iter().all(|&u| u));

    // Faces by sorted vertices.
    let mut faces: HashMap<[u32; 3], Vec<(u32, usize)>> = HashMap::new();
    for (t, tet) in tets.tets.iter().enumerate() {
        assert!(tet.is_sorted_by(|a, b| a < b));
        assert_ne!(orientation(position(tet[0]), position(tet[1]), position(tet[2]), position(tet[3])), 0.0);
        for k in 0..4 {
            let mut face: Vec<u32> = tet.to_vec();
            face.remove(k);
            faces.entry([face[0], face[1], face[2]]).or_default().push((t as u32, k));
        }
    }
    let mut constrained = 0;
    let mut hull = 0;
    for (face, sides) in &faces {
        let behind = |side: (u32, usize)| tets.behind[side.0 as usize][side.1];
        let apex = |side: (u32, usize)| position(tets.tets[side.0 as usize][side.1]);
        let side_of =
            |p: [f32; 3]| orientation(position(face[0]), position(face[1]), position(face[2]), p) > 0.0;
        match sides[..] {
            [a] => {
                hull += 1;
                assert_eq!(behind(a), Behind::Hull);
                let on = |k: usize, x: f32| face.iter().all(|&v| position(v)[k] == x);
                assert!((0..3).any(|k| on(k, tets.lower[k]) || on(k, tets.upper[k])));
            }
            [a, b] => {
                assert_ne!(side_of(apex(a)), side_of(apex(b)), "two tetrahedra on one side of a face");
                match behind(a) {
                    Behind::Tet(t) => {
                        assert_eq!(t, b.0);
                        assert_eq!(behind(b), Behind::Tet(a.0));
                    }
                    Behind::Face(f) => {
                        constrained += 1;
                        assert_eq!(behind(b), Behind::Face(f));
                        let f = tets.faces[f as usize];
                        let mut vertex = f.vertex;
                        vertex.sort_unstable();
                        assert_eq!(vertex, *face);
                        let [v0, v1, v2] = f.vertex.map(|v| position(v).map(f64::from));
                        let front = if f.tet[0] == a.0 { a } else { b };
                        let back = if f.tet[0] == a.0 { b } else { a };
                        assert_eq!(f.tet, [front.0, back.0]);
                        // The plain formula, wherever it is certain.
                        let d = |p: [f64; 3]| {
                            let [e, g, h] =
                                [[v1, v0], [v2, v0], [p, v0]].map(|[x, y]| [0, 1, 2].map(|k| x[k] - y[k]));
                            let n = [
                                e[1] * g[2] - e[2] * g[1],
                                e[2] * g[0] - e[0] * g[2],
                                e[0] * g[1] - e[1] * g[0],
                            ];
                            let size = (0..3).map(|k| (n[k] * h[k]).abs()).sum::<f64>();
                            let dot = (0..3).map(|k| n[k] * h[k]).sum::<f64>();
                            if dot.abs() > 1e-9 * size { dot } else { 0.0 }
                        };
                        assert!(d(apex(front).map(f64::from)) >= 0.0 && d(apex(back).map(f64::from)) <= 0.0);
                    }
                    Behind::Hull => panic!("a hull face with two tetrahedra"),
                }
            }
            _ => panic!("a face of {} tetrahedra", sides.len()),
        }
    }
    assert_eq!(hull, 12);
    assert_eq!(constrained, tets.faces.len());

    // Every triangle of the node once, whole and unmoved, in source order.
    let mut ids: Vec<u32> = tets.faces.iter().map(|f| f.triangle).collect();
    ids.sort_unstable();
    let mut expected = bvh.order[node.first as usize..][..node.count as usize].to_vec();
    expected.sort_unstable();
    assert_eq!(ids, expected);
    for face in &tets.faces {
        assert_eq!(
            face.vertex.map(position).map(|p| p.map(|x| x.to_bits())),
            mesh.corners(face.triangle).map(|p| p.map(|x| x.to_bits()))
        );
    }
}

/// Asserts that random points of the box lie in exactly one tetrahedron, by trying all.
pub(crate) fn assert_covers_once(tets: &TetMesh, points: usize) {
    let mut random = Random(7);
    for _ in 0..points {
        let p = std::array::from_fn(|k| {
            let x = tets.lower[k] + random.unit() * (tets.upper[k] - tets.lower[k]);
            x.clamp(tets.lower[k], tets.upper[k])
        });
        let mut inside = 0;
        let mut border = 0;
        for tet in &tets.tets {
            let v = tet.map(|v| tets.vertices[v as usize]);
            let whole = orientation(v[0], v[1], v[2], v[3]);
            let part = |k: usize| {
                let mut w = v;
                w[k] = p;
                orientation(w[0], w[1], w[2], w[3]) * whole.signum()
            };
            let parts = [part(0), part(1), part(2), part(3)];
            inside += usize::from(parts.iter().all(|&x| x > 0.0));
            border += usize::from(parts.iter().all(|&x| x >= 0.0) && parts.contains(&0.0));
        }
        assert!(inside == 1 && border == 0 || inside == 0 && border >= 1, "{p:?}: {inside} {border}");
    }
}
