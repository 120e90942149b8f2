//! A triangle mesh as the importers hand it on, and what they say of it.

use serde::{Deserialize, Serialize};

/// A triangle mesh in object space, with bit-equal positions welded (-0 counts as +0).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Distinct finite positions, in order of first use by the faces.
    pub positions: Vec<[f32; 3]>,
    /// Rows of `positions`, in the source's face order after fan triangulation: the index is the
    /// triangle id everywhere in the product. Degenerate triangles are kept here.
    pub triangles: Vec<[u32; 3]>,
    /// Shading attributes, if the source has some and they were asked for.
    pub attributes: Option<Attributes>,
}

/// Shading attributes per corner, indexed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Attributes {
    /// Per triangle: rows of `normals` and `uvs`.
    pub corners: Vec<[u32; 3]>,
    /// Normals as in the source, or empty.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates, or empty. When both are present they have the same number of rows.
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

/// What was found in a source; counts of triangles unless said otherwise.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Name of the format that was read.
    pub format: String,
    /// Triangles after fan triangulation.
    pub triangles: u64,
    /// Positions before and after welding.
    pub positions_read: u64,
    /// Distinct positions.
    pub positions: u64,
    /// Faces of more than three corners that were fan-triangulated.
    pub polygons: u64,
    /// Faces of fewer than three corners, points and lines, which were left out (elements).
    pub skipped: u64,
    /// Triangles of exactly zero area (decided exactly): kept for their ids, hit by no ray.
    pub degenerate: u64,
    /// Triangles with the same three positions as an earlier one.
    pub duplicate: u64,
    /// Edges with one triangle.
    pub boundary_edges: u64,
    /// Edges with more than two triangles.
    pub non_manifold_edges: u64,
    /// Connected components (by shared positions).
    pub components: u64,
    /// Positions that are not finite and that no face uses (positions); used ones are an error.
    pub non_finite_unused: u64,
}

impl Mesh {
    /// The corners of a triangle.
    #[inline]
    pub fn corners(&self, triangle: u32) -> [[f32; 3]; 3] {
        self.triangles[triangle as usize].map(|v| self.positions[v as usize])
    }
}
