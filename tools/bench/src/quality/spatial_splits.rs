//! A binary BVH with spatial splits, to measure whether they pay: "Spatial Splits in Bounding Volume Hierarchies"
//! (Stich, Friedrich and Dietrich 2009).
//!
//! A plane divides the space of a node instead of its triangles; a triangle that it crosses goes to both sides, each time
//! with a box around its part there. Files with such trees are traced correctly, although the specification of the format
//! does not provide for a triangle in several leaves.

use super::boxes::{Box3, Reference, bounds, parts};
use super::split_plane::{self, SplitPlane};
use bth_compile::bvh::{BinaryBvh, Node};
use bth_import::{Mesh, is_zero_area};

/// Least common area of both halves, as a share of the root's, for which a plane is looked for.
const OVERLAP: f64 = 1e-5;
/// References that splits may add, at most, as a share of the triangles.
const BUDGET: f64 = 0.3;
/// From this level on nodes are divided in the middle of their list, so that no node lies deeper than the compiler allows.
const HALVED_FROM: u32 = 60;

/// Builds the tree. The cost of a subtree of n references is assumed to be n^`exponent`; in the paper the exponent is 1.
pub(super) fn build(mesh: &Mesh, exponent: f64) -> BinaryBvh {
    let ids = (0..mesh.triangles.len() as u32).filter(|&id| !is_zero_area(mesh.corners(id)));
    let all: Vec<Reference> =
        ids.map(|id| Reference { bounds: Box3::of_points(&mesh.corners(id)), id }).collect();
    let mut tree = BinaryBvh::default();
    if !all.is_empty() {
        let budget = (all.len() as f64 * BUDGET) as usize;
        let root_area = bounds(&all).half_area();
        Builder { mesh, exponent, root_area }.subtree(all, 0, budget, &mut tree);
    }
    tree
}

struct Builder<'a> {
    mesh: &'a Mesh,
    exponent: f64,
    root_area: f64,
}

impl Builder<'_> {
    /// Appends the tree over the references in preorder; spatial splits may add at most `budget` references.
    fn subtree(&self, mut references: Vec<Reference>, level: u32, budget: usize, tree: &mut BinaryBvh) {
        let (at, first) = (tree.nodes.len(), tree.order.len() as u32);
        let Box3 { lower, upper } = bounds(&references);
        tree.nodes.push(Node { lower, upper, first, count: 1, right: 0 });
        if let [only] = references[..] {
            tree.order.push(only.id);
            return;
        }
        let before = references.len();
        let left = self.divide(&mut references, level);
        let (left, right) = self.part(&references, left, level, budget).unwrap_or_else(|| {
            let right = references.split_off(left);
            (std::mem::take(&mut references), right)
        });
        drop(references);
        let budget = budget.saturating_sub(left.len() + right.len() - before);
        let area = |side: &[Reference]| side.iter().map(|r| r.bounds.half_area()).sum::<f64>();
        let (area_left, area_right) = (area(&left), area(&right));
        let share = if area_left + area_right > 0.0 { area_left / (area_left + area_right) } else { 0.5 };
        let for_left = (budget as f64 * share) as usize;
        self.subtree(left, level + 1, for_left, tree);
        tree.nodes[at].right = tree.nodes.len() as u32;
        self.subtree(right, level + 1, budget - for_left.min(budget), tree);
        tree.nodes[at].count = tree.order.len() as u32 - first;
    }

    fn cost(&self, area: f64, count: usize) -> f64 {
        area * (count as f64).powf(self.exponent)
    }

    /// Partitions the references by an object split; returns how many are on the left.
    fn divide(&self, references: &mut [Reference], level: u32) -> usize {
        let middle = references.len() / 2;
        if level >= HALVED_FROM {
            return middle;
        }
        let whole = |area, count| area * count as f64;
        let Some(SplitPlane { axis, at, .. }) = split_plane::by_centers(references, &whole) else {
            return middle;
        };
        references.sort_by_key(|r| r.bounds.center(axis) >= at);
        references.partition_point(|r| r.bounds.center(axis) < at)
    }

    /// Both sides of the best spatial split, if it costs less than the object split after the first `left` references.
    fn part(
        &self,
        references: &[Reference],
        left: usize,
        level: u32,
        budget: usize,
    ) -> Option<(Vec<Reference>, Vec<Reference>)> {
        if budget == 0 || level >= HALVED_FROM {
            return None;
        }
        let (a, b) = (bounds(&references[..left]), bounds(&references[left..]));
        if a.intersection(&b).half_area() <= OVERLAP * self.root_area {
            return None;
        }
        let whole = self.cost(a.half_area(), left) + self.cost(b.half_area(), references.len() - left);
        let plane = split_plane::by_space(self.mesh, references, &|area, count| self.cost(area, count))?;
        if plane.cost >= whole {
            return None;
        }
        let (left, right) = self.sides(references, &plane);
        let count = references.len();
        let fewer = left.len().max(right.len()) < count && !left.is_empty() && !right.is_empty();
        (fewer && left.len() + right.len() - count <= budget).then_some((left, right))
    }

    /// The references on either side of a plane. A reference that it crosses is not split but goes to one side where that
    /// costs less ("reference unsplitting", section 4.4 of the paper).
    fn sides(&self, references: &[Reference], plane: &SplitPlane) -> (Vec<Reference>, Vec<Reference>) {
        let &SplitPlane { axis, at, .. } = plane;
        let (mut left, mut right, mut both) = (Vec::new(), Vec::new(), Vec::new());
        for reference in references {
            if reference.bounds.upper[axis] <= at {
                left.push(*reference);
            } else if reference.bounds.lower[axis] >= at {
                right.push(*reference);
            } else {
                let [l, r] = parts(&self.mesh.corners(reference.id), &reference.bounds, axis, at);
                match (l.is_empty(), r.is_empty()) {
                    (false, false) => both.push((*reference, l, r)),
                    (true, _) => right.push(*reference),
                    (_, true) => left.push(*reference),
                }
            }
        }
        let (mut box_left, mut box_right) = (bounds(&left), bounds(&right));
        for (_, l, r) in &both {
            box_left.grow(l);
            box_right.grow(r);
        }
        let (mut in_left, mut in_right) = (left.len() + both.len(), right.len() + both.len());
        for (reference, l, r) in both {
            let with = |mut side: Box3| {
                side.grow(&reference.bounds);
                side
            };
            let (with_left, with_right) = (with(box_left), with(box_right));
            let cost = |l: &Box3, n, r: &Box3, m| self.cost(l.half_area(), n) + self.cost(r.half_area(), m);
            let parted = cost(&box_left, in_left, &box_right, in_right);
            let to_left = cost(&with_left, in_left, &box_right, in_right - 1);
            let to_right = cost(&box_left, in_left - 1, &with_right, in_right);
            if to_left < parted && to_left <= to_right {
                (box_left, in_right) = (with_left, in_right - 1);
                left.push(reference);
            } else if to_right < parted {
                (box_right, in_left) = (with_right, in_left - 1);
                right.push(reference);
            } else {
                left.push(Reference { bounds: l, ..reference });
                right.push(Reference { bounds: r, ..reference });
            }
        }
        (left, right)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bth_random::Rng;
    use std::collections::BTreeSet;

    /// Long thin triangles across each other.
    fn needles(count: usize) -> Mesh {
        let mut rng = Rng::new(3);
        let mut mesh = Mesh::default();
        for t in 0..count as u32 {
            for _ in 0..3 {
                mesh.positions.push(std::array::from_fn(|_| rng.unit_f32()));
            }
            mesh.triangles.push([3 * t, 3 * t + 1, 3 * t + 2]);
        }
        mesh
    }

    #[test]
    fn trees_are_whole_and_within_the_budget() {
        let mesh = needles(400);
        let tree = build(&mesh, 1.0);
        let seen: BTreeSet<u32> = tree.order.iter().copied().collect();
        assert_eq!(seen.len(), 400);
        assert!(tree.order.len() > 400 && tree.order.len() <= 520, "{}", tree.order.len());
        assert_eq!(tree.nodes.len(), 2 * tree.order.len() - 1);
        for (at, node) in tree.nodes.iter().enumerate().filter(|(_, node)| !node.is_leaf()) {
            let (left, right) = (&tree.nodes[at + 1], &tree.nodes[node.right as usize]);
            assert_eq!((left.first, right.first), (node.first, node.first + left.count));
            assert_eq!(left.count + right.count, node.count);
            let bounds = |n: &Node| Box3 { lower: n.lower, upper: n.upper };
            for child in [left, right] {
                assert_eq!(bounds(node).intersection(&bounds(child)), bounds(child));
            }
        }
    }
}
