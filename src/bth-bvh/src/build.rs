//! Top-down construction of the binary BVH.

use super::binned_split::{Centers, Measured, Sides, measure};
use super::bounds::Bounds;
use super::extent::Extent;
use super::split::Reference;
use super::{BinaryBvh, MAX_LEVELS, Node, binned_split, linked_tree::LinkedTree, reinsertion, sweep_split};
use bth_import::Mesh;
use bth_import::error::{Error, Result};
use bth_import::monitor::Monitor;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Subtrees of more triangles are built as separate tasks. Each of these checks for cancellation
/// first.
const BUILD_TASK: usize = 1 << 12;

/// How much time to spend on the tree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Quality {
    /// Binned SAH with 16 bins.
    Fast,
    /// Binned SAH with 32 bins, full sweep in small nodes, two passes of reinsertion of the largest
    /// nodes; the wide nodes are chosen by what sample rays enter.
    #[default]
    Balanced,
    /// Full-sweep SAH except in the topmost nodes, where 32 bins give trees as good; three passes
    /// of reinsertion.
    Best,
}

/// Parameters of the builder that a [`Quality`] selects.
#[derive(Clone, Debug, PartialEq)]
pub struct Effort {
    /// Bins per axis, at most 32.
    pub bins: usize,
    /// Nodes of at most this many triangles are split by a full sweep.
    pub sweep_count: usize,
    /// Share of the nodes, largest first, that each pass of reinsertion tries to move. Two short
    /// passes reduce the cost more than a long one (measured on rooms and a car).
    pub reinsertion: Vec<f64>,
}

impl Quality {
    /// The parameters of this quality.
    pub fn effort(self) -> Effort {
        let (bins, sweep_count, reinsertion): (_, _, &[f64]) = match self {
            Quality::Fast => (16, 8, &[]),
            Quality::Balanced => (32, 64, &[0.05, 0.1]),
            Quality::Best => (32, 1 << 14, &[0.1, 0.5, 0.5]),
        };
        Effort { bins, sweep_count, reinsertion: reinsertion.to_vec() }
    }
}

/// Options of [`build`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BvhOptions {
    /// How much time to spend on the tree.
    pub quality: Quality,
    /// True if triangles of zero area are kept in the tree: deformable objects may give them an
    /// area.
    pub keep_zero_area: bool,
}

/// Report of [`build`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BvhReport {
    /// Triangles in the tree.
    pub triangles: u64,
    /// Triangles of exactly zero area, which are not in the tree.
    pub dropped: u64,
    /// Nodes of the tree, leaves included.
    pub nodes: u64,
    /// Edges on the longest path from the root.
    pub levels: u32,
    /// Nodes that a random line through the root's box enters, on average: the sum of the nodes'
    /// areas over the root's. One value after the top-down build, one after each pass of
    /// reinsertion.
    pub visits: Vec<f64>,
    /// Subtrees that each pass of reinsertion moved.
    pub moved: Vec<u64>,
}

impl BvhReport {
    fn measure(&mut self, bvh: &BinaryBvh) {
        self.nodes = bvh.nodes.len() as u64;
        self.levels = levels_below(bvh, 0);
    }

    /// Adds the report on a part of a mesh, where rays enter the box of this share of the area.
    pub fn add(&mut self, part: &BvhReport, share: f64) {
        self.triangles += part.triangles;
        self.nodes += part.nodes;
        self.levels = self.levels.max(part.levels);
        sum_up(&mut self.visits, part.visits.iter().map(|visits| visits * share));
        sum_up(&mut self.moved, part.moved.iter().copied());
    }
}

/// Adds values row by row.
fn sum_up<T: Default + Clone + std::ops::AddAssign>(
    sums: &mut Vec<T>,
    values: impl ExactSizeIterator<Item = T>,
) {
    sums.resize(sums.len().max(values.len()), T::default());
    sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
}

/// Builds the binary BVH of all triangles, down to single triangles. Skips triangles of zero area
/// unless the options keep them. The result depends on mesh and options alone, not on the number of
/// threads.
///
/// # Errors
/// [`Error::Internal`] when the mesh breaks its contract (indices in range, positions finite),
/// [`Error::Limit`] beyond `bth_format::limits::MAX_TRIANGLES`, [`Error::Cancelled`].
pub fn build(mesh: &Mesh, options: &BvhOptions, monitor: &dyn Monitor) -> Result<(BinaryBvh, BvhReport)> {
    build_with(mesh, &options.quality.effort(), options.keep_zero_area, monitor)
}

/// Builds the tree of [`build`] with any effort.
pub(super) fn build_with(
    mesh: &Mesh,
    effort: &Effort,
    keep_zero_area: bool,
    monitor: &dyn Monitor,
) -> Result<(BinaryBvh, BvhReport)> {
    over_used(mesh, keep_zero_area, |used, report| build_over(mesh, &used, effort, report, monitor))
}

/// Builds the tree of some triangles of a mesh, at least one, which has been checked
/// ([`Parts::of`](super::Parts::of)).
///
/// # Errors
/// [`Error::Cancelled`].
pub fn build_part(
    mesh: &Mesh,
    ids: &[u32],
    quality: Quality,
    monitor: &dyn Monitor,
) -> Result<(BinaryBvh, BvhReport)> {
    let mut report = BvhReport { triangles: ids.len() as u64, ..BvhReport::default() };
    let bvh = build_over(mesh, ids, &quality.effort(), &mut report, monitor)?;
    report.measure(&bvh);
    Ok((bvh, report))
}

fn build_over(
    mesh: &Mesh,
    ids: &[u32],
    effort: &Effort,
    report: &mut BvhReport,
    monitor: &dyn Monitor,
) -> Result<BinaryBvh> {
    let reference = |&id: &u32| Reference { bounds: Bounds::of_points(&mesh.corners(id)), id };
    let bvh = split_all(ids.par_iter().map(reference).collect(), effort, monitor)?;
    report.visits.push(visits(&bvh));
    if effort.reinsertion.is_empty() || bvh.nodes.len() <= 3 {
        return Ok(bvh);
    }
    reinsert(LinkedTree::new(&bvh), bvh, &effort.reinsertion, report, monitor)
}

/// Builds the tree by `build`, which gets the ids of the triangles to hold, at least one.
pub(super) fn over_used(
    mesh: &Mesh,
    keep_zero_area: bool,
    build: impl FnOnce(Vec<u32>, &mut BvhReport) -> Result<BinaryBvh>,
) -> Result<(BinaryBvh, BvhReport)> {
    check_mesh(mesh)?;
    let ids = (0..mesh.triangles.len() as u32).into_par_iter();
    let used: Vec<u32> = ids.filter(|id| keep_zero_area || !mesh.has_zero_area(*id)).collect();
    let mut report = BvhReport {
        triangles: used.len() as u64,
        dropped: (mesh.triangles.len() - used.len()) as u64,
        ..BvhReport::default()
    };
    if used.is_empty() {
        return Ok((BinaryBvh::default(), report));
    }
    let bvh = build(used, &mut report)?;
    report.measure(&bvh);
    Ok((bvh, report))
}

/// Splits the references, at least one, from the top down.
pub(super) fn split_all<E: Extent>(
    mut references: Vec<Reference<E>>,
    effort: &Effort,
    monitor: &dyn Monitor,
) -> Result<BinaryBvh> {
    monitor.stage("build", Some(references.len() as u64));
    let mut nodes = super::zeroed(2 * references.len() - 1);
    let mut scratch = sweep_split::Scratch::default();
    let builder = Builder { effort, monitor };
    builder.subtree(&mut references, None, &mut nodes, Destination::ROOT, &mut scratch)?;
    Ok(BinaryBvh { nodes, order: references.iter().map(|r| r.id).collect() })
}

/// Moves subtrees of a linked tree to positions of lower cost, in passes that each try a share of
/// the nodes. Boxes of leaves do not change.
pub(super) fn reinsert<E: Extent>(
    mut tree: LinkedTree<E>,
    bvh: BinaryBvh,
    passes: &[f64],
    report: &mut BvhReport,
    monitor: &dyn Monitor,
) -> Result<BinaryBvh> {
    monitor.stage("reinsertion", None);
    for &share in passes {
        report.moved.push(reinsertion::pass(&mut tree, share, monitor)?);
        report.visits.push(tree.visits());
    }
    Ok(tree.into_preorder(bvh))
}

pub(super) fn check_mesh(mesh: &Mesh) -> Result<()> {
    let internal = |message: String| Err(Error::Internal { code: "BTH-X201", message });
    if mesh.triangles.len() > bth_format::limits::MAX_TRIANGLES as usize {
        return Err(Error::Limit {
            code: "BTH-L201",
            message: format!(
                "the mesh has {} triangles; an object can have {}",
                mesh.triangles.len(),
                bth_format::limits::MAX_TRIANGLES
            ),
        });
    }
    let rows = mesh.positions.len();
    if let Some(t) = mesh.triangles.par_iter().position_first(|t| t.iter().any(|&v| v as usize >= rows)) {
        return internal(format!("triangle {t} refers to a position beyond the last ({rows} positions)"));
    }
    if let Some(v) = mesh.positions.par_iter().position_first(|p| p.iter().any(|x| !x.is_finite())) {
        return internal(format!("position {v} is not finite"));
    }
    Ok(())
}

/// Where the nodes and rows of a subtree go.
#[derive(Clone, Copy)]
struct Destination {
    /// Index of its root.
    node: u32,
    /// First row of `order`.
    first: u32,
    /// Edges from the root.
    level: u32,
}

impl Destination {
    const ROOT: Destination = Destination { node: 0, first: 0, level: 0 };
}

struct Builder<'a> {
    effort: &'a Effort,
    monitor: &'a dyn Monitor,
}

impl Builder<'_> {
    /// Fills `nodes` (of length `2 * references.len() - 1`) with the subtree over the references,
    /// in preorder. Measures them if they are not.
    fn subtree<E: Extent>(
        &self,
        references: &mut [Reference<E>],
        measured: Option<Measured<E>>,
        nodes: &mut [Node],
        to: Destination,
        scratch: &mut sweep_split::Scratch<E>,
    ) -> Result<()> {
        let count = references.len();
        let task = count > BUILD_TASK;
        if task {
            self.monitor.check()?;
        }
        let Measured { bounds, centers } = measured.unwrap_or_else(|| measure(references));
        let bounds = bounds.node_box();
        let (lower, upper) = (bounds.lower(), bounds.upper());
        nodes[0] = Node { lower, upper, first: to.first, count: count as u32, right: 0 };
        if count == 1 {
            return Ok(());
        }
        let Sides { left, measured: [a, b] } = self.split(references, &centers, to.level, scratch);
        let right = to.node + 2 * left as u32;
        nodes[0].right = right;
        let (left_references, right_references) = references.split_at_mut(left);
        let (left_nodes, right_nodes) = nodes[1..].split_at_mut(2 * left - 1);
        let level = to.level + 1;
        let left_to = Destination { node: to.node + 1, first: to.first, level };
        let right_to = Destination { node: right, first: to.first + left as u32, level };
        if !task {
            self.subtree(left_references, a, left_nodes, left_to, scratch)?;
            return self.subtree(right_references, b, right_nodes, right_to, scratch);
        }
        let (a, b) = rayon::join(
            || self.task(left_references, a, left_nodes, left_to),
            || self.task(right_references, b, right_nodes, right_to),
        );
        a.and(b)
    }

    /// Does the same as [`Self::subtree`], with separate buffers.
    fn task<E: Extent>(
        &self,
        references: &mut [Reference<E>],
        measured: Option<Measured<E>>,
        nodes: &mut [Node],
        to: Destination,
    ) -> Result<()> {
        self.subtree(references, measured, nodes, to, &mut sweep_split::Scratch::default())?;
        if references.len() <= BUILD_TASK {
            self.monitor.advance(references.len() as u64);
        }
        Ok(())
    }

    /// Partitions the references. The left part has 1 to one less than all.
    fn split<E: Extent>(
        &self,
        references: &mut [Reference<E>],
        centers: &Centers<E>,
        level: u32,
        scratch: &mut sweep_split::Scratch<E>,
    ) -> Sides<E> {
        let count = references.len();
        if count == 2 {
            return 1.into();
        }
        // Halving needs ceil(log2(count)) levels. SAH may split as it likes while enough levels
        // remain for halving; else the node is halved.
        let halvings = usize::BITS - (count - 1).leading_zeros();
        if level + 1 + halvings > MAX_LEVELS {
            return split_median(references, centers).into();
        }
        if centers.coincide() {
            return split_by_id(references).into();
        }
        if count <= self.effort.sweep_count {
            return sweep_split::split(references, scratch).into();
        }
        binned_split::split(references, centers, self.effort.bins)
            .unwrap_or_else(|| split_median(references, centers).into())
    }
}

/// Halves the references by the order of their centres along the widest axis.
fn split_median<E: Extent>(references: &mut [Reference<E>], centers: &Centers<E>) -> usize {
    let axis = centers.widest();
    let middle = references.len() / 2;
    references.select_nth_unstable_by(middle, |a, b| {
        let center = |r: &Reference<E>| r.bounds.half_center().as_ref()[axis];
        let (x, y) = (center(a), center(b));
        x.total_cmp(&y).then(a.id.cmp(&b.id))
    });
    middle
}

/// Halves references with equal centres by id.
fn split_by_id<E: Extent>(references: &mut [Reference<E>]) -> usize {
    let middle = references.len() / 2;
    references.select_nth_unstable_by_key(middle, |r| r.id);
    middle
}

/// Nodes that a random line through the root's box enters on average; see [`BvhReport::visits`].
fn visits(bvh: &BinaryBvh) -> f64 {
    let area = |node: &Node| Bounds::of_node(node).half_area();
    let root = area(&bvh.nodes[0]);
    // A deformable mesh may lie on one line.
    if root > 0.0 { super::sum(bvh.nodes.len(), |at| area(&bvh.nodes[at as usize])) / root } else { 0.0 }
}

/// Edges on the longest path from a node.
fn levels_below(bvh: &BinaryBvh, at: u32) -> u32 {
    let node = &bvh.nodes[at as usize];
    if node.is_leaf() {
        return 0;
    }
    let [left, right] = [at + 1, node.right];
    let (left, right) = if node.count as usize > BUILD_TASK {
        rayon::join(|| levels_below(bvh, left), || levels_below(bvh, right))
    } else {
        (levels_below(bvh, left), levels_below(bvh, right))
    };
    1 + left.max(right)
}

#[cfg(test)]
#[path = "build_tests.rs"]
mod tests;
