//! Slow, obvious checks of a finished tetrahedralization, independent of the stage's own.

use std::collections::HashMap;

use bth_bvh::BinaryBvh;
use bth_import::Mesh;
use bth_random::Rng;
use bth_tets::{Behind, Face, TetMesh};
use robust::{Coord3D, orient3d};

fn orientation(a: [f32; 3], b: [f32; 3], c: [f32; 3], d: [f32; 3]) -> f64 {
    let [a, b, c, d] = [a, b, c, d].map(|p| p.map(f64::from)).map(|[x, y, z]| Coord3D { x, y, z });
    orient3d(a, b, c, d)
}

/// Asserts everything that the documentation of `TetMesh` guarantees for this node.
pub(crate) fn assert_holds(mesh: &Mesh, bvh: &BinaryBvh, node: u32, tets: &TetMesh) {
    let node = bvh.nodes[node as usize];
    assert!((0..3).all(|k| tets.lower[k] < node.lower[k] && node.upper[k] < tets.upper[k]));
    assert_eq!(tets.tets.len(), tets.behind.len());
    assert_vertices_are_distinct_and_used(tets);

    let mut constrained = 0;
    let mut hull = 0;
    for (face, sides) in &faces_with_sides(tets) {
        match sides[..] {
            [side] => {
                hull += 1;
                assert_is_hull(tets, face, side);
            }
            [a, b] => constrained += usize::from(assert_separates(tets, face, a, b)),
            _ => panic!("a face of {} tetrahedra", sides.len()),
        }
    }
    assert_eq!(hull, 12);
    assert_eq!(constrained, tets.faces.len());
    assert_triangles_are_faces(mesh, &bvh.order[node.first as usize..][..node.count as usize], tets);
}

/// A side of a face: the tetrahedron on that side, and which of its vertices lies opposite to the
/// face.
type Side = (u32, usize);

fn position(tets: &TetMesh, vertex: u32) -> [f32; 3] {
    tets.vertices[vertex as usize]
}

/// Position of the vertex opposite to the face.
fn apex(tets: &TetMesh, (tet, k): Side) -> [f32; 3] {
    position(tets, tets.tets[tet as usize][k])
}

fn behind(tets: &TetMesh, (tet, k): Side) -> Behind {
    tets.behind[tet as usize][k]
}

/// Every vertex belongs to a tetrahedron, and no two have the same position.
fn assert_vertices_are_distinct_and_used(tets: &TetMesh) {
    let mut bits: Vec<_> = tets.vertices.iter().map(|p| p.map(f32::to_bits)).collect();
    bits.sort_unstable();
    assert!(bits.is_sorted_by(|a, b| a < b));
    let mut used = vec![false; tets.vertices.len()];
    tets.tets.as_flattened().iter().for_each(|&v| used[v as usize] = true);
    assert!(used.iter().all(|&u| u));
}

/// The sides of every face, by its vertices in ascending order. Tetrahedra are not flat.
fn faces_with_sides(tets: &TetMesh) -> HashMap<[u32; 3], Vec<Side>> {
    let mut faces: HashMap<[u32; 3], Vec<Side>> = HashMap::new();
    for (t, tet) in tets.tets.iter().enumerate() {
        assert!(tet.is_sorted_by(|a, b| a < b));
        let [a, b, c, d] = tet.map(|v| position(tets, v));
        assert_ne!(orientation(a, b, c, d), 0.0);
        for k in 0..4 {
            let mut face: Vec<u32> = tet.to_vec();
            face.remove(k);
            faces.entry([face[0], face[1], face[2]]).or_default().push((t as u32, k));
        }
    }
    faces
}

/// A face with one tetrahedron is marked as hull and lies in a side of the box.
fn assert_is_hull(tets: &TetMesh, face: &[u32; 3], side: Side) {
    assert_eq!(behind(tets, side), Behind::Hull);
    let on = |k: usize, x: f32| face.iter().all(|&v| position(tets, v)[k] == x);
    assert!((0..3).any(|k| on(k, tets.lower[k]) || on(k, tets.upper[k])));
}

/// The two tetrahedra of a face lie on opposite sides of it and refer to each other or to the same
/// constrained face. Returns true if the face is constrained.
fn assert_separates(tets: &TetMesh, face: &[u32; 3], a: Side, b: Side) -> bool {
    let [p, q, r] = face.map(|v| position(tets, v));
    let is_positive = |side| orientation(p, q, r, apex(tets, side)) > 0.0;
    assert_ne!(is_positive(a), is_positive(b), "two tetrahedra on one side of a face");
    match behind(tets, a) {
        Behind::Tet(tet) => {
            assert_eq!(tet, b.0);
            assert_eq!(behind(tets, b), Behind::Tet(a.0));
            false
        }
        Behind::Face(row) => {
            assert_eq!(behind(tets, b), Behind::Face(row));
            assert_is_constrained_face(tets, &tets.faces[row as usize], face, [a, b]);
            true
        }
        Behind::Hull => panic!("a hull face with two tetrahedra"),
    }
}

/// A constrained face has these vertices and lists the tetrahedron in front of it and the one
/// behind it, in this order.
fn assert_is_constrained_face(tets: &TetMesh, constrained: &Face, vertices: &[u32; 3], [a, b]: [Side; 2]) {
    let mut sorted = constrained.vertex;
    sorted.sort_unstable();
    assert_eq!(sorted, *vertices);
    let (front, back) = if constrained.tet[0] == a.0 { (a, b) } else { (b, a) };
    assert_eq!(constrained.tet, [front.0, back.0]);
    let corners = constrained.vertex.map(|v| position(tets, v).map(f64::from));
    let height = |side| height_unless_uncertain(corners, apex(tets, side).map(f64::from));
    assert!(height(front) >= 0.0 && height(back) <= 0.0);
}

/// The product of a triangle's normal with the vector to a point by the plain formula; 0 where
/// rounding may decide its sign. Independent of the exact predicate that the stage uses.
fn height_unless_uncertain([v0, v1, v2]: [[f64; 3]; 3], point: [f64; 3]) -> f64 {
    let [e, g, h] = [v1, v2, point].map(|x| [0, 1, 2].map(|k| x[k] - v0[k]));
    let n = [e[1] * g[2] - e[2] * g[1], e[2] * g[0] - e[0] * g[2], e[0] * g[1] - e[1] * g[0]];
    let magnitude = (0..3).map(|k| (n[k] * h[k]).abs()).sum::<f64>();
    let product = (0..3).map(|k| n[k] * h[k]).sum::<f64>();
    if product.abs() > 1e-9 * magnitude { product } else { 0.0 }
}

/// Every triangle of the node is a constrained face once, whole and unmoved, in source order.
fn assert_triangles_are_faces(mesh: &Mesh, triangles: &[u32], tets: &TetMesh) {
    let mut ids: Vec<u32> = tets.faces.iter().map(|f| f.triangle).collect();
    ids.sort_unstable();
    let mut expected = triangles.to_vec();
    expected.sort_unstable();
    assert_eq!(ids, expected);
    for face in &tets.faces {
        assert_eq!(
            face.vertex.map(|v| position(tets, v).map(f32::to_bits)),
            mesh.corners(face.triangle).map(|p| p.map(f32::to_bits))
        );
    }
}

/// Asserts that random points of the box lie in exactly one tetrahedron, by trying all.
pub(crate) fn assert_covers_once(tets: &TetMesh, points: usize) {
    let mut random = Rng::new(7);
    for _ in 0..points {
        let p = std::array::from_fn(|k| {
            let x = tets.lower[k] + random.unit_f32() * (tets.upper[k] - tets.lower[k]);
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
