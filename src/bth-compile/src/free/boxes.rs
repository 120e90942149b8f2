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
        let largest =
            found.iter().enumerate().filter(inner).max_by_key(|(_, node)| tree.nodes[**node as usize].count);
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
        let c = node.center.map(Lanes);
        let h = node.half.map(Lanes);
        let v = [0, 1, 2].map(|k| c[k] - Lanes::splat(self.origin[k]));
        let sum = v[0].abs() + v[1].abs() + v[2].abs() + h[0] + h[1] + h[2];
        let slack = Lanes::splat(self.slack) + sum * Lanes::splat(1.0 / (1 << 20) as f32);
        // Least and greatest coordinates along an axis, relative to points of the triangle.
        let along = |k: usize, [least, most]: [f32; 2]| {
            let m = self.axes[k].map(Lanes::splat);
            let middle = m[0] * v[0] + m[1] * v[1] + m[2] * v[2];
            let half = m[0].abs() * h[0] + m[1].abs() * h[1] + m[2].abs() * h[2] + slack;
            [middle - half - Lanes::splat(most), middle + half - Lanes::splat(least)]
        };
        let (x, y, z) = (along(0, self.extent[0]), along(1, self.extent[1]), along(2, [0.0; 2]));
        let zero = Lanes::splat(0.0);
        let gap = [x, y, z].map(|[least, most]| least.max(zero - most).max(zero));
        let near = Lanes::splat(1.0) / z[0].max(Lanes::splat(1e-30));
        let far = Lanes::splat(1.0) / z[1].max(Lanes::splat(1e-30));
        let limit = Lanes::splat(1e6);
        let slopes = [x, y].map(|[least, most]| {
            [(least * near).min(least * far).max(zero - limit), (most * near).max(most * far).min(limit)]
        });
        let mut seen = Seen {
            squared_gap: (gap[0] * gap[0] + gap[1] * gap[1] + gap[2] * gap[2]).0,
            squared_size: (h[0] * h[0] + h[1] * h[1] + h[2] * h[2]).0,
            range: [[0; WIDTH]; 4],
        };
        let borders = &*BORDERS;
        for (k, [least, most]) in slopes.into_iter().enumerate() {
            for i in 0..FREE_SIDE {
                least.count_above(borders.above[i], &mut seen.range[2 * k]);
                most.count_above(borders.below[i], &mut seen.range[2 * k + 1]);
            }
        }
        // Nothing is seen of what is not above the plane.
        for (end, height) in seen.range[1].iter_mut().zip(z[1].0) {
            *end &= if height > 0.0 { u32::MAX } else { 0 };
        }
        seen
    }
}

/// A number for each child. Loops over all of them become vector instructions.
#[derive(Clone, Copy)]
struct Lanes([f32; WIDTH]);

impl Lanes {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        Lanes([x; WIDTH])
    }

    #[inline(always)]
    fn with(self, other: Self, of: impl Fn(f32, f32) -> f32) -> Self {
        Lanes(std::array::from_fn(|l| of(self.0[l], other.0[l])))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.with(self, |a, _| a.abs())
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.with(other, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.with(other, |a, b| if a > b { a } else { b })
    }

    /// Adds 1 where the number is greater than a limit.
    #[inline(always)]
    fn count_above(self, limit: f32, to: &mut [u32; WIDTH]) {
        for (count, x) in to.iter_mut().zip(self.0) {
            *count += u32::from(x > limit);
        }
    }
}

impl std::ops::Add for Lanes {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.with(other, |a, b| a + b)
    }
}

impl std::ops::Sub for Lanes {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.with(other, |a, b| a - b)
    }
}

impl std::ops::Mul for Lanes {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.with(other, |a, b| a * b)
    }
}

impl std::ops::Div for Lanes {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.with(other, |a, b| a / b)
    }
}

impl Seen {
    /// The bins in which a child may be seen.
    #[inline]
    pub(super) fn bins(&self, lane: usize) -> BinSet {
        let [first, end, first_row, end_row] = [0, 1, 2, 3].map(|k| self.range[k][lane]);
        if first >= end || first_row >= end_row {
            0
        } else {
            bins([first, end - 1], [first_row, end_row - 1])
        }
    }
}
