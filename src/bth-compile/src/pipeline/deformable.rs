//! What is tetrahedralized of an object that may be given new positions.
//!
//! Its mesh keeps all vertices of the source and all triangles. A tetrahedralization has one vertex for all that are at one place, and
//! no faces without area; where such vertices move apart at run time, the BVH beside it answers.

use crate::bvh::BinaryBvh;
use bth_format::exact::is_zero_area;
use bth_import::Mesh;
use std::borrow::Cow;
use std::collections::HashMap;

/// The geometry of a mesh, with one vertex for all at one place.
pub(super) fn welded(mesh: &Mesh) -> Cow<'_, Mesh> {
    let mut rows = HashMap::with_capacity(mesh.positions.len());
    let mut positions = Vec::with_capacity(mesh.positions.len());
    let mut row_of = |position: &[f32; 3]| {
        // As in the import, both zeros are one place.
        *rows.entry(position.map(|x| (x + 0.0).to_bits())).or_insert_with(|| {
            positions.push(*position);
            positions.len() as u32 - 1
        })
    };
    let of_vertex: Vec<u32> = mesh.positions.iter().map(&mut row_of).collect();
    if positions.len() == mesh.positions.len() {
        return Cow::Borrowed(mesh);
    }
    let triangles = mesh.triangles.iter().map(|corners| corners.map(|v| of_vertex[v as usize])).collect();
    Cow::Owned(Mesh { positions, triangles, ..Mesh::default() })
}

/// The number of triangles without area in a tree. No node with one is marked as suitable.
pub(super) fn flat_triangles(mesh: &Mesh, tree: &BinaryBvh) -> usize {
    tree.order.iter().filter(|id| is_zero_area(mesh.corners(**id))).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::{BvhOptions, build};
    use crate::marks::mark;
    use crate::monitor::Silent;

    /// Squares of two triangles side by side, each with vertices of its own.
    fn squares(count: u32) -> Mesh {
        let mut mesh = Mesh::default();
        for i in 0..count {
            let (x, first) = (i as f32, mesh.positions.len() as u32);
            mesh.positions.extend([[x, 0.0, 0.0], [x + 1.0, 0.0, -0.0], [x, 1.0, 0.0], [x + 1.0, 1.0, 0.0]]);
            mesh.triangles.extend([[0, 1, 2], [1, 3, 2]].map(|corners: [u32; 3]| corners.map(|v| first + v)));
        }
        mesh
    }

    #[test]
    fn vertices_at_one_place_become_one_and_corners_stay_where_they_are() {
        let mesh = squares(5);
        let one = welded(&mesh);
        assert_eq!((mesh.positions.len(), one.positions.len()), (20, 12));
        for id in 0..mesh.triangles.len() as u32 {
            assert_eq!(one.corners(id), mesh.corners(id));
        }
        assert!(matches!(welded(&one), Cow::Borrowed(_)));
    }

    #[test]
    fn nodes_with_a_flat_triangle_are_not_suitable() {
        let mut mesh = welded(&squares(30)).into_owned();
        let options = BvhOptions { keep_zero_area: true, ..BvhOptions::default() };
        let tree = |mesh: &Mesh| build(mesh, &options, &Silent).unwrap().0;
        assert_eq!(flat_triangles(&mesh, &tree(&mesh)), 0);
        assert!(mark(&mesh, &tree(&mesh), &Silent).unwrap().0.suitable.iter().all(|suitable| *suitable));
        mesh.triangles.extend([[0, 1, 1], [4, 4, 4]]);
        let tree = tree(&mesh);
        assert_eq!(flat_triangles(&mesh, &tree), 2);
        let marks = mark(&mesh, &tree, &Silent).unwrap().0;
        for (at, node) in tree.nodes.iter().enumerate() {
            let ids = &tree.order[node.first as usize..][..node.count as usize];
            assert_eq!(marks.suitable[at], ids.iter().all(|id| *id < 60), "node {at}");
        }
    }
}
