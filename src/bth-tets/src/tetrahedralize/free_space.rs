//! Points in free space, so that rays cross few tetrahedra where there is nothing to hit.
//!
//! The box is split as an octree until a cell holds few vertices; every empty leaf cell gets one
//! point near its centre. On the bunny the points halve the steps of a ray, and there are fewer
//! tetrahedra, because the points break up the slivers between distant surfaces.

use std::collections::HashSet;

use super::gather::NodeInput;
use bth_random::Rng;

/// Deepest level of the octree: cells of 1/2048 of the box.
const DEPTH: u32 = 11;
/// How far a point may lie off its cell's centre, relative to the cell's size; the jitter keeps
/// points of neighbouring cells from being cospherical.
const JITTER: f64 = 0.15;
/// Points nearer to the box's sides than this, relative to its extent, are skipped because they
/// make slivers.
const MARGIN: f64 = 0.02;

/// The free-space points, inside the box and different from every vertex and from each other. They
/// depend on the input and the seed only. At most `most` vertices share a cell; 0 gives no points.
pub(super) fn points(input: &NodeInput, most: u32, seed: u64) -> Vec<[f32; 3]> {
    if most == 0 {
        return Vec::new();
    }
    let lower = input.lower.map(f64::from);
    let upper = input.upper.map(f64::from);
    let centre: [f64; 3] = std::array::from_fn(|k| (lower[k] + upper[k]) / 2.0);
    let half = (0..3).map(|k| (upper[k] - lower[k]) / 2.0).fold(0.0, f64::max);
    let mut order: Vec<u32> = (0..input.vertices.len() as u32).collect();
    let mut found = Vec::new();
    let cell = Cell { centre, half, first: 0, end: order.len(), depth: 0, path: 1 };
    let mut stack = vec![cell];
    while let Some(cell) = stack.pop() {
        let count = cell.end - cell.first;
        if cell.depth >= 1 && (count <= most as usize || cell.depth >= DEPTH) {
            if count == 0 {
                let cell_seed = seed ^ cell.path.wrapping_mul(0x9e37_79b9_7f4a_7c15);
                let mut random = Rng::new(cell_seed).next();
                let point = std::array::from_fn(|k| {
                    random = Rng::new(random).next();
                    let unit = (random >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
                    (cell.centre[k] + 2.0 * JITTER * cell.half * unit) as f32
                });
                let inside = |k: usize| {
                    let margin = MARGIN * (upper[k] - lower[k]);
                    let x = f64::from(point[k]);
                    lower[k] + margin < x && x < upper[k] - margin
                };
                if (0..3).all(inside) {
                    found.push(point);
                }
            }
            continue;
        }
        let slice = &mut order[cell.first..cell.end];
        let octant = |v: u32| {
            let p = input.vertices[v as usize];
            (0..3).fold(0, |o, k| o | (u32::from(f64::from(p[k]) >= cell.centre[k]) << k))
        };
        slice.sort_by_key(|&v| octant(v));
        let mut first = cell.first;
        for o in 0..8 {
            let half = cell.half / 2.0;
            let end = first + order[first..cell.end].partition_point(|&v| octant(v) <= o);
            let centre = std::array::from_fn(|k| cell.centre[k] + if o >> k & 1 == 1 { half } else { -half });
            // The root cell is a cube; cells outside a long box are skipped.
            if (0..3).all(|k| centre[k] - half < upper[k] && centre[k] + half > lower[k]) {
                let path = cell.path << 3 | u64::from(o);
                stack.push(Cell { centre, half, first, end, depth: cell.depth + 1, path });
            }
            first = end;
        }
    }
    // Far from the origin cells can be smaller than the spacing of f32, so that centres coincide.
    let mut seen: HashSet<[u32; 3]> = input.vertices.iter().map(bits).collect();
    found.retain(|p| seen.insert(bits(p)));
    found
}

struct Cell {
    centre: [f64; 3],
    half: f64,
    first: usize,
    end: usize,
    depth: u32,
    /// The octants on the path from the root, three bits each after a leading 1.
    path: u64,
}

/// The bits of a position, with -0 as +0.
fn bits(p: &[f32; 3]) -> [u32; 3] {
    p.map(|x| (x + 0.0).to_bits())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn input(vertices: Vec<[f32; 3]>) -> NodeInput {
        NodeInput { lower: [-1.0; 3], upper: [1.0; 3], vertices, triangles: Vec::new(), ids: Vec::new() }
    }

    #[test]
    fn every_empty_octant_gets_one_point_near_its_centre() {
        let points = points(&input(vec![[0.5; 3]; 3]), 16, 0);
        assert_eq!(points.len(), 7);
        for p in points {
            assert!(p.iter().all(|x| (x.abs() - 0.5).abs() <= 0.075 + 1e-6), "{p:?}");
            assert!(p.iter().any(|x| *x < 0.0));
        }
    }

    #[test]
    fn crowded_cells_are_split() {
        let vertices = (0..100).map(|i| [0.3 + i as f32 * 0.001, 0.3, 0.3]).collect();
        let input = input(vertices);
        assert!(points(&input, 16, 0).len() > points(&input, 128, 0).len());
        assert!(points(&input, 0, 0).is_empty());
        assert_eq!(points(&input, 16, 7), points(&input, 16, 7));
        assert_ne!(points(&input, 16, 7), points(&input, 16, 8));
    }

    #[test]
    fn points_are_distinct_and_inside_far_from_the_origin() {
        let far = 1e6f32;
        let vertices: Vec<_> =
            (0..200).map(|i| [far + (i % 7) as f32 * 0.25, far + (i % 5) as f32, far]).collect();
        let input = NodeInput {
            lower: [far - 1.0; 3],
            upper: [far + 5.0; 3],
            vertices,
            triangles: vec![],
            ids: vec![],
        };
        let points = points(&input, 4, 1);
        let distinct: HashSet<_> = points.iter().chain(&input.vertices).map(bits).collect();
        assert_eq!(distinct.len(), points.len() + 35);
        assert!(points.iter().flatten().all(|&x| far - 1.0 < x && x < far + 5.0));
    }
}
