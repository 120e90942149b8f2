//! One node: its slots and boxes.

use super::boxes::is_box;
use crate::error::{Code, Error, Result, Text};
use crate::layout::*;
use std::mem::offset_of;

/// BTH-F112 and BTH-F111 of a packed node: its boxes can be unpacked without rounding, and its reserved fields are zero.
pub(super) fn check_packed(node: &PackedNode, start: u64) -> Result<()> {
    let fail = |code, offset: usize, expected: &'static str, found: Text| {
        Err(Error::within(code, kind::LINES, start + offset as u64, expected, found))
    };
    if !node.step.iter().all(|step| step.is_normal() && *step > 0.0 && step.to_bits() << 9 == 0) {
        let found = text!("{:?}", node.step);
        return fail(Code::ChildBounds, offset_of!(PackedNode, step), "steps that are powers of two", found);
    }
    if !node.is_exact() {
        let found = text!("{:?} and steps of {:?}", node.origin, node.step);
        return fail(
            Code::ChildBounds,
            offset_of!(PackedNode, origin),
            "an origin that makes every end an f32",
            found,
        );
    }
    if node.reserved != [0; 2] {
        let found = text!("{:?}", node.reserved);
        return fail(Code::Slots, offset_of!(PackedNode, reserved), "zeros", found);
    }
    Ok(())
}

/// BTH-F111 and BTH-F112: used slots come first and have boxes, empty ones hold the empty box. `start` is the node's first
/// byte in LINES, `codes` the offset of its child codes in the stored node.
pub(super) fn check_slots(node: &WideNode, start: u64, codes: usize) -> Result<()> {
    let used = node.child.iter().take_while(|c| **c != NONE).count();
    let fail = |code, offset: usize, expected: &'static str, found: Text| {
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
                return fail(Code::ChildBounds, 4 * i, "a finite box", text!("{lower:?} to {upper:?}"));
            }
        } else if node.child[i] != NONE || lower != [f32::MAX; 3] || upper != [-f32::MAX; 3] {
            let found = text!("child {:#010x} with {lower:?} to {upper:?} in slot {i}", node.child[i]);
            return fail(Code::Slots, 4 * i, "an empty slot behind the used ones", found);
        }
    }
    Ok(())
}
