//! Boxes, and the slots of a node.

use crate::error::{Code, Error, Result};
use crate::layout::*;
use std::mem::offset_of;

/// Returns true if a box is finite and `lower <= upper` on every axis.
pub(super) fn is_box(lower: [f32; 3], upper: [f32; 3]) -> bool {
    (0..3).all(|a| lower[a].is_finite() && upper[a].is_finite() && lower[a] <= upper[a])
}

/// BTH-F111 and BTH-F112: used slots come first and have boxes, empty ones hold the empty box.
/// `start` is the node's first byte in LINES.
pub(super) fn check_slots(node: &WideNode, start: u64) -> Result<()> {
    let used = node.child.iter().take_while(|c| **c != NONE).count();
    let fail = |code, offset: usize, expected: &'static str, found: String| {
        Err(Error::within(code, kind::LINES, start + offset as u64, expected, found))
    };
    if used == 0 {
        return fail(Code::Slots, offset_of!(WideNode, child), "at least one child", "none".into());
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
