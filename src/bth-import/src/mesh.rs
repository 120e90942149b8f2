//! The triangle mesh that importers make, and their report about it.

use crate::deformation::Deformation;
use crate::exact::Exact;
use crate::groups::Groups;
use crate::materials::{Materials, Unreadable};
pub use crate::polygon::Polygons;
use crate::zero_area::is_zero_area;
use serde::{Deserialize, Serialize};

/// A triangle mesh in object space, with bit-equal positions welded (-0 counts as +0) unless all
/// vertices of the source are wanted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Distinct finite positions, in order of first use by the faces; with [`Wanted::vertices`] all
    /// positions of the source in its order. With `exact` they are relative to its anchor, and some
    /// may be equal.
    pub positions: Vec<[f32; 3]>,
    /// The positions before they were rounded, where f64 is kept ([`Wanted::positions`]).
    pub exact: Option<Exact>,
    /// Rows of `positions`, in the source's face order after polygons have been triangulated. The
    /// index of a triangle here is its id in the compiled file and in hits. Degenerate triangles
    /// are kept.
    pub triangles: Vec<[u32; 3]>,
    /// Shading attributes, if the source has some and the caller keeps them.
    pub attributes: Option<Attributes>,
    /// Where triangles let rays pass, in the form of the compiled file; `None` where all are
    /// opaque. The compiler fills it in.
    pub opacity: Option<TriangleOpacities>,
    /// Groups of triangles, if the caller wants them.
    pub groups: Option<Groups>,
    /// How the materials of the groups look, if the caller wants them.
    pub materials: Option<Materials>,
    /// The positions at other times, if the mesh is a sequence; `positions` are then the first
    /// frame.
    pub sequence: Option<Sequence>,
    /// What moves its vertices, of a [`GltfPart::Deforming`](crate::GltfPart::Deforming). Positions
    /// are then distinct together with what moves them.
    pub deformation: Option<Deformation>,
}

/// Positions of a mesh at several times. Between two frames vertices move on straight lines at
/// constant speed; before the first and after the last they do not move.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sequence {
    /// Seconds of the frames, strictly ascending; at least one.
    pub times: Vec<f64>,
    /// Finite positions by frame, each with as many rows as [`Mesh::positions`].
    pub positions: Vec<[f32; 3]>,
}

/// Opacity of each triangle, as the sections OPACITY and OPACITY_MICRO of a compiled file have it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleOpacities {
    /// A row for each triangle.
    pub rows: Vec<u32>,
    /// States of micro-triangles.
    pub micro: Vec<u32>,
}

/// What the opacity of a mesh's triangles consists of. Shares are of the area of the triangles of
/// cut-out materials.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OpacityReport {
    /// Triangles of cut-out materials.
    pub triangles: u64,
    /// Those of them that are divided into micro-triangles.
    pub subdivided: u64,
    /// Different patterns of micro-triangles.
    pub patterns: u64,
    /// Share of the area that is opaque.
    pub opaque: f64,
    /// Share of the area that is transparent.
    pub transparent: f64,
    /// Share of the area that is neither: the edges of holes, where they are finer than
    /// micro-triangles.
    pub unknown: f64,
    /// Bytes of the sections.
    pub bytes: u64,
}

/// Shading attributes per corner, indexed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Attributes {
    /// Per triangle: rows of `normals` and `uvs`.
    pub corners: Vec<[u32; 3]>,
    /// Normals as in the source, or empty.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates, or empty. When there are normals too, both have the same number of
    /// rows.
    pub uvs: Vec<[f32; 2]>,
}

/// Which attributes to keep (`--attributes`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Keep {
    /// Positions only.
    #[default]
    None,
    /// Normals.
    Normals,
    /// Normals and texture coordinates.
    All,
}

/// In which numbers to keep positions (`--positions`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Positions {
    /// In f64 where f32 would move a position by more than the size of the model times 2^-24.
    #[default]
    Auto,
    /// In f32. What that moves and drops is counted.
    F32,
    /// As the source has them, unless all its numbers are f32.
    F64,
}

/// What to read of a model besides positions and triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wanted {
    /// Shading attributes.
    pub attributes: Keep,
    /// Groups of triangles, with their names and materials (`--names`).
    pub groups: bool,
    /// How materials look, and vertex colours (`--materials`). Needs groups.
    pub materials: bool,
    /// What becomes of images and material libraries that cannot be read (`--lenient-materials`).
    pub unreadable: Unreadable,
    /// How polygons of OBJ, PLY, OFF and STL become triangles (`--polygons`).
    pub polygons: Polygons,
    /// In which numbers to keep positions. Sequences, what skins or morph targets move, and meshes
    /// with all vertices keep f32.
    pub positions: Positions,
    /// All vertices of the source, in its order, those at equal positions and unused ones too
    /// (`--deformable`).
    pub vertices: bool,
}

impl Wanted {
    /// In which numbers positions are kept, unless the vertices move.
    pub(crate) fn kept_positions(&self) -> Positions {
        if self.vertices { Positions::F32 } else { self.positions }
    }
}

impl From<Keep> for Wanted {
    fn from(attributes: Keep) -> Self {
        Self { attributes, ..Self::default() }
    }
}

/// What was found in a source. Counts are of triangles unless the field names another unit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Name of the format that was read.
    pub format: String,
    /// Triangles after polygons have been triangulated.
    pub triangles: u64,
    /// Positions in the source, before welding.
    pub positions_read: u64,
    /// Distinct positions that faces use, after welding.
    pub positions: u64,
    /// Faces of more than three corners.
    pub polygons: u64,
    /// Those of them that are concave, so that the fan from the first corner covers more than the
    /// polygon.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub concave: u64,
    /// Elements that were skipped: faces of fewer than three corners, triangles of glTF that the
    /// number of indices leaves incomplete, points and lines.
    pub skipped: u64,
    /// Triangles of exactly zero area, decided by exact arithmetic. They keep their ids, and no ray
    /// hits them.
    pub degenerate: u64,
    /// Triangles with the same three positions as an earlier one.
    pub duplicate: u64,
    /// Edges of one triangle.
    pub boundary_edges: u64,
    /// Edges of more than two triangles.
    pub non_manifold_edges: u64,
    /// Components that are connected by shared positions.
    pub components: u64,
    /// Positions that are not finite and that no face uses. Used ones are an error.
    pub non_finite_unused: u64,
    /// What rounding positions to f32 moves and drops, where that is more than next to nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rounding: Option<Rounding>,
    /// What it would move and drop, if positions are kept in f64 instead.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub avoided_rounding: Option<Rounding>,
    /// Frames of a sequence; 0 for other models.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub frames: u64,
    /// Opacity of triangles, where some are not opaque.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub opacity: Option<OpacityReport>,
}

/// What rounding the positions of a source to f32 does to a mesh that lies farther from the origin
/// than it is large.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Rounding {
    /// Positions in the source, before welding, that move by more than the size of the model times
    /// 2^-24.
    pub positions: u64,
    /// The farthest that a position moves along an axis, in the model's unit.
    pub farthest: f64,
    /// Triangles that have an area in the source and none after rounding.
    pub triangles: u64,
}

fn is_zero(count: &u64) -> bool {
    *count == 0
}

impl Mesh {
    /// The corners of a triangle.
    #[inline]
    pub fn corners(&self, triangle: u32) -> [[f32; 3]; 3] {
        self.triangles[triangle as usize].map(|v| self.positions[v as usize])
    }

    /// Returns true if a triangle has exactly zero area, decided by the exact positions if there
    /// are some.
    pub fn has_zero_area(&self, triangle: u32) -> bool {
        match &self.exact {
            None => is_zero_area(self.corners(triangle)),
            Some(exact) => {
                is_zero_area(self.triangles[triangle as usize].map(|v| exact.positions[v as usize]))
            }
        }
    }
}
