//! Whether an object's numbers are right, its indices having been checked.

use super::Report;
use super::seen::Seen;
use crate::check::Derived;
use crate::error::{Code, Error, Result};
use crate::exact::{is_zero_area, side};
use crate::layout::*;
use crate::object::ObjectView;
use std::cmp::Ordering;
use std::mem::offset_of;

pub(super) fn check(view: &ObjectView, report: &mut Report) -> Result<()> {
    let mut seen = Seen::default();
    tree(view, &mut seen)?;
    for (row, leaf) in view.tet_leaves.iter().enumerate() {
        tet_leaf(view, row, leaf)?;
        report.tets += leaf.tets as u64;
    }
    dropped(view, &seen)?;
    displacement(view)?;
    report.tet_leaves += view.tet_leaves.len() as u64;
    report.triangles += (view.header.triangles - view.header.dropped) as u64;
    report.dropped += view.header.dropped as u64;
    report.compared_with_source += u32::from(!view.triangles.is_empty());
    Ok(())
}

#[derive(Clone, Copy)]
struct Bounds([f32; 3], [f32; 3]);

impl Bounds {
    const EMPTY: Bounds = Bounds([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);

    fn add(&mut self, p: [f32; 3]) {
        for (a, x) in p.into_iter().enumerate() {
            self.0[a] = self.0[a].min(x);
            self.1[a] = self.1[a].max(x);
        }
    }
    fn contains(&self, other: &Bounds) -> bool {
        (0..3).all(|a| self.0[a] <= other.0[a] && other.1[a] <= self.1[a])
    }
}

/// A child that has been reached, after the one that refers to it.
struct Visit {
    child: Child,
    /// Visit of the node that refers to it, and the slot.
    parent: Option<(usize, usize)>,
    /// The tet leaf whose subtree it lies in.
    beside: Option<u32>,
    content: Bounds,
}

/// Checks that boxes contain what is below and that each triangle occurs once, as in the source.
fn tree(view: &ObjectView, seen: &mut Seen) -> Result<()> {
    let visit = |code, parent, beside| {
        Child::from_code(code).map(|child| Visit { child, parent, beside, content: Bounds::EMPTY })
    };
    let mut visits: Vec<Visit> = visit(view.header.root, None, None).into_iter().collect();
    let mut i = 0;
    while i < visits.len() {
        let (child, beside) = (visits[i].child, visits[i].beside);
        match child {
            Child::Node(_) | Child::Packed(_) => {
                let node = view.unpacked_node(child).expect("a node");
                let children = node.child.iter().enumerate();
                visits.extend(children.filter_map(|(slot, &code)| visit(code, Some((i, slot)), beside)));
            }
            Child::Tets(row) => visits.extend(visit(view.tet_leaves[row as usize].subtree, None, Some(row))),
            Child::Indexed(_) | Child::Raw(_) => {}
        }
        i += 1;
    }
    // Children come after their parents, so backwards every content is complete when its turn comes.
    let mut in_subtree = vec![0u32; view.tet_leaves.len()];
    while let Some(mut visit) = visits.pop() {
        let start = view.half_lines(visit.child).map_or(0, |(first, _)| first * HALF_LINE as u64);
        match visit.child {
            Child::Node(_) | Child::Packed(_) => {}
            Child::Tets(row) => {
                let leaf = &view.tet_leaves[row as usize];
                for face in leaf.first_face..leaf.first_face + leaf.faces {
                    tet_face(view, face, seen, &mut visit.content)?;
                }
            }
            Child::Indexed(line) => {
                let mut room = None;
                let leaf = view.indexed(line, &mut room);
                for t in 0..leaf.triangles as usize {
                    let corners = [0, 1, 2].map(|k| {
                        let v = leaf.corner[k][t] as usize;
                        [0, 1, 2].map(|axis| leaf.vertex[axis][v])
                    });
                    leaf_triangle(
                        view,
                        start,
                        leaf.first as usize + t,
                        corners,
                        &mut visit,
                        seen,
                        &mut in_subtree,
                    )?;
                }
            }
            Child::Raw(line) => {
                let mut room = None;
                let leaf = view.raw(line, &mut room);
                for t in 0..leaf.triangles as usize {
                    let corners = [0, 1, 2].map(|k| [0, 1, 2].map(|axis| leaf.corner[k][axis][t]));
                    leaf_triangle(
                        view,
                        start,
                        leaf.first as usize + t,
                        corners,
                        &mut visit,
                        seen,
                        &mut in_subtree,
                    )?;
                }
            }
        }
        let content = visit.content;
        if let Some((parent, slot)) = visit.parent {
            let above = visits[parent].child;
            let node = view.unpacked_node(above).expect("only nodes have slots");
            let slot_box = Bounds(
                [0, 1, 2].map(|a| node.bounds[a][0][slot]),
                [0, 1, 2].map(|a| node.bounds[a][1][slot]),
            );
            if !slot_box.contains(&content) {
                let at = view.half_lines(above).map_or(0, |(first, _)| first * HALF_LINE as u64);
                return Err(outside(kind::LINES, at, &slot_box, &content));
            }
            visits[parent].content.add(content.0);
            visits[parent].content.add(content.1);
        } else if visit.beside.is_none() {
            let bounds = Bounds(view.header.lower, view.header.upper);
            if !bounds.contains(&content) {
                return Err(outside(kind::OBJECT, 0, &bounds, &content));
            }
        }
    }
    for (row, leaf) in view.tet_leaves.iter().enumerate() {
        if leaf.subtree != NONE && in_subtree[row] != leaf.faces {
            let at = (row * size_of::<TetLeaf>() + offset_of!(TetLeaf, subtree)) as u64;
            let expected = format!("a subtree with all {} triangles", leaf.faces);
            return Err(Error::within(
                Code::Coverage,
                kind::TET_LEAVES,
                at,
                expected,
                in_subtree[row].to_string(),
            ));
        }
    }
    Ok(())
}

fn outside(section: u32, at: u64, bounds: &Bounds, content: &Bounds) -> Error {
    let expected = format!("a box around {:?} to {:?}", content.0, content.1);
    Error::within(Code::Containment, section, at, expected, format!("{:?} to {:?}", bounds.0, bounds.1))
}

/// A triangle of a leaf at a byte of LINES, by its row of TRIANGLE_IDS.
fn leaf_triangle(
    view: &ObjectView,
    start: u64,
    row: usize,
    corners: [[f32; 3]; 3],
    visit: &mut Visit,
    seen: &mut Seen,
    in_subtree: &mut [u32],
) -> Result<()> {
    corners.into_iter().for_each(|p| visit.content.add(p));
    let id = view.triangle_ids[row];
    let at = 4 * row as u64;
    if let Some(tet_leaf) = visit.beside {
        let leaf = &view.tet_leaves[tet_leaf as usize];
        let here = leaf.first_face..leaf.first_face + leaf.faces;
        if !here.contains(&view.triangle_homes[id as usize]) || !seen.mark(id, Seen::SUBTREE) {
            let expected = format!("a triangle of tet leaf {tet_leaf}, once");
            return Err(Error::within(
                Code::Coverage,
                kind::TRIANGLE_IDS,
                at,
                expected,
                format!("triangle {id}"),
            ));
        }
        in_subtree[tet_leaf as usize] += 1;
    } else {
        once(id, seen, kind::TRIANGLE_IDS, at)?;
    }
    same_as_source(view, id, corners, Code::LeafSource, kind::LINES, start)
}

/// A constrained face, by its row.
fn tet_face(view: &ObjectView, row: u32, seen: &mut Seen, content: &mut Bounds) -> Result<()> {
    let face = &view.tet_faces[row as usize];
    let corners = face.vertex.map(|v| view.tet_vertices[v as usize].position);
    corners.into_iter().for_each(|p| content.add(p));
    let at = row as u64 * size_of::<TetFace>() as u64;
    once(face.triangle, seen, kind::TET_FACES, at + offset_of!(TetFace, triangle) as u64)?;
    same_as_source(view, face.triangle, corners, Code::FaceSource, kind::TET_FACES, at)
}

fn once(id: u32, seen: &mut Seen, section: u32, at: u64) -> Result<()> {
    if seen.mark(id, Seen::HOME) {
        return Ok(());
    }
    let found = format!("triangle {id} again");
    Err(Error::within(Code::Coverage, section, at, "each triangle once", found))
}

fn same_as_source(
    view: &ObjectView,
    id: u32,
    corners: [[f32; 3]; 3],
    code: Code,
    section: u32,
    at: u64,
) -> Result<()> {
    let Some(source) = source(view, id) else { return Ok(()) };
    if source.map(|p| p.map(f32::to_bits)) != corners.map(|p| p.map(f32::to_bits)) {
        let expected = format!("triangle {id}: {source:?}");
        return Err(Error::within(code, section, at, expected, format!("{corners:?}")));
    }
    if is_zero_area(source) {
        let expected = "triangles that can be hit";
        return Err(Error::within(
            Code::ZeroArea,
            section,
            at,
            expected,
            format!("triangle {id} of zero area"),
        ));
    }
    Ok(())
}

/// A triangle of the source, on the grid if there is one.
fn source(view: &ObjectView, id: u32) -> Option<[[f32; 3]; 3]> {
    let corners = view.triangles.get(id as usize)?.map(|v| view.positions[v as usize]);
    Some(view.grid.map_or(corners, |grid| corners.map(|p| grid.nearest(p))))
}

/// Checks that no position of the source is farther from its point of the grid than is said.
fn displacement(view: &ObjectView) -> Result<()> {
    let Some(grid) = &view.grid else { return Ok(()) };
    let most = f64::from(view.header.displacement);
    for (row, position) in view.positions.iter().enumerate() {
        let found = distance(*position, grid.nearest(*position));
        if found > most {
            let (at, expected) = (12 * row as u64, format!("at most {most} from the grid"));
            return Err(Error::within(Code::Displacement, kind::POSITIONS, at, expected, found.to_string()));
        }
    }
    Ok(())
}

/// Distance of two points; in f64, so good to about 2^-51 of it.
fn distance(a: [f32; 3], b: [f32; 3]) -> f64 {
    let squares = [0, 1, 2].map(|k| (f64::from(a[k]) - f64::from(b[k])).powi(2));
    squares.iter().sum::<f64>().sqrt()
}

/// Checks that as many triangles are left out as the object says, and the right ones.
fn dropped(view: &ObjectView, seen: &Seen) -> Result<()> {
    let left_out = view.header.triangles as usize - seen.count(Seen::HOME);
    if left_out != view.header.dropped as usize {
        let at = offset_of!(Object, dropped) as u64;
        let expected = format!("{} triangles in no leaf", view.header.dropped);
        return Err(Error::within(Code::Coverage, kind::OBJECT, at, expected, left_out.to_string()));
    }
    // Without kept triangles there is nothing to compare with, and nothing to count to.
    for id in (0..view.triangles.len()).filter(|id| !seen.is(*id as u32, Seen::HOME)) {
        if source(view, id as u32).is_some_and(|corners| !is_zero_area(corners)) {
            let found = format!("triangle {id}, which has an area, in no leaf");
            let expected = "triangles of zero area to be left out";
            return Err(Error::within(Code::ZeroArea, kind::TRIANGLES, 12 * id as u64, expected, found));
        }
    }
    Ok(())
}

/// Checks box and orientations of a tet leaf.
fn tet_leaf(view: &ObjectView, row: usize, leaf: &TetLeaf) -> Result<()> {
    let bounds = Bounds(leaf.lower, leaf.upper);
    let point = |v: u32| view.tet_vertices[v as usize].position;
    for v in leaf.first_vertex..leaf.first_vertex + leaf.vertices {
        if !bounds.contains(&Bounds(point(v), point(v))) {
            let at = v as u64 * size_of::<TetVertex>() as u64;
            let expected = format!("a vertex in the box of tet leaf {row}, {:?} to {:?}", bounds.0, bounds.1);
            return Err(Error::within(
                Code::TetContainment,
                kind::TET_VERTICES,
                at,
                expected,
                format!("{:?}", point(v)),
            ));
        }
    }
    let oriented = |section, at: usize, expected: &str, found: String| {
        Err(Error::within(Code::Orientation, section, at as u64, expected, found))
    };
    let derived = Derived::flood(view, leaf)?;
    let rows = leaf.first_tet..leaf.first_tet + leaf.tets;
    let stride = RecordKind::from_code(view.header.record).map_or(0, RecordKind::stride);
    // One exact sign per tetrahedron; that of a face and the vertex opposite to it follows from the
    // parity of moving that vertex to the end.
    let signs: Vec<Ordering> = rows
        .clone()
        .map(|tet| {
            let [a, b, c, d] = derived.vertices(tet).map(point);
            side(a, b, c, d)
        })
        .collect();
    let beyond = |tet: u32, slot: usize| {
        let sign = signs[(tet - leaf.first_tet) as usize];
        if slot % 2 == 1 { sign } else { sign.reverse() }
    };
    for tet in rows {
        let at = tet as usize * stride;
        if signs[(tet - leaf.first_tet) as usize] == Ordering::Equal {
            return oriented(
                kind::TETS,
                at,
                "a tetrahedron with volume",
                format!("{:?}", derived.vertices(tet)),
            );
        }
        for (slot, link) in derived.links(tet).into_iter().enumerate() {
            if link & FACE_BIT == 0 {
                let back = derived.links(link).iter().position(|l| *l == tet);
                if back.is_none_or(|back| beyond(tet, slot) == beyond(link, back)) {
                    let found = format!("tetrahedra {tet} and {link} on the same side of their face");
                    return oriented(kind::TETS, at, "neighbours on either side of their face", found);
                }
            }
        }
    }
    for f in leaf.first_face..leaf.first_face + leaf.faces {
        let face = &view.tet_faces[f as usize];
        let [a, b, c] = face.vertex.map(point);
        let sides = face.opposite.map(|v| side(a, b, c, point(v)));
        if sides != [Ordering::Greater, Ordering::Less] {
            let at = f as usize * size_of::<TetFace>();
            return oriented(
                kind::TET_FACES,
                at,
                "the first tetrahedron in front, the second behind",
                format!("{sides:?}"),
            );
        }
    }
    for h in leaf.first_hull..leaf.first_hull + leaf.hulls {
        let hull = &view.hull_faces[h as usize];
        let [a, b, c] = hull.vertex.map(point);
        if side(a, b, c, point(hull.opposite)) != Ordering::Greater {
            let at = h as usize * size_of::<HullFace>();
            return oriented(
                kind::HULL_FACES,
                at,
                "a hull face that points inwards",
                format!("{:?}", hull.vertex),
            );
        }
    }
    Ok(())
}
