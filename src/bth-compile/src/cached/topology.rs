//! A binary BVH without its boxes, which follow from the triangles: 8 bytes a triangle instead of
//! 80.

use super::codec::Codec;
use super::rows::{RowReader, Sink};
use crate::bvh::{BinaryBvh, Node};
use bth_import::Mesh;

/// The part of a BVH that does not follow from the mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Topology {
    /// Triangles left of each inner node, in depth-first order.
    left: Vec<u32>,
    /// Triangle ids, as in [`BinaryBvh::order`].
    order: Vec<u32>,
}

impl Topology {
    pub(crate) fn of(bvh: &BinaryBvh) -> Self {
        let inner = bvh.nodes.iter().enumerate().filter(|(_, node)| !node.is_leaf());
        let left = inner.map(|(at, _)| bvh.nodes[at + 1].count).collect();
        Self { left, order: bvh.order.clone() }
    }

    /// The BVH over a mesh; `None` when the topology does not fit the mesh.
    pub(crate) fn over(self, mesh: &Mesh) -> Option<BinaryBvh> {
        let count = u32::try_from(self.order.len()).ok()?;
        if self.left.len() != self.order.len().saturating_sub(1)
            || self.order.iter().any(|&id| id as usize >= mesh.triangles.len())
        {
            return None;
        }
        let mut nodes: Vec<Node> = Vec::with_capacity(2 * self.order.len());
        let mut left = self.left.iter();
        // First triangle, count, and the parent of a right child.
        let mut stack = if count > 0 { vec![(0, count, None)] } else { Vec::new() };
        while let Some((first, count, parent)) = stack.pop() {
            let at = nodes.len();
            if let Some(parent) = parent {
                nodes[parent as usize].right = at as u32;
            }
            nodes.push(Node {
                lower: [f32::INFINITY; 3],
                upper: [f32::NEG_INFINITY; 3],
                first,
                count,
                right: 0,
            });
            if count > 1 {
                let left = *left.next()?;
                if left == 0 || left >= count {
                    return None;
                }
                stack.push((first + left, count - left, Some(at as u32)));
                stack.push((first, left, None));
            }
        }
        for at in (0..nodes.len()).rev() {
            let node = nodes[at];
            let (mut lower, mut upper) = (node.lower, node.upper);
            let mut grow = |a: [f32; 3], b: [f32; 3]| {
                for k in 0..3 {
                    lower[k] = lower[k].min(a[k]);
                    upper[k] = upper[k].max(b[k]);
                }
            };
            if node.is_leaf() {
                mesh.corners(self.order[node.first as usize]).into_iter().for_each(|p| grow(p, p));
            } else {
                let (a, b) = (&nodes[at + 1], &nodes[node.right as usize]);
                grow(a.lower, a.upper);
                grow(b.lower, b.upper);
            }
            (nodes[at].lower, nodes[at].upper) = (lower, upper);
        }
        Some(BinaryBvh { nodes, order: self.order })
    }
}

impl Codec for Topology {
    fn write(&self, to: &mut impl Sink) {
        to.add(&self.left);
        to.add(&self.order);
    }

    fn read(from: &mut RowReader<'_>) -> Option<Self> {
        Some(Self { left: from.take()?, order: from.take()? })
    }
}

#[cfg(test)]
mod tests {
    use super::super::codec::{decode, encode};
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn trees_come_back_with_their_boxes(
            positions in prop::collection::vec(prop::array::uniform3(-9i8..9), 3..60),
            faces in prop::collection::vec(prop::array::uniform3(0usize..1000), 0..80),
        ) {
            let positions: Vec<_> = positions.iter().map(|p| p.map(|x| f32::from(x) * 0.3)).collect();
            let triangles = faces.iter().map(|f| f.map(|v| (v % positions.len()) as u32)).collect();
            let mesh = Mesh { positions, triangles, ..Mesh::default() };
            let (bvh, _) = crate::bvh::build(&mesh, &Default::default(), &crate::Silent).unwrap();
            let topology: Topology = decode(&encode(&Topology::of(&bvh))).unwrap();
            prop_assert_eq!(topology.over(&mesh), Some(bvh));
        }
    }

    #[test]
    fn what_is_no_tree_of_the_mesh_does_not_come_back() {
        let mesh = Mesh { positions: vec![[0.0; 3]; 3], triangles: vec![[0, 1, 2]; 3], ..Mesh::default() };
        let good = Topology { left: vec![1, 1], order: vec![2, 0, 1] };
        assert!(good.clone().over(&mesh).is_some());
        for wrong in [
            Topology { left: vec![0, 1], ..good.clone() },
            Topology { left: vec![3, 1], ..good.clone() },
            Topology { left: vec![1], ..good.clone() },
            Topology { left: vec![1, 1, 1], ..good.clone() },
            Topology { order: vec![2, 0, 3], ..good.clone() },
        ] {
            assert_eq!(wrong.over(&mesh), None);
        }
    }
}
