//! The expected cost of rays through an object's tree, by the surface area heuristic: the expected
//! number of nodes and leaves that a random line through the object's box visits. It is the sum of
//! the areas of all boxes relative to the area of the object's box.

use crate::parallel;
use bth_format::layout::{CacheLine, NODE_LINES, WIDTH, WideNode};
use zerocopy::{FromBytes, IntoBytes};

/// Number of lines of nodes whose areas are summed together. The sum does not depend on the number
/// of threads.
const CHUNK: usize = 512 * NODE_LINES;

/// The cost of a tree with given nodes, the root first; 1 if there are no nodes.
pub(super) fn cost(nodes: &[CacheLine]) -> f64 {
    let Some(root) = nodes.first_chunk::<NODE_LINES>() else { return 1.0 };
    let sums = parallel::map(nodes.chunks(CHUNK).collect(), areas);
    1.0 + sums.iter().sum::<f64>() / half_area(bounds(node(root)))
}

/// Half the areas of the boxes of all children of some nodes.
fn areas(nodes: &[CacheLine]) -> f64 {
    let mut sums = [0.0; WIDTH];
    for lines in nodes.chunks_exact(NODE_LINES) {
        let [x, y, z] = &node(lines).bounds;
        for i in 0..WIDTH {
            let [x, y, z] = [x, y, z].map(|[lower, upper]| f64::from(upper[i]) - f64::from(lower[i]));
            // Empty slots have empty boxes.
            sums[i] += if x >= 0.0 { x * y + y * z + z * x } else { 0.0 };
        }
    }
    sums.iter().sum()
}

fn node(lines: &[CacheLine]) -> &WideNode {
    WideNode::ref_from_bytes(lines.as_bytes()).ok().expect("the lines of a node")
}

/// The box of all children of a node: lower and upper end.
pub(super) fn bounds(node: &WideNode) -> [[f32; 3]; 2] {
    let mut bounds = [[f32::MAX; 3], [-f32::MAX; 3]];
    for k in 0..3 {
        for slot in 0..WIDTH {
            bounds[0][k] = bounds[0][k].min(node.bounds[k][0][slot]);
            bounds[1][k] = bounds[1][k].max(node.bounds[k][1][slot]);
        }
    }
    bounds
}

fn half_area([lower, upper]: [[f32; 3]; 2]) -> f64 {
    let [x, y, z] = [0, 1, 2].map(|k| f64::from(upper[k]) - f64::from(lower[k]));
    x * y + y * z + z * x
}
