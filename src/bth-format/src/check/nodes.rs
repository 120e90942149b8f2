//! The tree: wide nodes, leaves, and the subtrees beside tet leaves.

use super::{Bits, is_box, leaves};
use crate::error::{Code, Error, Result};
use crate::layout::*;
use crate::limits;
use crate::object::ObjectView;
use std::mem::offset_of;
use zerocopy::IntoBytes;

/// A reference to a child that is still to be visited.
struct Visit {
    code: u32,
    /// Wide nodes above it.
    depth: u32,
    /// First half line of the node that refers to it, if one does.
    parent: Option<u64>,
    /// Whether it lies in the subtree beside a tet leaf.
    in_subtree: bool,
    /// Where the reference stands: section and byte of it.
    place: (u32, u64),
}

/// Checks that the blocks of LINES and the tet leaves form one tree that covers both.
///
/// A block is claimed when it is reached; claiming a line twice is an error. So every block is
/// visited once, the work is O(lines) and there is no cycle.
pub(super) fn check(view: &ObjectView) -> Result<()> {
    // By half lines, in which leaves on a grid are counted.
    let halves = 2 * view.lines.len();
    let mut claimed = Bits::new(halves);
    let mut referenced = Bits::new(view.tet_leaves.len());
    let root = Visit {
        code: view.header.root,
        depth: 0,
        parent: None,
        in_subtree: false,
        place: (kind::OBJECT, offset_of!(Object, root) as u64),
    };
    let mut stack = vec![root];
    while let Some(visit) = stack.pop() {
        if visit.code == NONE {
            continue;
        }
        let (section, at) = visit.place;
        let fail =
            |code, expected: String, found: String| Err(Error::within(code, section, at, expected, found));
        let child = match Child::from_code(visit.code) {
            Some(Child::Tets(_)) if visit.in_subtree => None,
            Some(Child::Node(_)) if view.has_packed_nodes() => None,
            Some(Child::Packed(_)) if !view.has_packed_nodes() => None,
            child => child,
        };
        let Some(child) = child else {
            return fail(
                Code::ChildCode,
                "a child code that may stand here".into(),
                format!("{:#010x}", visit.code),
            );
        };
        let (first, count) = match (child, view.half_lines(child)) {
            (_, Some(block)) => block,
            (Child::Tets(row), _) => {
                let rows = view.tet_leaves.len();
                if row as usize >= rows {
                    return fail(Code::ChildRange, format!("a row below {rows}"), row.to_string());
                }
                if referenced.set(row as usize) {
                    return fail(
                        Code::TetReferences,
                        "one reference to each tet leaf".into(),
                        format!("row {row} again"),
                    );
                }
                let at = row as u64 * size_of::<TetLeaf>() as u64 + offset_of!(TetLeaf, subtree) as u64;
                stack.push(Visit {
                    code: view.tet_leaves[row as usize].subtree,
                    depth: visit.depth,
                    parent: None,
                    in_subtree: true,
                    place: (kind::TET_LEAVES, at),
                });
                continue;
            }
            _ => unreachable!("all but tet leaves have blocks"),
        };
        let line = first / 2;
        if first + count as u64 > halves as u64 {
            let expected = format!("{} lines below {}", count.div_ceil(2), view.lines.len());
            return fail(Code::ChildRange, expected, format!("line {line}"));
        }
        if visit.parent.is_some_and(|parent| first <= parent) {
            return fail(Code::ChildOrder, "a line behind the parent's".into(), format!("line {line}"));
        }
        for half in first as usize..first as usize + count {
            if claimed.set(half) {
                return fail(
                    Code::Overlap,
                    "a block of its own".into(),
                    format!("line {}, which another block has", half / 2),
                );
            }
        }
        let start = first * HALF_LINE as u64;
        match child {
            Child::Node(_) | Child::Packed(_) => {
                let depth = visit.depth + 1;
                if depth > view.header.depth.min(limits::MAX_DEPTH as u32) {
                    let expected = format!(
                        "at most {} (header) and {} nodes on a path",
                        view.header.depth,
                        limits::MAX_DEPTH
                    );
                    return fail(Code::Depth, expected, depth.to_string());
                }
                if let Child::Packed(line) = child {
                    packed(view.packed_node(line), start)?;
                }
                let node = view.unpacked_node(child).expect("a node");
                let codes = match child {
                    Child::Packed(_) => offset_of!(PackedNode, child),
                    _ => offset_of!(WideNode, child),
                };
                slots(&node, start, codes)?;
                for (i, &code) in node.child.iter().enumerate().rev() {
                    let at = start + (codes + 4 * i) as u64;
                    let place = (kind::LINES, at);
                    stack.push(Visit {
                        code,
                        depth,
                        parent: Some(first),
                        in_subtree: visit.in_subtree,
                        place,
                    });
                }
            }
            Child::Indexed(_) | Child::Raw(_) => leaves::check(view, child, start)?,
            Child::Tets(_) => unreachable!("handled above"),
        }
    }
    let bytes = view.lines.as_bytes();
    let may_stay = |half: usize| {
        let own = &bytes[half * HALF_LINE..][..HALF_LINE];
        view.grid.is_some() && half % 2 == 1 && own.iter().all(|b| *b == 0)
    };
    if let Some(half) = (0..halves).find(|&half| !claimed.get(half) && !may_stay(half)) {
        let at = (half * HALF_LINE) as u64;
        return Err(Error::within(
            Code::Unclaimed,
            kind::LINES,
            at,
            "a line of a block",
            "no reference to it",
        ));
    }
    if let Some(row) = (0..view.tet_leaves.len()).find(|&r| !referenced.get(r)) {
        let at = (row * size_of::<TetLeaf>()) as u64;
        let expected = "a reference to each tet leaf";
        return Err(Error::within(
            Code::TetReferences,
            kind::TET_LEAVES,
            at,
            expected,
            format!("none to row {row}"),
        ));
    }
    leaves::ids(view)
}

/// Checks that the boxes of a packed node can be unpacked without rounding.
fn packed(node: &PackedNode, start: u64) -> Result<()> {
    let fail = |code, offset: usize, expected: &str, found: String| {
        Err(Error::within(code, kind::LINES, start + offset as u64, expected, found))
    };
    if !node.step.iter().all(|step| step.is_normal() && *step > 0.0 && step.to_bits() << 9 == 0) {
        let found = format!("{:?}", node.step);
        return fail(Code::ChildBounds, offset_of!(PackedNode, step), "steps that are powers of two", found);
    }
    if !node.is_exact() {
        let found = format!("{:?} and steps of {:?}", node.origin, node.step);
        return fail(
            Code::ChildBounds,
            offset_of!(PackedNode, origin),
            "an origin that makes every end an f32",
            found,
        );
    }
    if node.reserved != [0; 2] {
        let found = format!("{:?}", node.reserved);
        return fail(Code::Slots, offset_of!(PackedNode, reserved), "zeros", found);
    }
    Ok(())
}

/// Checks which slots of a node are used, and their boxes; `start` is the node's byte, `codes` where child codes lie in it.
fn slots(node: &WideNode, start: u64, codes: usize) -> Result<()> {
    let used = node.child.iter().take_while(|c| **c != NONE).count();
    let fail = |code, offset: usize, expected: &str, found: String| {
        Err(Error::within(code, kind::LINES, start + offset as u64, expected, found))
    };
    if used == 0 {
        return fail(Code::Slots, codes, "at least one child", "none".into());
    }
    for i in 0..WIDTH {
        let lower = [0, 1, 2].map(|a| node.bounds[a][0][i]);
        let upper = [0, 1, 2].map(|a| node.bounds[a][1][i]);
        if i < used {
            if !is_box(lower, upper) {
                return fail(Code::ChildBounds, 4 * i, "a finite box", format!("{lower:?} to {upper:?}"));
            }
        } else if node.child[i] != NONE || lower != [f32::MAX; 3] || upper != [-f32::MAX; 3] {
            let found = format!("child {:#010x} with {lower:?} to {upper:?} in slot {i}", node.child[i]);
            return fail(Code::Slots, 4 * i, "an empty slot behind the used ones", found);
        }
    }
    Ok(())
}
