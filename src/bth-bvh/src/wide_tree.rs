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

/// Blocks that one task writes.
const BLOCKS_AT_ONCE: usize = 1 << 10;

/// What a slot leads to, but for tet leaves.
#[derive(Clone, Copy)]
enum Block {
    /// A wide node and the slots of its children.
    Node { slot: usize, first: usize, count: usize, leads_to_nodes: bool },
    /// A triangle leaf, raw if its triangles do not share vertices.
    Leaf { slot: usize, raw: bool },
}

impl Block {
    fn slot(&self) -> usize {
        match *self {
            Block::Node { slot, .. } | Block::Leaf { slot, .. } => slot,
        }
    }

    fn lines(&self) -> usize {
        match self {
            Block::Node { .. } => NODE_LINES,
            Block::Leaf { raw: true, .. } => RAW_LINES,
            Block::Leaf { raw: false, .. } => INDEXED_LINES,
        }
    }

    fn child(&self, line: usize) -> Child {
        match self {
            Block::Node { .. } => Child::Node(line as u32),
            Block::Leaf { raw: true, .. } => Child::Raw(line as u32),
            Block::Leaf { raw: false, .. } => Child::Indexed(line as u32),
        }
    }
}

/// What leaves add to the sections behind the lines.
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
    /// Writes the tree. Returns the root's code.
    ///
    /// The nodes that lead to nodes come first: they are few, and most rays enter them. Each other
    /// node is followed by its leaves, so that a ray reads neighbouring pages. Where the vertices
    /// of leaves are recorded all nodes come first, which refitting relies on.
    pub(super) fn tree(&mut self) -> Result<u32> {
        let (mut slots, blocks) = self.shape();
        let is_first = |block: &&Block| match block {
            Block::Node { leads_to_nodes, .. } => self.leaf_vertices || *leads_to_nodes,
            Block::Leaf { .. } => false,
        };
        let rest = blocks.iter().filter(|block| !is_first(block));
        let blocks: Vec<Block> = blocks.iter().filter(is_first).chain(rest).copied().collect();
        let mut next = 0;
        for block in &blocks {
            slots[block.slot()].code = block.child(next).code();
            next += block.lines();
            check_lines(next)?;
        }
        self.wide.lines = zeroed(next);
        self.write(&slots, &blocks)?;
        self.report(&slots, &blocks);
        Ok(slots[0].code)
    }

    /// Determines the shape of the tree: its slots, and its blocks in depth-first order. The first
    /// slot holds the root, and every other belongs to a node.
    fn shape(&mut self) -> (Vec<Slot>, Vec<Block>) {
        let mut slots = vec![Slot { node: 0, code: NONE }];
        let mut blocks = Vec::new();
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
                blocks.push(Block::Leaf { slot, raw: decision.role() == Role::Raw });
                continue;
            }
            let first = slots.len();
            let mut children = children(self.bvh, self.decisions, at);
            self.slot_order.sort(&mut children);
            let is_node = |child: &u32| {
                let decision = self.decisions[*child as usize];
                !decision.is_cut() && decision.role() == Role::Node
            };
            let leads_to_nodes = children.iter().any(is_node);
            slots.extend(children.into_iter().map(|node| Slot { node, code: NONE }));
            blocks.push(Block::Node { slot, first, count: slots.len() - first, leads_to_nodes });
            self.wide.depth = self.wide.depth.max(level + 1);
            pending.extend((first..slots.len()).rev().map(|slot| Pending { slot, level: level + 1 }));
        }
        (slots, blocks)
    }

    /// Writes all blocks, one behind the other, and the ids of the triangles.
    fn write(&mut self, slots: &[Slot], blocks: &[Block]) -> Result<()> {
        let node_of = |slot: &Slot| &self.bvh.nodes[slot.node as usize];
        let mut parts = Vec::with_capacity(blocks.len().div_ceil(BLOCKS_AT_ONCE));
        let mut lines = &mut self.wide.lines[..];
        let mut first = self.wide.triangle_ids.len();
        for blocks in blocks.chunks(BLOCKS_AT_ONCE) {
            let own;
            (own, lines) = lines.split_at_mut(blocks.iter().map(Block::lines).sum());
            parts.push((blocks, own, first as u32));
            let leaves = blocks.iter().filter(|block| matches!(block, Block::Leaf { .. }));
            first += leaves.map(|leaf| node_of(&slots[leaf.slot()]).count as usize).sum::<usize>();
        }
        let (mesh, bvh, monitor, recorded) = (self.mesh, self.bvh, self.monitor, self.leaf_vertices);
        let widened = self.wide.widened_boxes;
        let write = |(blocks, lines, first): (&[Block], &mut [CacheLine], u32)| {
            monitor.check()?;
            let mut written = WrittenLeaves::default();
            let mut at = 0;
            for block in blocks {
                let node = node_of(&slots[block.slot()]);
                let ids = &bvh.order[node.first as usize..][..node.count as usize];
                let row = first + written.ids.len() as u32;
                let mut record = |rows: &[[u32; WIDTH]]| {
                    written.ids.extend_from_slice(ids);
                    if recorded {
                        written.vertices.extend_from_slice(rows);
                    }
                };
                match *block {
                    Block::Node { first, count, .. } => {
                        let children = slots[first..first + count].iter().map(|s| (node_of(s), s.code));
                        put(lines, at, &wide_node(children, widened));
                    }
                    Block::Leaf { raw: true, .. } => {
                        let (leaf, rows) = raw_leaf(mesh, ids, row);
                        put(lines, at, &leaf);
                        record(&rows);
                    }
                    Block::Leaf { raw: false, .. } => {
                        let (leaf, rows) = indexed_leaf(mesh, ids, row);
                        put(lines, at, &leaf);
                        record(&[rows]);
                    }
                }
                at += block.lines();
            }
            Ok(written)
        };
        let parts = parts.into_par_iter().map(write).collect::<Result<Vec<_>>>()?;
        for part in parts {
            self.wide.triangle_ids.extend(part.ids);
            self.wide.leaf_vertices.extend(part.vertices);
        }
        Ok(())
    }

    /// Counts the blocks and what rays visit of them.
    fn report(&mut self, slots: &[Slot], blocks: &[Block]) {
        self.report.children += slots.len() as u64 - 1;
        for block in blocks {
            let at = slots[block.slot()].node;
            let (area, report) = (self.weighed.area(at), &mut *self.report);
            let (leaves, in_them) = match block {
                Block::Node { .. } => {
                    report.nodes += 1;
                    report.node_visits += area;
                    continue;
                }
                Block::Leaf { raw: true, .. } => (&mut report.raw_leaves, &mut report.raw_triangles),
                Block::Leaf { raw: false, .. } => (&mut report.indexed_leaves, &mut report.indexed_triangles),
            };
            report.leaf_visits += area;
            *leaves += 1;
            *in_them += u64::from(self.bvh.nodes[at as usize].count);
        }
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
