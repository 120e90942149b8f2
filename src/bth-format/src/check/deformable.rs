//! Deformable objects: BTH-F163 to BTH-F167. What they demand lets a refit go through nodes, leaves
//! and LEAF_VERTICES once, in the order in which they lie.

use crate::error::{Code, Error, Result};
use crate::layout::*;
use crate::object::ObjectView;

/// Checks the object if it is deformable. Its tree, leaves and rows of the source have been checked
/// before.
pub(super) fn check(view: &ObjectView) -> Result<()> {
    if !view.is_deformable() {
        return Ok(());
    }
    prerequisites(view)?;
    let leaves = leaves_in_order(view)?;
    Rows { view, row: 0 }.check(&leaves)
}

/// BTH-F163.
fn prerequisites(view: &ObjectView) -> Result<()> {
    let found = if view.positions.is_empty() || view.triangles.is_empty() {
        "none of them"
    } else if view.grid.is_some() {
        "coordinates that are not f32"
    } else if view.has_widened_boxes() {
        "widened boxes"
    } else if !view.tet_leaves.is_empty() {
        "tet leaves"
    } else if view.header.dropped != 0 {
        "triangles that are dropped"
    } else {
        return Ok(());
    };
    let expected = "POSITIONS and TRIANGLES beside LEAF_VERTICES, f32, no tet leaf, no dropped triangle";
    Err(Error::within(Code::Deformable, kind::LEAF_VERTICES, 0, expected, found))
}

/// BTH-F164: the blocks lie in depth-first order, nodes before leaves. Returns the leaves.
fn leaves_in_order(view: &ObjectView) -> Result<Vec<Child>> {
    let (mut leaves, mut next) = (Vec::new(), 0);
    let mut stack = vec![view.header.root];
    while let Some(code) = stack.pop() {
        match Child::from_code(code) {
            Some(Child::Node(line)) => {
                in_order(line, next)?;
                next += NODE_LINES;
                let children = view.node(line).child;
                stack.extend(children.into_iter().rev().filter(|child| *child != NONE));
            }
            leaf => leaves.extend(leaf),
        }
    }
    for leaf in &leaves {
        let (line, lines) = match leaf {
            Child::Raw(line) => (*line, RAW_LINES),
            Child::Indexed(line) | Child::Node(line) | Child::Tets(line) => (*line, INDEXED_LINES),
        };
        in_order(line, next)?;
        next += lines;
    }
    Ok(leaves)
}

/// The rows of LEAF_VERTICES, leaf by leaf.
struct Rows<'a> {
    view: &'a ObjectView<'a>,
    /// Row of the next leaf.
    row: usize,
}

impl Rows<'_> {
    fn check(mut self, leaves: &[Child]) -> Result<()> {
        for leaf in leaves {
            match *leaf {
                Child::Indexed(line) => self.indexed(line)?,
                Child::Raw(line) => self.raw(line)?,
                Child::Node(_) | Child::Tets(_) => {}
            }
        }
        let rows = self.view.leaf_vertices.len();
        if rows == self.row { Ok(()) } else { Err(wrong_count(self.row, rows)) }
    }

    /// BTH-F165: takes the rows of a leaf; also returns the first of them.
    fn take<const ROWS: usize>(&mut self) -> Result<(&[[u32; WIDTH]; ROWS], usize)> {
        let row = self.row;
        self.row += ROWS;
        let all = self.view.leaf_vertices;
        let rows = all.get(row..).and_then(<[_]>::first_chunk);
        rows.map(|rows| (rows, row)).ok_or_else(|| wrong_count(row + ROWS, all.len()))
    }

    fn indexed(&mut self, line: u32) -> Result<()> {
        let view = self.view;
        let leaf = view.indexed_leaf(line);
        let ([slots], row) = self.take::<1>()?;
        check_slots(view, slots, row, leaf.vertices as usize)?;
        for triangle in 0..leaf.triangles as usize {
            let corners = leaf.corner.map(|vertices| slots[vertices[triangle] as usize]);
            check_triangle(view, line, leaf.first as usize + triangle, corners)?;
        }
        Ok(())
    }

    fn raw(&mut self, line: u32) -> Result<()> {
        let view = self.view;
        let leaf = view.raw_leaf(line);
        let (slots, row) = self.take::<3>()?;
        for (k, slots) in slots.iter().enumerate() {
            check_slots(view, slots, row + k, leaf.triangles as usize)?;
        }
        for triangle in 0..leaf.triangles as usize {
            let corners = slots.map(|slots| slots[triangle]);
            check_triangle(view, line, leaf.first as usize + triangle, corners)?;
        }
        Ok(())
    }
}

/// BTH-F164: a block lies where depth-first order has it.
fn in_order(line: u32, expected: usize) -> Result<()> {
    if line as usize == expected {
        return Ok(());
    }
    let at = u64::from(line) * size_of::<CacheLine>() as u64;
    let expected = format!("line {expected}: nodes in depth-first order, then leaves");
    Err(Error::within(Code::BlockOrder, kind::LINES, at, expected, format!("line {line}")))
}

/// BTH-F165.
fn wrong_count(needed: usize, rows: usize) -> Error {
    let expected = format!("{needed} rows for the leaves, or more");
    let at = (rows * size_of::<[u32; WIDTH]>()) as u64;
    Error::within(Code::LeafRows, kind::LEAF_VERTICES, at, expected, format!("{rows}"))
}

/// BTH-F166 of a row of LEAF_VERTICES.
fn check_slots(view: &ObjectView, slots: &[u32; WIDTH], row: usize, used: usize) -> Result<()> {
    let positions = view.positions.len();
    let wrong = |i: usize| slots[i] as usize >= positions || (i >= used && slots[i] != slots[0]);
    let Some(i) = (0..WIDTH).find(|i| wrong(*i)) else { return Ok(()) };
    let at = (row * size_of::<[u32; WIDTH]>() + 4 * i) as u64;
    let expected = format!("a row below {positions}, in unused slots that of slot 0");
    Err(Error::within(Code::LeafVertexRows, kind::LEAF_VERTICES, at, expected, format!("{}", slots[i])))
}

/// BTH-F167 of a triangle of the leaf at a line, given its row of TRIANGLE_IDS and the rows of its
/// corners.
fn check_triangle(view: &ObjectView, line: u32, row: usize, corners: [u32; 3]) -> Result<()> {
    let id = view.triangle_ids[row];
    let expected = view.triangles[id as usize];
    if corners == expected {
        return Ok(());
    }
    let at = u64::from(line) * size_of::<CacheLine>() as u64;
    let expected = format!("triangle {id} of positions {expected:?}");
    Err(Error::within(Code::LeafTriangles, kind::LINES, at, expected, format!("{corners:?}")))
}
