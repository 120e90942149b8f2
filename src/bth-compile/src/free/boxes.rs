//! Boxes of the BVH eight at a time, and the bins in which a start triangle may see them.

use super::frame::{BORDERS, BinSet, Frame, bins};
use crate::bvh::BinaryBvh;
use bth_format::layout::{FREE_SIDE, NONE};

/// Children of a node.
pub(super) const WIDTH: usize = 8;
/// Bit of a child that is a triangle: the others are its row in the order of the BVH.
pub(super) const TRIANGLE: u32 = 1 << 31;

/// The children of a node: boxes by their centers and half sides, rounded outwards.
#[derive(Clone, Debug)]
#[repr(align(32))]
pub(super) struct Node {
    center: [[f32; WIDTH]; 3],
    half: [[f32; WIDTH]; 3],
    /// A node, a triangle, or [`NONE`] after the last child.
    pub(super) child: [u32; WIDTH],
}

/// The nodes of a BVH, of which the first is the root.
#[derive(Clone, Debug, Default)]
pub(super) struct Boxes {
    pub(super) nodes: Vec<Node>,
    /// More than the rounding errors of coordinates.
    slack: f32,
}

/// What a start triangle may see of the children of a node.
pub(super) struct Seen {
    /// Lower bounds of the squared distances.
    pub(super) squared_gap: [f32; WIDTH],
    /// Squares of half the diagonals.
    pub(super) squared_size: [f32; WIDTH],
    /// First and last column, and first and last row; first beyond last if nothing is seen.
    range: [[u32; WIDTH]; 4],
}

impl Boxes {
    pub(super) fn new(tree: &BinaryBvh) -> Self {
        let Some(root) = tree.nodes.first() else { return Boxes::default() };
        let size = root.lower.iter().chain(&root.upper).fold(0f32, |size, x| size.max(x.abs()));
        let mut boxes = Boxes { nodes: Vec::new(), slack: size / (1 << 20) as f32 };
        // Each entry is a node of the binary BVH, and where to store the index of the wide one.
        let mut stack = vec![(0u32, None)];
        while let Some((node, parent)) = stack.pop() {
            let index = boxes.nodes.len() as u32;
            if let Some((parent, slot)) = parent {
                let parent: &mut Node = &mut boxes.nodes[parent as usize];
                parent.child[slot] = index;
            }
            let children = children(tree, node);
            boxes.nodes.push(Node::new(tree, &children));
            for (slot, child) in children.into_iter().enumerate() {
                if !tree.nodes[child as usize].is_leaf() {
                    stack.push((child, Some((index, slot))));
                }
            }
        }
        boxes
    }
}

/// At most eight nodes below a node, or the node itself if it is a leaf: the largest are replaced by their children.
fn children(tree: &BinaryBvh, node: u32) -> Vec<u32> {
    let mut found = vec![node];
    while found.len() < WIDTH {
        let inner = |(_, node): &(usize, &u32)| !tree.nodes[**node as usize].is_leaf();
        let largest = found.iter().enumerate().filter(inner).max_by_key(|(_, node)| tree.nodes[**node as usize].count);
        let Some((at, &node)) = largest else { break };
        found[at] = node + 1;
        found.push(tree.nodes[node as usize].right);
    }
    found
}

impl Node {
    fn new(tree: &BinaryBvh, children: &[u32]) -> Self {
        let mut node = Node { center: [[0.0; WIDTH]; 3], half: [[0.0; WIDTH]; 3], child: [NONE; WIDTH] };
        for lane in 0..WIDTH {
            let of = &tree.nodes[children[lane.min(children.len() - 1)] as usize];
            for k in 0..3 {
                let center = 0.5 * of.lower[k] + 0.5 * of.upper[k];
                node.center[k][lane] = center;
                let half = (of.upper[k] - center).max(center - of.lower[k]);
                node.half[k][lane] = half * (1.0 + 1.0 / (1 << 20) as f32);
            }
            if lane < children.len() && of.is_leaf() {
                node.child[lane] = TRIANGLE | of.first;
            }
        }
        node
    }
}

/// A start triangle as boxes see it.
pub(super) struct Viewer {
    origin: [f32; 3],
    axes: [[f32; 3]; 3],
    /// Least and greatest coordinates of the triangle along its first two axes.
    extent: [[f32; 2]; 2],
    slack: f32,
}

impl Viewer {
    pub(super) fn new(boxes: &Boxes, frame: &Frame, corners: [[f32; 3]; 3]) -> Self {
        let [_, b, c] = corners.map(|p| frame.local(p.map(f64::from)));
        let extent = [0, 1].map(|k| [b[k].min(c[k]).min(0.0) as f32, b[k].max(c[k]).max(0.0) as f32]);
        let size = extent.iter().flatten().fold(0f32, |size, x| size.max(x.abs()));
        let axes = frame.axes.map(|axis| axis.map(|x| x as f32));
        Viewer { origin: corners[0], axes, extent, slack: boxes.slack + size / (1 << 20) as f32 }
    }

    /// What may be seen of the boxes of a node.
    #[inline]
    pub(super) fn see(&self, node: &Node) -> Seen {
        let [[m00, m01, m02], [m10, m11, m12], [m20, m21, m22]] = self.axes;
        let [[x_least, x_most], [y_least, y_most]] = self.extent;
        let mut seen =
            Seen { squared_gap: [0.0; WIDTH], squared_size: [0.0; WIDTH], range: [[0; WIDTH]; 4] };
        let mut slopes = [[0f32; WIDTH]; 4];
        for l in 0..WIDTH {
            let v = [0, 1, 2].map(|k| node.center[k][l] - self.origin[k]);
            let h = [node.half[0][l], node.half[1][l], node.half[2][l]];
            let sum = v[0].abs() + v[1].abs() + v[2].abs() + h[0] + h[1] + h[2];
            let slack = self.slack + sum * (1.0 / (1 << 20) as f32);
            let x = m00 * v[0] + m01 * v[1] + m02 * v[2];
            let y = m10 * v[0] + m11 * v[1] + m12 * v[2];
            let z = m20 * v[0] + m21 * v[1] + m22 * v[2];
            let half_x = m00.abs() * h[0] + m01.abs() * h[1] + m02.abs() * h[2] + slack;
            let half_y = m10.abs() * h[0] + m11.abs() * h[1] + m12.abs() * h[2] + slack;
            let half_z = m20.abs() * h[0] + m21.abs() * h[1] + m22.abs() * h[2] + slack;
            let (x0, x1) = (x - half_x - x_most, x + half_x - x_least);
            let (y0, y1) = (y - half_y - y_most, y + half_y - y_least);
            let (z0, z1) = (z - half_z, z + half_z);
            let gap = [x0.max(-x1).max(0.0), y0.max(-y1).max(0.0), z0.max(-z1).max(0.0)];
            seen.squared_gap[l] = gap[0] * gap[0] + gap[1] * gap[1] + gap[2] * gap[2];
            seen.squared_size[l] = h[0] * h[0] + h[1] * h[1] + h[2] * h[2];
            // What is not above the plane has slopes beyond all columns.
            let near = 1.0 / z0.max(1e-30);
            let far = 1.0 / z1.max(1e-30);
            let hidden = if z1 > 0.0 { 0.0 } else { f32::INFINITY };
            slopes[0][l] = (x0 * near).min(x0 * far).max(-1e6) + hidden;
            slopes[1][l] = (x1 * near).max(x1 * far).min(1e6);
            slopes[2][l] = (y0 * near).min(y0 * far).max(-1e6);
            slopes[3][l] = (y1 * near).max(y1 * far).min(1e6);
        }
        let borders = &*BORDERS;
        for pair in 0..2 {
            for i in 0..FREE_SIDE {
                for l in 0..WIDTH {
                    seen.range[2 * pair][l] += u32::from(slopes[2 * pair][l] > borders.above[i]);
                    seen.range[2 * pair + 1][l] += u32::from(slopes[2 * pair + 1][l] >= borders.below[i]);
                }
            }
        }
        seen
    }
}

impl Seen {
    /// The bins in which a child may be seen.
    #[inline]
    pub(super) fn bins(&self, lane: usize) -> BinSet {
        let [first, end, first_row, end_row] = [0, 1, 2, 3].map(|k| self.range[k][lane]);
        if first >= end || first_row >= end_row { 0 } else { bins([first, end - 1], [first_row, end_row - 1]) }
    }
}
