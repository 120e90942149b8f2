//! Wide trees of meshes whose binary tree would take too much memory. The triangles are split by
//! space into parts. Their trees are built one after the other, and joined under one.

use super::bounds::Bounds;
use super::build::{check_mesh, split_all};
use super::split::Reference;
use super::wide_lines::{put, wide_node};
use super::wide_tree::check_lines;
use super::{BinaryBvh, CollapseReport, Node, Wide, zeroed};
use bth_format::layout::{CacheLine, Child, IndexedLeaf, NODE_LINES, NONE, RawLeaf, WIDTH, WideNode};
use bth_import::Mesh;
use bth_import::error::{Error, Result};
use bth_import::monitor::{Monitor, Silent};
use rayon::prelude::*;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// The triangles of a mesh that can be hit, split by space.
#[derive(Clone, Debug, PartialEq)]
pub struct Parts {
    /// Ids of the triangles of each part, ascending.
    pub ids: Vec<Vec<u32>>,
    /// A node over all triangles; `None` if there is no triangle.
    pub whole: Option<Node>,
}

impl Parts {
    /// Parts of at most `most` triangles. Their number is a power of 16, which is the number of
    /// nodes at a level of a wide tree: so joining them adds no level. Each split is at a median of
    /// the centres, along the axis in which these extend farthest.
    ///
    /// # Errors
    /// The errors of [`build`](super::build()).
    pub fn of(mesh: &Mesh, most: usize, monitor: &dyn Monitor) -> Result<Self> {
        check_mesh(mesh)?;
        monitor.stage("split into parts", None);
        let ids = (0..mesh.triangles.len() as u32).into_par_iter();
        let used: Vec<u32> = ids.filter(|id| !mesh.has_zero_area(*id)).collect();
        let bounds = |id: &u32| Bounds::of_points(&mesh.corners(*id));
        let all = used.par_iter().map(bounds).reduce(|| Bounds::EMPTY, |a, b| a.union(&b));
        let (lower, upper, count) = (all.lower(), all.upper(), used.len() as u32);
        let whole = Node { lower, upper, first: 0, count, right: 0 };
        let mut parts = Self { ids: Vec::new(), whole: (!used.is_empty()).then_some(whole) };
        if parts.whole.is_some() {
            let enough = |count: &usize| count.saturating_mul(most) >= used.len();
            let mut counts = std::iter::successors(Some(1usize), |count| Some(count.saturating_mul(WIDTH)));
            let count = counts.find(enough).unwrap_or(1);
            parts.ids = split(mesh, used, count, monitor)?;
        }
        Ok(parts)
    }
}

/// `count` parts, a power of two.
fn split(mesh: &Mesh, mut ids: Vec<u32>, count: usize, monitor: &dyn Monitor) -> Result<Vec<Vec<u32>>> {
    monitor.check()?;
    if count == 1 || ids.len() == 1 {
        ids.sort_unstable();
        return Ok(vec![ids]);
    }
    let center = |id: u32| Bounds::of_points(&mesh.corners(id)).half_center();
    let of_center = |id: &u32| Bounds::of_points(&[center(*id)]);
    let all = ids.par_iter().map(of_center).reduce(|| Bounds::EMPTY, |a, b| a.union(&b));
    let extent = |k: usize| all.upper()[k] - all.lower()[k];
    let axis = (1..3).fold(0, |most, k| if extent(k) > extent(most) { k } else { most });
    let mut keyed: Vec<(f32, u32)> = ids.par_iter().map(|&id| (center(id)[axis], id)).collect();
    let middle = ids.len() / 2;
    keyed.select_nth_unstable_by(middle, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    ids.par_iter_mut().zip(keyed).for_each(|(id, key)| *id = key.1);
    let right = ids.split_off(middle);
    ids.shrink_to_fit();
    let half = |ids| split(mesh, ids, count / 2, monitor);
    let (left, right) = rayon::join(|| half(ids), || half(right));
    let mut parts = left?;
    parts.extend(right?);
    Ok(parts)
}

/// The wide tree of a part.
pub struct Part {
    /// The tree. Its boxes are widened in all parts, or in none
    /// ([`CollapseOptions::whole`](super::CollapseOptions)).
    pub wide: Wide,
    /// The root of its binary tree.
    pub root: Node,
    /// The report on it.
    pub report: CollapseReport,
}

/// Joins the trees of parts. The upper nodes come first, then one part after the other.
///
/// # Errors
/// `BTH-L202` and `BTH-L203`, as for [`collapse`](super::collapse()); `BTH-X203` if the lines of a
/// part are no tree.
pub fn join(parts: Vec<Part>) -> Result<(Wide, CollapseReport)> {
    let (mut joined, mut report) = (Wide { root: NONE, ..Wide::default() }, CollapseReport::default());
    let Some(first) = parts.first() else { return Ok((joined, report)) };
    joined.widened_boxes = first.wide.widened_boxes;
    let upper = over_parts(&parts)?;
    let triangles: Vec<usize> = parts.iter().map(|part| part.wide.triangle_ids.len()).collect();
    let uppers = UpperNode::all(&upper, &triangles);

    // Where each part's lines and ids begin.
    let mut lines = uppers.len() * NODE_LINES;
    let mut codes = vec![NONE; upper.nodes.len()];
    let mut leaf_of = vec![0; parts.len()];
    let leaves = upper.nodes.iter().enumerate().filter(|(_, node)| node.is_leaf());
    leaves.for_each(|(at, node)| leaf_of[upper.order[node.first as usize] as usize] = at);
    for (part, &at) in parts.iter().zip(&leaf_of) {
        codes[at] = moved(part.wide.root, lines);
        lines += part.wide.lines.len();
        check_lines(lines)?;
    }
    for (row, node) in uppers.iter().enumerate() {
        codes[node.at as usize] = Child::Node((row * NODE_LINES) as u32).code();
        joined.depth = joined.depth.max(node.level);
    }

    joined.lines = zeroed(lines);
    let area = upper.nodes[0].half_area();
    let share = |node: &Node| if area > 0.0 { node.half_area() / area } else { 0.0 };
    for (row, node) in uppers.iter().enumerate() {
        let children = node.children.iter().map(|&at| (&upper.nodes[at as usize], codes[at as usize]));
        put(&mut joined.lines, row * NODE_LINES, &wide_node(children, joined.widened_boxes));
        report.nodes += 1;
        report.children += node.children.len() as u64;
        let visits = share(&upper.nodes[node.at as usize]);
        report.node_visits += visits;
        report.cost += visits;
    }
    let level_of =
        |at: usize| uppers.iter().find(|n| n.children.contains(&(at as u32))).map_or(0, |n| n.level);
    let mut line = uppers.len() * NODE_LINES;
    for (Part { mut wide, root, report: of_part }, &at) in parts.into_iter().zip(&leaf_of) {
        move_blocks(&mut wide, line, joined.triangle_ids.len()).ok_or_else(no_tree)?;
        joined.lines[line..line + wide.lines.len()].copy_from_slice(&wide.lines);
        line += wide.lines.len();
        joined.triangle_ids.extend(wide.triangle_ids);
        joined.depth = joined.depth.max(level_of(at) + wide.depth);
        report.add(&of_part, share(&root));
    }
    super::collapse::check_depth(joined.depth)?;
    report.depth = joined.depth;
    report.measure(&joined);
    joined.root = codes[0];
    Ok((joined, report))
}

fn no_tree() -> Error {
    Error::Internal { code: "BTH-X203", message: "the lines of a part are no tree".to_owned() }
}

/// A binary tree whose leaves are parts.
fn over_parts(parts: &[Part]) -> Result<BinaryBvh> {
    let reference =
        |(id, part): (usize, &Part)| Reference { bounds: Bounds::of_node(&part.root), id: id as u32 };
    let references: Vec<Reference<Bounds>> = parts.iter().enumerate().map(reference).collect();
    split_all(references, &super::Quality::Best.effort(), &Silent)
}

/// A wide node over parts.
struct UpperNode {
    /// Node of the binary tree over parts.
    at: u32,
    /// Nodes of that tree.
    children: Vec<u32>,
    /// Wide nodes on the path from the root, this one included.
    level: u32,
}

impl UpperNode {
    /// The wide nodes over a binary tree of parts with these numbers of triangles, in depth-first
    /// order; none over a single part.
    fn all(upper: &BinaryBvh, triangles: &[usize]) -> Vec<UpperNode> {
        let (mut nodes, mut pending) = (Vec::new(), vec![(0, 1)]);
        while let Some((at, level)) = pending.pop() {
            if upper.nodes[at as usize].is_leaf() {
                continue;
            }
            let children = children(upper, triangles, at);
            pending.extend(children.iter().rev().map(|&child| (child, level + 1)));
            nodes.push(UpperNode { at, children, level });
        }
        nodes
    }
}

/// The children of a wide node: the node is opened, then the child of the largest area, until there
/// are 16. The one comes last in which a ray most probably hits something, as in
/// [`slot_order`](super::slot_order).
fn children(upper: &BinaryBvh, triangles: &[usize], at: u32) -> Vec<u32> {
    let node = |at: u32| &upper.nodes[at as usize];
    let mut children = vec![at];
    while children.len() < WIDTH {
        let inner = (0..children.len()).filter(|row| !node(children[*row]).is_leaf());
        let area = |row: &usize| node(children[*row]).half_area();
        let Some(largest) = inner.max_by(|a, b| area(a).total_cmp(&area(b))) else { break };
        let opened = children.remove(largest);
        children.extend([opened + 1, node(opened).right]);
    }
    let density = |at: u32| {
        let Node { first, count, .. } = *node(at);
        let parts = &upper.order[first as usize..][..count as usize];
        parts.iter().map(|part| triangles[*part as usize]).sum::<usize>() as f64 / node(at).half_area()
    };
    children.sort_by(|a, b| density(*a).total_cmp(&density(*b)));
    children
}

/// A child code whose block is moved back by a number of lines.
fn moved(code: u32, lines: usize) -> u32 {
    let lines = lines as u32;
    match Child::from_code(code) {
        Some(Child::Node(line)) => Child::Node(line + lines).code(),
        Some(Child::Indexed(line)) => Child::Indexed(line + lines).code(),
        Some(Child::Raw(line)) => Child::Raw(line + lines).code(),
        Some(Child::Tets(_)) | None => code,
    }
}

/// Moves the children of all nodes back by a number of lines, and the ids of all leaves by a number
/// of rows. `None` if the lines are no tree.
fn move_blocks(wide: &mut Wide, lines: usize, rows: usize) -> Option<()> {
    let (mut stack, mut blocks) = (vec![wide.root], 0..wide.lines.len());
    while let Some(code) = stack.pop() {
        let child = Child::from_code(code);
        if child.is_some() {
            blocks.next()?;
        }
        match child {
            Some(Child::Node(line)) => {
                let node = block::<WideNode>(&mut wide.lines, line)?;
                stack.extend(node.child);
                node.child = node.child.map(|code| moved(code, lines));
            }
            Some(Child::Indexed(line)) => {
                let first = &mut block::<IndexedLeaf>(&mut wide.lines, line)?.first;
                *first = first.checked_add(rows as u32)?;
            }
            Some(Child::Raw(line)) => {
                let first = &mut block::<RawLeaf>(&mut wide.lines, line)?.first;
                *first = first.checked_add(rows as u32)?;
            }
            Some(Child::Tets(_)) | None => {}
        }
    }
    Some(())
}

fn block<T: FromBytes + IntoBytes + KnownLayout + Immutable>(
    lines: &mut [CacheLine],
    line: u32,
) -> Option<&mut T> {
    let start = (line as usize).checked_mul(size_of::<CacheLine>())?;
    let bytes = lines.as_mut_bytes().get_mut(start..start.checked_add(size_of::<T>())?)?;
    T::mut_from_bytes(bytes).ok()
}

#[cfg(test)]
#[path = "parts_tests.rs"]
mod tests;
