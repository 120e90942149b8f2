//! Writes the lines of wide trees as planned.

use super::plan::{Decision, Role, children};
use super::poses::Weighed;
use super::slot_order::SlotOrder;
use super::wide::{CollapseReport, Wide};
use super::wide_lines::{indexed_leaf, put, raw_leaf, wide_node};
use super::{BinaryBvh, zeroed};
use bth_format::layout::{CacheLine, Child, INDEXED_LINES, NODE_LINES, NONE, RAW_LINES, WIDTH};
use bth_import::Mesh;
use bth_import::error::{Error, Result};
use bth_import::monitor::Monitor;
use rayon::prelude::*;

/// A wide node before its lines are written.
struct Inner {
    /// Its slots in `Writer::tree`'s list.
    first: usize,
    count: usize,
}

/// A slot that is not decided yet.
struct Pending {
    slot: usize,
    /// Wide nodes above it.
    level: u32,
}

/// A slot of a wide node.
struct Slot {
    /// Node of the binary BVH.
    node: u32,
    /// Child code, once it is assigned.
    code: u32,
}

/// Leaves that one task writes.
const LEAVES_AT_ONCE: usize = 1 << 10;

/// A triangle leaf.
#[derive(Clone, Copy)]
struct Leaf {
    /// Node of the binary BVH.
    node: u32,
    /// True if its triangles do not share vertices.
    raw: bool,
}

impl Leaf {
    fn lines(&self) -> usize {
        if self.raw { RAW_LINES } else { INDEXED_LINES }
    }

    fn child(&self, line: usize) -> Child {
        if self.raw { Child::Raw(line as u32) } else { Child::Indexed(line as u32) }
    }
}

/// What some leaves add behind their lines.
#[derive(Default)]
struct WrittenLeaves {
    /// Ids of their triangles.
    ids: Vec<u32>,
    /// Rows of their vertices, if these are recorded.
    vertices: Vec<[u32; WIDTH]>,
}

/// Writes the nodes and leaves of a planned tree.
pub(super) struct Writer<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) bvh: &'a BinaryBvh,
    pub(super) weighed: Weighed<'a>,
    pub(super) cut: &'a [u32],
    pub(super) decisions: &'a [Decision],
    pub(super) slot_order: SlotOrder<'a>,
    pub(super) leaf_vertices: bool,
    pub(super) monitor: &'a dyn Monitor,
    pub(super) wide: &'a mut Wide,
    pub(super) report: &'a mut CollapseReport,
}

impl Writer<'_> {
    /// Writes the tree, nodes before leaves. Returns the root's code.
    pub(super) fn tree(&mut self) -> Result<u32> {
        // First the shape is determined: slot 0 holds the root, every other slot belongs to a node.
        let mut slots = vec![Slot { node: 0, code: NONE }];
        let mut inner: Vec<Inner> = Vec::new();
        let mut leaves: Vec<usize> = Vec::new();
        let mut pending = vec![Pending { slot: 0, level: 0 }];
        while let Some(Pending { slot, level }) = pending.pop() {
            let at = slots[slot].node;
            let decision = self.decisions[at as usize];
            if decision.is_cut() {
                let row = self.cut.binary_search(&at).expect("only cut nodes are marked so");
                slots[slot].code = Child::Tets(row as u32).code();
                self.report.tet_leaves += 1;
                continue;
            }
            if decision.role() != Role::Node {
                leaves.push(slot);
                continue;
            }
            slots[slot].code = Child::Node((inner.len() * NODE_LINES) as u32).code();
            let first = slots.len();
            let mut children = children(self.bvh, self.decisions, at);
            self.slot_order.sort(&mut children);
            slots.extend(children.into_iter().map(|node| Slot { node, code: NONE }));
            inner.push(Inner { first, count: slots.len() - first });
            self.wide.depth = self.wide.depth.max(level + 1);
            self.report.node_visits += self.area(at);
            pending.extend((first..slots.len()).rev().map(|slot| Pending { slot, level: level + 1 }));
        }

        // Leaves follow the nodes.
        let leaves_from = inner.len() * NODE_LINES;
        let mut next = leaves_from;
        let mut placed = Vec::with_capacity(leaves.len());
        for &slot in &leaves {
            let node = slots[slot].node;
            let leaf = Leaf { node, raw: self.decisions[node as usize].role() == Role::Raw };
            slots[slot].code = leaf.child(next).code();
            next += leaf.lines();
            check_lines(next)?;
            self.report.leaf_visits += self.area(node);
            placed.push(leaf);
        }
        check_lines(next)?;

        self.wide.lines = zeroed(next);
        let widened = self.wide.widened_boxes;
        let node_lines = self.wide.lines[..leaves_from].par_chunks_mut(NODE_LINES);
        node_lines.zip(inner.par_iter()).for_each(|(lines, &Inner { first, count })| {
            let slots =
                slots[first..first + count].iter().map(|s| (&self.bvh.nodes[s.node as usize], s.code));
            put(lines, 0, &wide_node(slots, widened));
        });
        self.leaves(&placed, leaves_from)?;
        self.report.nodes += inner.len() as u64;
        self.report.children += slots.len() as u64 - 1;
        Ok(slots[0].code)
    }

    /// Writes triangle leaves, one behind the other from a line on, and their triangles' ids.
    fn leaves(&mut self, leaves: &[Leaf], line: usize) -> Result<()> {
        let count = |leaf: &Leaf| self.bvh.nodes[leaf.node as usize].count as usize;
        let mut parts = Vec::with_capacity(leaves.len().div_ceil(LEAVES_AT_ONCE));
        let mut lines = &mut self.wide.lines[line..];
        let mut first = self.wide.triangle_ids.len();
        for leaves in leaves.chunks(LEAVES_AT_ONCE) {
            let own;
            (own, lines) = lines.split_at_mut(leaves.iter().map(Leaf::lines).sum());
            parts.push((leaves, own, first as u32));
            first += leaves.iter().map(count).sum::<usize>();
        }
        let (mesh, bvh, monitor, recorded) = (self.mesh, self.bvh, self.monitor, self.leaf_vertices);
        let write = |(leaves, lines, first): (&[Leaf], &mut [CacheLine], u32)| {
            monitor.check()?;
            let mut written = WrittenLeaves::default();
            let mut at = 0;
            for leaf in leaves {
                let node = &bvh.nodes[leaf.node as usize];
                let ids = &bvh.order[node.first as usize..][..node.count as usize];
                let first = first + written.ids.len() as u32;
                written.ids.extend_from_slice(ids);
                let mut record = |rows: &[[u32; WIDTH]]| {
                    if recorded {
                        written.vertices.extend_from_slice(rows);
                    }
                };
                if leaf.raw {
                    let (raw, rows) = raw_leaf(mesh, ids, first);
                    put(lines, at, &raw);
                    record(&rows);
                } else {
                    let (indexed, rows) = indexed_leaf(mesh, ids, first);
                    put(lines, at, &indexed);
                    record(&[rows]);
                }
                at += leaf.lines();
            }
            Ok(written)
        };
        let parts = parts.into_par_iter().map(write).collect::<Result<Vec<_>>>()?;
        for part in parts {
            self.wide.triangle_ids.extend(part.ids);
            self.wide.leaf_vertices.extend(part.vertices);
        }
        for leaf in leaves {
            let triangles = u64::from(self.bvh.nodes[leaf.node as usize].count);
            let report = &mut *self.report;
            let (leaves, in_them) = match leaf.raw {
                true => (&mut report.raw_leaves, &mut report.raw_triangles),
                false => (&mut report.indexed_leaves, &mut report.indexed_triangles),
            };
            *leaves += 1;
            *in_them += triangles;
        }
        Ok(())
    }

    fn area(&self, at: u32) -> f64 {
        self.weighed.area(at)
    }
}

pub(super) fn check_lines(lines: usize) -> Result<()> {
    if lines <= Child::INDEX_LIMIT as usize {
        return Ok(());
    }
    Err(Error::Limit {
        code: "BTH-L202",
        message: format!(
            "the BVH needs {lines} lines of 64 bytes; an object can have {}",
            Child::INDEX_LIMIT
        ),
    })
}
