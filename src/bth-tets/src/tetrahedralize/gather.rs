//! The triangles of a node with their own vertices, and the box around them.

use bth_bvh::BinaryBvh;
use bth_import::Mesh;

use super::failure::AttemptError;

/// The triangles that are tetrahedralized, and the box.
#[derive(Clone, Debug)]
pub struct NodeInput {
    /// Box that the tetrahedra will fill: larger than the triangles' bounds on every side.
    pub(super) lower: [f32; 3],
    /// Upper end of the box.
    pub(super) upper: [f32; 3],
    /// Corners of the triangles, in order of their rows in the mesh.
    pub vertices: Vec<[f32; 3]>,
    /// Rows of `vertices`, in source order.
    pub triangles: Vec<[u32; 3]>,
    /// Ids of the triangles in the source, ascending.
    pub ids: Vec<u32>,
}

/// Gathers a node's triangles, and puts a box around them that exceeds their bounds by `inflation`
/// times their diagonal.
///
/// # Errors
/// When the box leaves the range of `f32`.
pub(super) fn gather(
    mesh: &Mesh,
    bvh: &BinaryBvh,
    node: u32,
    inflation: f32,
) -> Result<NodeInput, AttemptError> {
    let node = &bvh.nodes[node as usize];
    let mut ids = bvh.order[node.first as usize..][..node.count as usize].to_vec();
    ids.sort_unstable();
    let mut rows: Vec<u32> = ids.iter().flat_map(|&id| mesh.triangles[id as usize]).collect();
    rows.sort_unstable();
    rows.dedup();
    let local =
        |row: u32| rows.binary_search(&row).expect("the row was gathered from these triangles") as u32;
    let triangles = ids.iter().map(|&id| mesh.triangles[id as usize].map(local)).collect();
    let vertices: Vec<[f32; 3]> = rows.iter().map(|&row| mesh.positions[row as usize]).collect();

    let (lower, upper) = bounds(&vertices);
    let diagonal = (0..3).map(|k| (f64::from(upper[k]) - f64::from(lower[k])).powi(2)).sum::<f64>().sqrt();
    let margin = diagonal * f64::from(inflation);
    let lower = lower.map(|x| ((f64::from(x) - margin) as f32).min(x.next_down()));
    let upper = upper.map(|x| ((f64::from(x) + margin) as f32).max(x.next_up()));
    if lower.iter().chain(&upper).any(|x| !x.is_finite()) {
        return Err(AttemptError::Unfit("the box exceeds the range of single precision"));
    }
    Ok(NodeInput { lower, upper, vertices, triangles, ids })
}

/// Bounds of points; empty (lower above upper) for none.
fn bounds(points: &[[f32; 3]]) -> ([f32; 3], [f32; 3]) {
    let mut lower = [f32::INFINITY; 3];
    let mut upper = [f32::NEG_INFINITY; 3];
    for p in points {
        for k in 0..3 {
            lower[k] = lower[k].min(p[k]);
            upper[k] = upper[k].max(p[k]);
        }
    }
    (lower, upper)
}

impl NodeInput {
    /// Corners of the box: bit k of the row chooses the upper end on axis k.
    pub(super) fn corners(&self) -> [[f32; 3]; 8] {
        std::array::from_fn(|i| {
            std::array::from_fn(|k| if i >> k & 1 == 1 { self.upper[k] } else { self.lower[k] })
        })
    }
}

/// Sides of the box as quads of [`NodeInput::corners`]: lower and upper x, y, z.
pub(super) const SIDES: [[u32; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_side_lies_on_its_plane() {
        for (i, side) in SIDES.iter().enumerate() {
            let (axis, upper) = (i / 2, i % 2);
            assert!(side.iter().all(|&c| (c as usize >> axis & 1) == upper));
            // Around the quad, neighbouring corners differ on one axis.
            for k in 0..4 {
                assert_eq!((side[k] ^ side[(k + 1) % 4]).count_ones(), 1);
            }
        }
    }

    #[test]
    fn the_box_exceeds_the_triangles_by_an_ulp_even_without_inflation() {
        for offset in [0.0f32, 1e-30, 1.0, 1e10, -3e20] {
            let mesh = Mesh {
                positions: vec![[offset, offset, offset], [offset, offset + 1.0, 2.0], [offset, 3.0, offset]],
                triangles: vec![[0, 1, 2]],
                ..Mesh::default()
            };
            let node = bth_bvh::Node { lower: [0.0; 3], upper: [0.0; 3], first: 0, count: 1, right: 0 };
            let bvh = BinaryBvh { nodes: vec![node], order: vec![0] };
            let input = gather(&mesh, &bvh, 0, 0.0).unwrap();
            for p in &mesh.positions {
                assert!((0..3).all(|k| input.lower[k] < p[k] && p[k] < input.upper[k]));
            }
        }
    }
}
