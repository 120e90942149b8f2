//! The sections of one object as typed slices, zero-copy.

use super::bounds::ObjectBounds;
use super::exact::ExactPositions;
use crate::Identity;
use crate::layout::*;

/// The sections of one object. Sections that the file lacks are empty. Specification: "Kinds" and
/// "Objects".
#[derive(Clone, Copy, Debug)]
pub struct ObjectView<'a> {
    /// What measurements of tracing are kept under: no two objects have the same, copies of a view
    /// do.
    pub identity: Identity,
    /// The OBJECT row: bounds, root and counts.
    pub header: &'a Object,
    /// The bounds of `header`, in the shape that tracing reads. Object space.
    pub bounds: ObjectBounds,
    /// These bounds [for rays that start on triangles](ObjectBounds::for_starts).
    pub start_bounds: ObjectBounds,
    /// These bounds [for near lines](ObjectBounds::for_near_lines).
    pub near_bounds: ObjectBounds,
    /// The points that coordinates of triangle leaves can be; `None` where these are `f32`.
    pub grid: Option<Grid>,
    /// Nodes and triangle leaves.
    pub lines: &'a [CacheLine],
    /// Source id of each triangle, in the order of the leaves.
    pub triangle_ids: &'a [u32],
    /// Tet leaves.
    pub tet_leaves: &'a [TetLeaf],
    /// Tetrahedra of all tet leaves.
    pub records: &'a [Link32],
    /// Vertices of all tet leaves, object space.
    pub tet_vertices: &'a [TetVertex],
    /// Constrained faces of all tet leaves.
    pub tet_faces: &'a [TetFace],
    /// Hull faces of all tet leaves.
    pub hull_faces: &'a [HullFace],
    /// Per source triangle its row of `tet_faces`, or [`NONE`]; empty when there are no tet leaves.
    pub triangle_faces: &'a [u32],
    /// Per leaf its rows of `positions`, in the order of the leaves: one row for an indexed leaf,
    /// one for each corner of a raw one. Empty but in deformable objects.
    pub leaf_vertices: &'a [[u32; WIDTH]],
    /// Per source triangle its [`TrianglePlace`], or [`NONE`]. Empty if the file has none.
    pub places: &'a [u32],
    /// Per source triangle the directions in which rays that start on it hit nothing; empty if
    /// nothing is known.
    pub free: &'a [FreeDirections],
    /// Per source triangle the distances within which such rays hit nothing, instead of `free`.
    pub free_distances: &'a [FreeDistances],
    /// The row of FREE_LEVELS, if there is one.
    pub free_levels: &'a [FreeLevels],
    /// The origin of object space in the source's space; zero without `exact`.
    pub anchor: [f64; 3],
    /// The corners of triangles in the source's space, where f32 would not keep them.
    pub exact: ExactPositions<'a>,
    /// Positions of the source, object space, if kept; distinct ones but in deformable objects and
    /// next to `exact`.
    pub positions: &'a [[f32; 3]],
    /// Per source triangle its rows of `positions`, if kept.
    pub triangles: &'a [[u32; 3]],
    /// Per source triangle its rows of `normals` and `uvs`, if kept.
    pub corners: &'a [[u32; 3]],
    /// Shading normals as in the source, if kept.
    pub normals: &'a [[f32; 3]],
    /// Texture coordinates, if kept.
    pub uvs: &'a [[f32; 2]],
    /// Groups of triangles, if kept.
    pub groups: &'a [Group],
    /// Which triangles belong to which group, ascending by triangle.
    pub group_runs: &'a [GroupRun],
    /// Materials of the groups.
    pub materials: &'a [Material],
    /// Bytes of the names of groups and materials.
    pub labels: &'a [u8],
    /// Per source triangle a [`TriangleOpacity`]; empty where every triangle is opaque.
    pub opacity: &'a [u32],
    /// States of the micro-triangles of triangles that are opaque in part, two bits each.
    pub opacity_micro: &'a [u32],
}

impl<'a> ObjectView<'a> {
    /// An object that is a tree of triangle leaves of `f32`, without any other section.
    pub fn of_tree(
        identity: Identity,
        header: &'a Object,
        lines: &'a [CacheLine],
        triangle_ids: &'a [u32],
    ) -> ObjectView<'a> {
        let bounds = ObjectBounds::new(header);
        ObjectView {
            identity,
            header,
            bounds,
            start_bounds: bounds.for_starts(),
            near_bounds: bounds.for_near_lines(),
            grid: None,
            lines,
            leaf_vertices: &[],
            triangle_ids,
            tet_leaves: &[],
            records: &[],
            tet_vertices: &[],
            tet_faces: &[],
            hull_faces: &[],
            triangle_faces: &[],
            places: &[],
            free: &[],
            free_distances: &[],
            free_levels: &[],
            anchor: [0.0; 3],
            exact: ExactPositions::default(),
            positions: &[],
            triangles: &[],
            corners: &[],
            normals: &[],
            uvs: &[],
            groups: &[],
            group_runs: &[],
            materials: &[],
            labels: &[],
            opacity: &[],
            opacity_micro: &[],
        }
    }
    /// Returns true if the object can be given new positions.
    #[inline(always)]
    pub fn is_deformable(&self) -> bool {
        !self.leaf_vertices.is_empty()
    }
    /// The corners of a triangle in the source's space, given its corners in a leaf. `id` returns
    /// the triangle's id where it is needed: reading it is often a cache miss.
    #[inline(always)]
    pub fn exact_corners(&self, id: impl FnOnce() -> u32, of_leaf: [[f32; 3]; 3]) -> [[f64; 3]; 3] {
        let exact = if self.exact.is_empty() { None } else { self.exact.corners(id()) };
        exact.unwrap_or_else(|| of_leaf.map(|corner| corner.map(f64::from)))
    }

    /// Returns true if the corners of each triangle that a ray can hit are known by its id: from
    /// its leaf or from the source.
    pub fn has_corners(&self) -> bool {
        let rows = [self.triangles.len(), self.places.len()];
        rows.contains(&(self.header.triangles as usize))
    }

    /// Returns true if child boxes are widened ([`WIDENED_BOXES`]).
    pub fn has_widened_boxes(&self) -> bool {
        self.header.coordinates & WIDENED_BOXES != 0
    }
}
