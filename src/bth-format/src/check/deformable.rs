//! Deformable objects: BTH-F163 to BTH-F167. What they demand lets a refit go through nodes, leaves and LEAF_VERTICES once, in the
//! order in which they lie.

use crate::error::{Code, Error, Result};
use crate::layout::*;
use crate::object::ObjectView;

/// Checks the object if it is deformable. Its tree, leaves and rows of the source have been checked before.
pub(super) fn check(view: &ObjectView) -> Result<()> {
    if !view.is_deformable() {
        return Ok(());
    }
    prerequisites(view)?;
    Walk { view, next_node: 0, leaves: None, row: 0 }.check()
}

/// BTH-F163.
fn prerequisites(view: &ObjectView) -> Result<()> {
    let found = if view.positions.is_empty() || view.triangles.is_empty() {
        "none of them"
    } else if view.grid.is_some() || view.has_packed_nodes() {
        "coordinates or boxes that are not f32"
    } else if !view.tet_leaves.is_empty() {
        "tet leaves"
    } else if view.header.dropped != 0 {
        "triangles that are dropped"
    } else {
        return Ok(());
    };
    let expected = "POSITIONS and TRIANGLES beside LEAF_VERTICES, f32, no tet leaves, no dropped triangle";
    Err(Error::within(Code::Deformable, kind::LEAF_VERTICES, 0, expected, found))
}

/// A walk through the tree, depth first.
struct Walk<'a> {
    view: &'a ObjectView<'a>,
    /// Line of the next node.
    next_node: usize,
    /// Line of the first leaf, and that of the next one.
    leaves: Option<(usize, usize)>,
    /// Row of LEAF_VERTICES of the next leaf.
    row: usize,
}

impl Walk<'_> {
    fn check(mut self) -> Result<()> {
        let mut stack = vec![self.view.header.root];
        while let Some(code) = stack.pop() {
            match Child::from_code(code) {
                Some(Child::Node(line)) => {
                    in_order(line, self.next_node)?;
                    self.next_node += NODE_LINES;
                    let children = self.view.node(line).child;
                    stack.extend(children.into_iter().rev().filter(|child| *child != NONE));
                }
                Some(Child::Indexed(line)) => self.indexed(line)?,
                Some(Child::Raw(line)) => self.raw(line)?,
                // No tet leaves and packed nodes, by BTH-F163.
                _ => {}
            }
        }
        if let Some((first, _)) = self.leaves {
            in_order(first as u32, self.next_node)?;
        }
        let rows = self.view.leaf_vertices.len();
        if rows == self.row { Ok(()) } else { Err(wrong_count(self.row, rows)) }
    }

    /// BTH-F164 and BTH-F165: the leaf is the next one. Returns its rows and the first of them.
    fn leaf<const ROWS: usize>(&mut self, line: u32, lines: usize) -> Result<(&[[u32; WIDTH]; ROWS], usize)> {
        let (first, next) = self.leaves.unwrap_or((line as usize, line as usize));
        in_order(line, next)?;
        self.leaves = Some((first, next + lines));
        let row = self.row;
        self.row += ROWS;
        let rows = self.view.leaf_vertices[row.min(self.view.leaf_vertices.len())..].first_chunk();
        rows.map(|rows| (rows, row)).ok_or_else(|| wrong_count(self.row, self.view.leaf_vertices.len()))
    }

    fn indexed(&mut self, line: u32) -> Result<()> {
        let view = self.view;
        let leaf = view.indexed_leaf(line);
        let ([slots], row) = self.leaf::<1>(line, INDEXED_LINES)?;
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
        let (slots, row) = self.leaf::<3>(line, RAW_LINES)?;
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
    Error::within(Code::LeafRows, kind::LEAF_VERTICES, at, expected, rows.to_string())
}

/// BTH-F166 of a row of LEAF_VERTICES.
fn check_slots(view: &ObjectView, slots: &[u32; WIDTH], row: usize, used: usize) -> Result<()> {
    let positions = view.positions.len();
    let wrong = |i: usize| slots[i] as usize >= positions || (i >= used && slots[i] != slots[0]);
    let Some(i) = (0..WIDTH).find(|i| wrong(*i)) else { return Ok(()) };
    let at = (row * size_of::<[u32; WIDTH]>() + 4 * i) as u64;
    let expected = format!("a row below {positions}, in unused slots that of slot 0");
    Err(Error::within(Code::LeafVertexRows, kind::LEAF_VERTICES, at, expected, slots[i].to_string()))
}

/// BTH-F167 of a triangle of the leaf at a line, given its row of TRIANGLE_IDS and the rows of its corners.
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
