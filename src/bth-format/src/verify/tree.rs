//! Boxes of the tree contain the triangles below, and every triangle lies in it once.

use super::aabb::Aabb;
use super::source::{Stored, check_corners};
use super::triangle_set::TriangleSet;
use crate::error::{Code, Error, Result};
use crate::layout::*;
use crate::object::ObjectView;
use std::mem::offset_of;

/// A node or leaf of the tree.
struct Visit {
    child: Child,
    /// The visit of the node that refers to it, and the slot there; `None` for the root.
    parent: Option<(usize, usize)>,
    /// Bounds of the triangles below, as far as they have been visited.
    content: Aabb,
    /// The same with the room around corners that widened boxes have; the box of no point where the
    /// object has none.
    widened: Aabb,
}

/// Checks BTH-F201 to BTH-F204 and BTH-F207 of the stored triangles; returns which triangles the
/// tree holds.
pub(super) fn check(view: &ObjectView) -> Result<TriangleSet> {
    let mut visits = visits(view);
    let mut triangles = Triangles { view, placed: TriangleSet::default() };
    // Parents come before their children: from the back, the content of a visit is complete when
    // it is taken.
    while let Some(mut visit) = visits.pop() {
        triangles.check_leaf(&mut visit)?;
        check_containment(view, &visit, &visits)?;
        if let Some((parent, _)) = visit.parent {
            visits[parent].content.merge(&visit.content);
            visits[parent].widened.merge(&visit.widened);
        }
    }
    Ok(triangles.placed)
}

/// All nodes and leaves, parents before their children.
fn visits(view: &ObjectView) -> Vec<Visit> {
    let visit = |code, parent| {
        let child = Child::from_code(code)?;
        Some(Visit { child, parent, content: Aabb::EMPTY, widened: Aabb::EMPTY })
    };
    let mut visits: Vec<Visit> = visit(view.header.root, None).into_iter().collect();
    let mut i = 0;
    while i < visits.len() {
        if let Some(node) = view.node_at(visits[i].child) {
            let codes = node.child.iter().enumerate();
            visits.extend(codes.filter_map(|(slot, &code)| visit(code, Some((i, slot)))));
        }
        i += 1;
    }
    visits
}

/// BTH-F204: the box of the slot that leads to a node or leaf, or the bounds of the object, contain
/// the triangles below. `visits` are the visits before.
fn check_containment(view: &ObjectView, visit: &Visit, visits: &[Visit]) -> Result<()> {
    let (bounds, section, at) = if let Some((parent, slot)) = visit.parent {
        let child = visits[parent].child;
        let node = view.node_at(child).expect("only nodes have slots");
        let end = |upper: usize| [0, 1, 2].map(|axis| node.bounds[axis][upper][slot]);
        (Aabb { lower: end(0), upper: end(1) }, kind::LINES, view.block_start(child))
    } else {
        (Aabb { lower: view.header.lower, upper: view.header.upper }, kind::OBJECT, 0)
    };
    // The object's bounds are not widened.
    let content = if section == kind::LINES { &visit.content.with(&visit.widened) } else { &visit.content };
    if bounds.contains(content) {
        return Ok(());
    }
    let expected = format!("a box around {:?} to {:?}", content.lower, content.upper);
    let found = format!("{:?} to {:?}", bounds.lower, bounds.upper);
    Err(Error::within(Code::Containment, section, at, expected, found))
}

struct Triangles<'a> {
    view: &'a ObjectView<'a>,
    placed: TriangleSet,
}

impl Triangles<'_> {
    /// Checks the triangles of a leaf, and adds them to its content.
    fn check_leaf(&mut self, visit: &mut Visit) -> Result<()> {
        let view = self.view;
        match visit.child {
            Child::Node(_) => Ok(()),
            Child::Tets(row) => {
                let leaf = &view.tet_leaves[row as usize];
                let mut faces = leaf.first_face..leaf.first_face + leaf.faces;
                faces.try_for_each(|face| self.check_constrained_face(visit, face))
            }
            Child::Indexed(index) => {
                let mut scratch = None;
                let leaf = view.indexed(index, &mut scratch);
                (0..leaf.triangles as usize).try_for_each(|t| {
                    self.check_leaf_triangle(visit, leaf.first as usize + t, leaf.triangle(t))
                })
            }
            Child::Raw(index) => {
                let mut scratch = None;
                let leaf = view.raw(index, &mut scratch);
                (0..leaf.triangles as usize).try_for_each(|t| {
                    self.check_leaf_triangle(visit, leaf.first as usize + t, leaf.triangle(t))
                })
            }
        }
    }

    /// BTH-F203, BTH-F201 and BTH-F207 of a triangle of a leaf, given its row of TRIANGLE_IDS.
    fn check_leaf_triangle(&mut self, visit: &mut Visit, row: usize, corners: [[f32; 3]; 3]) -> Result<()> {
        self.add(visit, corners);
        let (id, at) = (self.view.triangle_ids[row], 4 * row as u64);
        self.mark_placed(id, kind::TRIANGLE_IDS, at)?;
        let at = self.view.block_start(visit.child);
        check_corners(self.view, id, corners, Stored { code: Code::LeafSource, section: kind::LINES, at })
    }

    /// BTH-F203, BTH-F202 and BTH-F207 of a constrained face, given its row.
    fn check_constrained_face(&mut self, visit: &mut Visit, row: u32) -> Result<()> {
        let face = &self.view.tet_faces[row as usize];
        let corners = face.vertex.map(|v| self.view.tet_vertices[v as usize].position);
        self.add(visit, corners);
        let at = u64::from(row) * size_of::<TetFace>() as u64;
        self.mark_placed(face.triangle, kind::TET_FACES, at + offset_of!(TetFace, triangle) as u64)?;
        let stored = Stored { code: Code::FaceSource, section: kind::TET_FACES, at };
        check_corners(self.view, face.triangle, corners, stored)
    }

    /// Adds the corners of a triangle to the content of a visit.
    fn add(&self, visit: &mut Visit, corners: [[f32; 3]; 3]) {
        for corner in corners {
            visit.content.add(corner);
            if self.view.has_widened_boxes() {
                visit.widened.add_widened(corner);
            }
        }
    }

    /// BTH-F203: a triangle lies in one triangle leaf or constrained face.
    fn mark_placed(&mut self, id: u32, section: u32, at: u64) -> Result<()> {
        if self.placed.insert(id) {
            return Ok(());
        }
        let found = format!("triangle {id} again");
        Err(Error::within(Code::Coverage, section, at, "each triangle once", found))
    }
}
