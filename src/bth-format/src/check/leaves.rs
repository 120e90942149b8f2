//! Triangle leaves and the ids that they refer to: BTH-F113 to BTH-F118.

use super::rows::check_all;
use crate::error::{Code, Error, Result};
use crate::layout::*;
use crate::object::ObjectView;
use std::mem::offset_of;

/// Checks the triangle leaf that a child leads to; `start` is its first byte in LINES.
pub(super) fn check(view: &ObjectView, child: Child, start: u64) -> Result<()> {
    let rows = view.triangle_ids.len();
    let checked = match child {
        Child::Indexed(index) => indexed(view.indexed(index, &mut None), start, rows),
        Child::Raw(index) => raw(view.raw(index, &mut None), start, rows),
        Child::Node(_) | Child::Tets(_) => Ok(()),
    };
    if view.grid.is_none() {
        return checked;
    }
    // Offsets within the unpacked leaf do not exist in the file: the error names the leaf's first
    // byte instead.
    checked.map_err(|error| error.moved_to(start))?;
    match view.unused_bits(child) {
        0 => Ok(()),
        found => Err(Error::within(Code::LeafUnused, kind::LINES, start, "0", format!("{found:#x}"))),
    }
}

/// Checks an indexed leaf; `start` is its first byte in LINES, `rows` the number of rows of
/// TRIANGLE_IDS.
fn indexed(leaf: &IndexedLeaf, start: u64, rows: usize) -> Result<()> {
    let fail = |code, offset: usize, expected: &'static str, found: String| {
        Err(Error::within(code, kind::LINES, start + offset as u64, expected, found))
    };
    counts(leaf.triangles, start + offset_of!(IndexedLeaf, triangles) as u64)?;
    counts(leaf.vertices, start + offset_of!(IndexedLeaf, vertices) as u64)?;
    range(leaf.first, leaf.triangles, rows, start + offset_of!(IndexedLeaf, first) as u64)?;
    let (triangles, vertices) = (leaf.triangles as usize, leaf.vertices as usize);
    for (k, corners) in leaf.corner.iter().enumerate() {
        for (i, &corner) in corners.iter().enumerate() {
            let offset = offset_of!(IndexedLeaf, corner) + WIDTH * k + i;
            if i < triangles && corner as usize >= vertices {
                let expected = "a corner below the number of vertices";
                return fail(Code::Corner, offset, expected, format!("{corner}"));
            }
            if i >= triangles && corner != 0 {
                return fail(Code::LeafUnused, offset, "0 in an unused slot", format!("{corner}"));
            }
        }
    }
    for (axis, row) in leaf.vertex.iter().enumerate() {
        for (i, x) in row.iter().enumerate() {
            vertex(*x, row[0], i < vertices, start + (4 * (WIDTH * axis + i)) as u64)?;
        }
    }
    if leaf.reserved != 0 {
        return fail(Code::LeafUnused, offset_of!(IndexedLeaf, reserved), "0", format!("{}", leaf.reserved));
    }
    Ok(())
}

/// Checks a raw leaf; arguments as of [`indexed`].
fn raw(leaf: &RawLeaf, start: u64, rows: usize) -> Result<()> {
    counts(leaf.triangles, start + offset_of!(RawLeaf, triangles) as u64)?;
    range(leaf.first, leaf.triangles, rows, start + offset_of!(RawLeaf, first) as u64)?;
    for (k, row) in leaf.corner.iter().flatten().enumerate() {
        for (i, x) in row.iter().enumerate() {
            vertex(*x, row[0], i < leaf.triangles as usize, start + (4 * (WIDTH * k + i)) as u64)?;
        }
    }
    if leaf.reserved != [0; 14] {
        let at = start + offset_of!(RawLeaf, reserved) as u64;
        let found = format!("{:?}", leaf.reserved);
        return Err(Error::within(Code::LeafUnused, kind::LINES, at, "zeros", found));
    }
    Ok(())
}

/// BTH-F113: a leaf has 1 to 16 triangles and vertices.
fn counts(count: u32, at: u64) -> Result<()> {
    if (1..=WIDTH as u32).contains(&count) {
        return Ok(());
    }
    Err(Error::within(Code::LeafCounts, kind::LINES, at, "1 to 16", format!("{count}")))
}

/// BTH-F115: the rows of a leaf lie within TRIANGLE_IDS.
fn range(first: u32, count: u32, rows: usize, at: u64) -> Result<()> {
    if first as u64 + count as u64 <= rows as u64 {
        return Ok(());
    }
    let (expected, found) = (format!("{count} rows below {rows}"), format!("row {first}"));
    Err(Error::within(Code::LeafIds, kind::LINES, at, expected, found))
}

/// BTH-F117 and BTH-F118: a coordinate in use is finite; an unused one repeats slot 0, bit for bit.
fn vertex(x: f32, of_slot_0: f32, used: bool, at: u64) -> Result<()> {
    if used && !x.is_finite() {
        let (expected, found) = ("a finite coordinate", format!("{x}"));
        return Err(Error::within(Code::LeafVertices, kind::LINES, at, expected, found));
    }
    if !used && x.to_bits() != of_slot_0.to_bits() {
        let expected = format!("{of_slot_0}, as in slot 0");
        return Err(Error::within(Code::LeafUnused, kind::LINES, at, expected, format!("{x}")));
    }
    Ok(())
}

/// BTH-F116: rows of TRIANGLE_IDS are below the number of triangles.
pub(super) fn check_ids(view: &ObjectView) -> Result<()> {
    let triangles = view.header.triangles;
    let expected = format!("an id below {triangles}");
    check_all(Code::TriangleId, kind::TRIANGLE_IDS, view.triangle_ids, |id| *id < triangles, expected)
}
