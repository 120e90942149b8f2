//! The tree of nodes and leaves.
//!
//! Child codes are followed from the root with an explicit stack. A block of LINES is claimed when
//! a code leads to it, and a half line that is claimed twice is an error. So every block is visited
//! once, the work is O(lines), and there is no cycle.

use super::bit_set::BitSet;
use super::places::Placed;
use super::{leaves, nodes};
use crate::error::{Code, Error, Result};
use crate::layout::*;
use crate::limits::MAX_DEPTH;
use crate::object::ObjectView;
use std::borrow::Cow;
use std::mem::offset_of;

/// A child code that is still to be followed, and its place.
struct Reference {
    code: u32,
    /// Nodes on the path from the root to it.
    depth: u32,
    /// First half line of the node that holds it; `None` where no node does.
    parent: Option<u64>,
    /// Section that holds it.
    section: u32,
    /// Its byte in that section.
    at: u64,
}

impl Reference {
    fn error(
        &self,
        code: Code,
        expected: impl Into<Cow<'static, str>>,
        found: impl Into<Cow<'static, str>>,
    ) -> Error {
        Error::within(code, self.section, self.at, expected, found)
    }
}

/// Checks that the blocks of LINES and the tet leaves form one tree that covers both: BTH-F105 to
/// BTH-F115, BTH-F117, BTH-F118, BTH-F123, BTH-F169 and BTH-F187.
pub(super) fn check(view: &ObjectView) -> Result<()> {
    let mut tree = TreeCheck {
        view,
        claimed: BitSet::new(2 * view.lines.len()),
        referenced: BitSet::new(view.tet_leaves.len()),
        placed: Placed::new(view),
        stack: Vec::new(),
    };
    let at = offset_of!(Object, root) as u64;
    let code = view.header.root;
    tree.stack.push(Reference { code, depth: 0, parent: None, section: kind::OBJECT, at });
    while let Some(reference) = tree.stack.pop() {
        if reference.code != NONE {
            tree.follow(&reference)?;
        }
    }
    tree.check_claimed()?;
    tree.check_referenced()?;
    tree.placed.check(view)
}

struct TreeCheck<'a> {
    view: &'a ObjectView<'a>,
    /// Half lines that belong to a block. Leaves on a grid start at any half line, all other blocks
    /// at a line.
    claimed: BitSet,
    /// Tet leaves that a code leads to.
    referenced: BitSet,
    placed: Placed,
    stack: Vec<Reference>,
}

impl TreeCheck<'_> {
    /// Checks what a code leads to, and pushes the codes found there.
    fn follow(&mut self, reference: &Reference) -> Result<()> {
        let child = self.child(reference)?;
        if let Child::Tets(row) = child {
            return self.follow_tet_leaf(reference, row);
        }
        let first_half = self.claim(reference, child)?;
        match child {
            Child::Node(line) => self.follow_node(reference, line, first_half),
            _ => {
                leaves::check(self.view, child, first_half * HALF_LINE as u64)?;
                self.placed.add_leaf(self.view, child)
            }
        }
    }

    /// BTH-F105: the code is of a known kind.
    fn child(&self, reference: &Reference) -> Result<Child> {
        let found = || format!("{:#010x}", reference.code);
        let unknown = || reference.error(Code::ChildCode, "a child code", found());
        Child::from_code(reference.code).ok_or_else(unknown)
    }

    /// BTH-F105, BTH-F106 and BTH-F123: the tet leaf exists, nothing else leads to it, and it leads
    /// to no BVH.
    fn follow_tet_leaf(&mut self, reference: &Reference, row: u32) -> Result<()> {
        let Some(leaf) = self.view.tet_leaves.get(row as usize) else {
            let expected = format!("a row below {}", self.view.tet_leaves.len());
            return Err(reference.error(Code::ChildRange, expected, format!("{row}")));
        };
        if self.referenced.insert(row as usize) {
            let expected = "one reference to each tet leaf";
            return Err(reference.error(Code::TetReferences, expected, format!("row {row} again")));
        }
        if leaf.subtree != NONE {
            let at = row as usize * size_of::<TetLeaf>() + offset_of!(TetLeaf, subtree);
            let (expected, found) = ("no BVH below a tet leaf, as older files have", leaf.subtree);
            let found = format!("{found:#010x}");
            return Err(Error::within(Code::ChildCode, kind::TET_LEAVES, at as u64, expected, found));
        }
        Ok(())
    }

    /// BTH-F106 to BTH-F108: the block lies within LINES, behind the node that refers to it, and no
    /// other block overlaps it. Returns its first half line.
    fn claim(&mut self, reference: &Reference, child: Child) -> Result<u64> {
        let (first, count) = self.view.half_lines(child).expect("all children but tet leaves have blocks");
        let (line, lines) = (first / 2, self.view.lines.len());
        if first + count as u64 > 2 * lines as u64 {
            let expected = format!("{} lines below {lines}", count.div_ceil(2));
            return Err(reference.error(Code::ChildRange, expected, format!("line {line}")));
        }
        if reference.parent.is_some_and(|parent| first <= parent) {
            let expected = "a line behind the parent's";
            return Err(reference.error(Code::ChildOrder, expected, format!("line {line}")));
        }
        let block = first as usize..first as usize + count;
        if let Some(half) = block.into_iter().find(|&half| self.claimed.insert(half)) {
            let found = format!("line {}, which another block has", half / 2);
            return Err(reference.error(Code::Overlap, "a block of its own", found));
        }
        Ok(first)
    }

    /// BTH-F110 to BTH-F112: the node is not too deep, and its slots and boxes are as they should.
    /// Pushes its children.
    fn follow_node(&mut self, reference: &Reference, line: u32, first_half: u64) -> Result<()> {
        let (depth, most) = (reference.depth + 1, self.view.header.depth);
        if depth > most.min(MAX_DEPTH as u32) {
            let expected = format!("at most {most} (header) and {MAX_DEPTH} nodes on a path");
            return Err(reference.error(Code::Depth, expected, format!("{depth}")));
        }
        let start = first_half * HALF_LINE as u64;
        let node = self.view.node(line);
        nodes::check_slots(node, start)?;
        self.stack.extend(node.child.iter().enumerate().rev().map(|(slot, &code)| Reference {
            code,
            depth,
            parent: Some(first_half),
            section: kind::LINES,
            at: start + (offset_of!(WideNode, child) + 4 * slot) as u64,
        }));
        Ok(())
    }

    /// BTH-F109: every line belongs to a block. On a grid a second half line that does not is zero.
    fn check_claimed(&self) -> Result<()> {
        let is_padding = |half: usize, bytes: &[u8]| {
            self.view.grid.is_some() && half % 2 == 1 && bytes.iter().all(|b| *b == 0)
        };
        let mut halves = self.view.half_line_bytes().iter().enumerate();
        match halves.find(|(half, bytes)| !self.claimed.contains(*half) && !is_padding(*half, &bytes[..])) {
            None => Ok(()),
            Some((half, _)) => {
                let at = (half * HALF_LINE) as u64;
                let (expected, found) = ("a line of a block", "no reference to it");
                Err(Error::within(Code::Unclaimed, kind::LINES, at, expected, found))
            }
        }
    }

    /// BTH-F123: a code leads to every tet leaf.
    fn check_referenced(&self) -> Result<()> {
        match (0..self.view.tet_leaves.len()).find(|&row| !self.referenced.contains(row)) {
            None => Ok(()),
            Some(row) => {
                let at = (row * size_of::<TetLeaf>()) as u64;
                let (expected, found) = ("a reference to each tet leaf", format!("none to row {row}"));
                Err(Error::within(Code::TetReferences, kind::TET_LEAVES, at, expected, found))
            }
        }
    }
}
