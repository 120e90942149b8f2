//! The triangles of a compiled object, collected from its leaves.

use bth_format::layout::Child;
use bth_format::object::ObjectView;

/// A triangle of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// Id in the source.
    pub id: u32,
    /// Corners, object space.
    pub corners: [[f32; 3]; 3],
}

/// All triangles that can be hit, by ascending id: the triangles of triangle leaves, and the
/// constrained faces of tet leaves. The object must have passed its check.
pub fn triangles(object: &ObjectView<'_>) -> Vec<Triangle> {
    let mut found = Vec::with_capacity(object.header.triangles as usize);
    let mut stack = vec![object.header.root];
    while let Some(code) = stack.pop() {
        match Child::from_code(code) {
            Some(Child::Node(line)) => stack.extend(object.node(line).child),
            Some(Child::Indexed(line)) => {
                let mut unpacked = None;
                let leaf = object.indexed(line, &mut unpacked);
                for row in 0..leaf.triangles as usize {
                    let corners = [0, 1, 2].map(|c| {
                        let vertex = usize::from(leaf.corner[c][row]);
                        [0, 1, 2].map(|axis| leaf.vertex[axis][vertex])
                    });
                    found.push(Triangle { id: object.triangle_ids[leaf.first as usize + row], corners });
                }
            }
            Some(Child::Raw(line)) => {
                let mut unpacked = None;
                let leaf = object.raw(line, &mut unpacked);
                for row in 0..leaf.triangles as usize {
                    let corners = leaf.corner.map(|axes| axes.map(|values| values[row]));
                    found.push(Triangle { id: object.triangle_ids[leaf.first as usize + row], corners });
                }
            }
            // A subtree that is kept with the tet leaf holds the same triangles, so it is not
            // visited.
            Some(Child::Tets(row)) => {
                let leaf = &object.tet_leaves[row as usize];
                let faces = &object.tet_faces[leaf.first_face as usize..][..leaf.faces as usize];
                found.extend(faces.iter().map(|face| Triangle {
                    id: face.triangle,
                    corners: face.vertex.map(|v| object.tet_vertices[v as usize].position),
                }));
            }
            None => {}
        }
    }
    found.sort_by_key(|triangle| triangle.id);
    found
}

/// Id and corners of all triangles, by ascending id, in the source's space: the exact positions of
/// an object that has them.
pub fn exact_triangles(object: &ObjectView<'_>) -> Vec<(u32, [[f64; 3]; 3])> {
    let exact = |of: Triangle| {
        let wide = || of.corners.map(|p| p.map(f64::from));
        (of.id, object.exact.corners(of.id).unwrap_or_else(wide))
    };
    triangles(object).into_iter().map(exact).collect()
}
