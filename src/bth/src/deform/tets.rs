//! Tetrahedra of objects with new positions: which tet leaves rays may start in, and where their vertices are.
//!
//! The records of tetrahedra are topology alone, so new positions move vertices only:
//!
//! - the corners of constrained faces to the new positions of their triangles' corners, bit for bit;
//! - the corners of the leaf's box to those of a new box, whose distance from the surface is the same share of the surface's diagonal;
//! - all others with the box, axis by axis, and with the corners of faces around them ([`BoundVertices`]).
//!
//! A leaf is *in use* if every tetrahedron then has strictly positive orientation, by the exact test, and no two triangles that share a
//! vertex of the tetrahedralization have moved apart there. That the tetrahedra fill the new box, each point once, follows from it as
//! for the compiled ones: see [`filling_tets`], which has checked all else. Neighbours lie on either side of their common face, because
//! on which side a vertex lies is the orientation of its tetrahedron, up to the parity of the order of its vertices, and so do the two
//! tetrahedra of a constrained face. So walks find what they find in a leaf that is compiled with these positions.
//!
//! A leaf that is not in use *stands aside*: rays do not start in it, since its triangles are faces of nothing, and the BVH over the
//! same triangles answers for it.

use super::bound_vertices::{BoundVertices, VertexKind};
use super::orientation::Tetrahedra;
use crate::update::Update;
use bth_format::file::TetParts;
use bth_format::layout::{NONE, TetFace, TetLeaf, TetVertex};
use bth_format::object::ObjectView;
use bth_format::verify::filling_tets;
use std::ops::Range;

/// From this number of vertices on, several threads place them.
#[cfg(feature = "rayon")]
const TASK: usize = 1 << 13;

/// How the tet leaves of an object follow new positions.
#[derive(Debug, Default)]
pub(super) struct TetPlan {
    /// `None` for leaves that are never in use.
    leaves: Vec<Option<LeafPlan>>,
}

/// How many tet leaves of an object rays may start in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct TetUse {
    pub(crate) in_use: usize,
    pub(crate) aside: usize,
}

impl TetUse {
    /// Adds the leaves of another object.
    pub(crate) fn add(&mut self, other: TetUse) {
        self.in_use += other.in_use;
        self.aside += other.aside;
    }

    /// The update with these numbers of tet leaves.
    pub(crate) fn of(self, update: Update) -> Update {
        Update { tet_leaves_in_use: self.in_use, tet_leaves_aside: self.aside, ..update }
    }
}

/// How a tet leaf follows new positions.
#[derive(Debug)]
struct LeafPlan {
    /// The tetrahedra, their vertices counted from the leaf's first, in the order of positive orientation.
    tets: Tetrahedra,
    /// For each vertex its row of POSITIONS; `NONE` for those of no constrained face.
    rows: Vec<u32>,
    /// The vertices at the corners of the box.
    corners: Vec<u32>,
    /// The vertices that are neither.
    bound: BoundVertices,
    /// Pairs of rows of POSITIONS that are one vertex here, the first in the upper half of the number.
    seams: Vec<u64>,
    /// Bounds of the surface as it was compiled.
    surface: Ends,
    /// For each end of the box, its distance from the surface relative to the diagonal of the surface.
    margins: [[f64; 3]; 2],
}

/// Lower and upper end of a box.
type Ends = [[f32; 3]; 2];

impl TetPlan {
    /// The plan for a deformable object, of which the index check is done.
    pub(super) fn new(view: &ObjectView<'_>) -> TetPlan {
        TetPlan { leaves: (0..view.tet_leaves.len() as u32).map(|row| LeafPlan::new(view, row)).collect() }
    }

    /// Moves the tet leaves to new positions, and decides which are in use.
    pub(super) fn refit(&self, parts: &mut TetParts<'_>, positions: &[[f32; 3]]) -> TetUse {
        let mut tet_use = TetUse::default();
        let TetParts { leaves, vertices, triangle_faces, faces, compiled, compiled_vertices } = parts;
        for ((plan, leaf), compiled) in self.leaves.iter().zip(leaves.iter_mut()).zip(compiled.iter()) {
            let range = rows(leaf.first_vertex, leaf.vertices);
            let compiled = Compiled { leaf: compiled, vertices: &compiled_vertices[range.clone()] };
            let is_in_use = plan
                .as_ref()
                .is_some_and(|plan| plan.refit(&compiled, positions, (leaf, &mut vertices[range])));
            let own = rows(leaf.first_face, leaf.faces);
            set_faces(triangle_faces, leaf.first_face, &faces[own], is_in_use);
            if is_in_use { tet_use.in_use += 1 } else { tet_use.aside += 1 }
        }
        tet_use
    }
}

/// Makes the triangles of a leaf faces of it, or of nothing. They are all of them or none before.
fn set_faces(triangle_faces: &mut [u32], first: u32, faces: &[TetFace], is_in_use: bool) {
    let was_in_use = faces.first().is_some_and(|face| triangle_faces[face.triangle as usize] != NONE);
    if was_in_use != is_in_use {
        for (row, face) in (first..).zip(faces) {
            triangle_faces[face.triangle as usize] = if is_in_use { row } else { NONE };
        }
    }
}

fn rows(first: u32, count: u32) -> Range<usize> {
    first as usize..first as usize + count as usize
}

/// A tet leaf as it was compiled, with its own vertices.
struct Compiled<'a> {
    leaf: &'a TetLeaf,
    vertices: &'a [TetVertex],
}

impl LeafPlan {
    /// The plan for a tet leaf; `None` if it is not certain that its tetrahedra fill its box.
    fn new(view: &ObjectView<'_>, row: u32) -> Option<LeafPlan> {
        let mut tets = filling_tets(view, row)?;
        let leaf = &view.tet_leaves[row as usize];
        tets.iter_mut().flatten().for_each(|vertex| *vertex -= leaf.first_vertex);
        let mut of_vertex = vec![NONE; leaf.vertices as usize];
        let mut seams = Vec::new();
        for face in &view.tet_faces[rows(leaf.first_face, leaf.faces)] {
            let source = view.triangles[face.triangle as usize];
            for (vertex, row) in face.vertex.into_iter().zip(source) {
                let known = &mut of_vertex[(vertex - leaf.first_vertex) as usize];
                match *known {
                    NONE => *known = row,
                    other if other != row => seams.push(u64::from(other) << 32 | u64::from(row)),
                    _ => {}
                }
            }
        }
        seams.sort_unstable();
        seams.dedup();
        let vertices = &view.tet_vertices[rows(leaf.first_vertex, leaf.vertices)];
        let kind = |(row, vertex): (&u32, &TetVertex)| match is_corner(leaf, vertex.position) {
            _ if *row != NONE => VertexKind::Surface,
            true => VertexKind::Corner,
            false => VertexKind::Bound,
        };
        let kinds: Vec<VertexKind> = of_vertex.iter().zip(vertices).map(kind).collect();
        let used = of_vertex.iter().filter(|row| **row != NONE);
        let surface = bounds(used.map(|row| view.positions[*row as usize]));
        // So that no corner of a constrained face is one of the box.
        let contains = (0..3).all(|k| leaf.lower[k] < surface[0][k] && surface[1][k] < leaf.upper[k]);
        if !contains {
            return None;
        }
        let diagonal = diagonal(&surface);
        let margin = |a: f32, b: f32| (f64::from(a) - f64::from(b)) / diagonal;
        let margins = [
            [0, 1, 2].map(|k| margin(surface[0][k], leaf.lower[k])),
            [0, 1, 2].map(|k| margin(leaf.upper[k], surface[1][k])),
        ];
        let corners = (0..).zip(&kinds).filter(|(_, kind)| **kind == VertexKind::Corner).map(|(v, _)| v);
        Some(LeafPlan {
            corners: corners.collect(),
            bound: BoundVertices::new(&kinds, &tets, vertices),
            tets: Tetrahedra::new(&tets),
            rows: of_vertex,
            seams,
            surface,
            margins,
        })
    }

    /// Moves the leaf and its vertices to new positions. Returns whether it is in use.
    fn refit(
        &self,
        compiled: &Compiled<'_>,
        positions: &[[f32; 3]],
        (leaf, vertices): (&mut TetLeaf, &mut [TetVertex]),
    ) -> bool {
        let bits = |row: u32| positions[row as usize].map(f32::to_bits);
        if self.seams.iter().any(|seam| bits((seam >> 32) as u32) != bits(*seam as u32)) {
            return false;
        }
        let surface = self.place_surface(positions, vertices);
        let Some([lower, upper]) = self.box_around(&surface, compiled.leaf) else { return false };
        let map = BoxMap::new(compiled.leaf, [lower, upper]);
        self.place_others(&map, compiled.vertices, vertices);
        (leaf.lower, leaf.upper) = (lower, upper);
        let length = (0..3).map(|k| upper[k] - lower[k]).fold(0.0, f32::max);
        self.tets.all_positive(vertices, length)
    }

    /// Moves the corners of constrained faces; returns their bounds.
    fn place_surface(&self, positions: &[[f32; 3]], vertices: &mut [TetVertex]) -> Ends {
        let place = |(rows, vertices): (&[u32], &mut [TetVertex])| {
            let mut ends = EMPTY;
            for (row, vertex) in rows.iter().zip(vertices) {
                if *row != NONE {
                    vertex.position = positions[*row as usize];
                    ends = union(ends, [vertex.position; 2]);
                }
            }
            ends
        };
        #[cfg(feature = "rayon")]
        if vertices.len() > TASK {
            use rayon::iter::{IndexedParallelIterator, ParallelIterator};
            use rayon::slice::{ParallelSlice, ParallelSliceMut};
            let tasks = self.rows.par_chunks(TASK).zip(vertices.par_chunks_mut(TASK));
            return tasks.map(place).reduce(|| EMPTY, union);
        }
        place((&self.rows, vertices))
    }

    /// Moves the vertices of no constrained face: with the box, and by what the surface moves beyond that.
    fn place_others(&self, map: &BoxMap, compiled: &[TetVertex], vertices: &mut [TetVertex]) {
        for corner in &self.corners {
            vertices[*corner as usize].position = map.of_corner(compiled[*corner as usize].position);
        }
        let surface: &[TetVertex] = vertices;
        let moved = |vertex: u32| {
            let from = map.of_inner(compiled[vertex as usize].position);
            let to = surface[vertex as usize].position;
            [0, 1, 2].map(|k| f64::from(to[k]) - from[k])
        };
        let placed = self.bound.map(moved, |vertex, by| {
            let with_box = map.of_inner(compiled[vertex as usize].position);
            [0, 1, 2].map(|k| {
                let [lower, upper] = map.to.map(|end| end[k]);
                ((with_box[k] + by[k]) as f32).clamp(lower, upper) + 0.0
            })
        });
        for (vertex, at) in placed {
            vertices[vertex as usize].position = at;
        }
    }

    /// The box around a surface with given bounds; `None` if it leaves the range of `f32`.
    fn box_around(&self, surface: &Ends, compiled: &TetLeaf) -> Option<Ends> {
        if *surface == self.surface {
            return Some([compiled.lower, compiled.upper]);
        }
        let diagonal = diagonal(surface);
        let [below, above] = self.margins;
        // A sum with 0 makes no zero negative.
        let lower = |k: usize| {
            let end = surface[0][k];
            ((f64::from(end) - below[k] * diagonal) as f32).min(end.next_down()) + 0.0
        };
        let upper = |k: usize| {
            let end = surface[1][k];
            ((f64::from(end) + above[k] * diagonal) as f32).max(end.next_up()) + 0.0
        };
        let ends = [[0, 1, 2].map(lower), [0, 1, 2].map(upper)];
        ends.as_flattened().iter().all(|x| x.is_finite()).then_some(ends)
    }
}

/// The map from the compiled box of a leaf to another box, axis by axis.
struct BoxMap {
    from: Ends,
    to: Ends,
    /// Length of the new box relative to that of the compiled one.
    scale: [f64; 3],
    /// Where 0 goes.
    shift: [f64; 3],
}

impl BoxMap {
    fn new(compiled: &TetLeaf, to: Ends) -> BoxMap {
        let from = [compiled.lower, compiled.upper];
        let length = |ends: &Ends, k: usize| f64::from(ends[1][k]) - f64::from(ends[0][k]);
        let scale = [0, 1, 2].map(|k| length(&to, k) / length(&from, k));
        let shift = [0, 1, 2].map(|k| f64::from(to[0][k]) - f64::from(from[0][k]) * scale[k]);
        BoxMap { from, to, scale, shift }
    }

    /// Where a point goes; nowhere on an axis that has the same ends.
    #[inline]
    fn of_inner(&self, point: [f32; 3]) -> [f64; 3] {
        [0, 1, 2].map(|k| f64::from(point[k]) * self.scale[k] + self.shift[k])
    }

    /// Where a corner of the box goes.
    fn of_corner(&self, corner: [f32; 3]) -> [f32; 3] {
        [0, 1, 2].map(|k| self.to[usize::from(corner[k] != self.from[0][k])][k])
    }
}

/// Whether a point is a corner of the box of a leaf.
fn is_corner(leaf: &TetLeaf, point: [f32; 3]) -> bool {
    (0..3).all(|k| point[k] == leaf.lower[k] || point[k] == leaf.upper[k])
}

const EMPTY: Ends = [[f32::MAX; 3], [-f32::MAX; 3]];

fn union(a: Ends, b: Ends) -> Ends {
    [[0, 1, 2].map(|k| a[0][k].min(b[0][k])), [0, 1, 2].map(|k| a[1][k].max(b[1][k]))]
}

fn bounds(points: impl Iterator<Item = [f32; 3]>) -> Ends {
    points.fold(EMPTY, |ends, point| union(ends, [point; 2]))
}

fn diagonal([lower, upper]: &Ends) -> f64 {
    (0..3).map(|k| (f64::from(upper[k]) - f64::from(lower[k])).powi(2)).sum::<f64>().sqrt()
}
