//! What decides where triangles of cut-out materials have holes: alpha of textures, factors and
//! vertices.
//!
//! alpha(u, v) = factor · texture(u, v) · vertex alpha; the surface is there where alpha is at or
//! above the cutoff (glTF 2.0 specification, §3.9.4).

use serde::{Deserialize, Serialize};

/// Materials whose alpha makes holes (`--alpha`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AlphaMode {
    /// None: every triangle is opaque.
    #[default]
    None,
    /// Materials of alpha mode MASK.
    Mask,
    /// Materials of alpha mode MASK, and of BLEND with a cutoff of 0.5.
    Blend,
}

/// How texture coordinates beyond 0 and 1 find texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The texture repeats.
    #[default]
    Repeat,
    /// The texture repeats, every second time mirrored.
    Mirror,
    /// The texels at the edge go on.
    Clamp,
}

/// The alpha channel of an image, row by row from the top: 0 is transparent, 255 opaque.
#[derive(Clone, Debug, PartialEq)]
pub struct AlphaImage {
    /// Columns, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// `width` × `height` values.
    pub alpha: Vec<u8>,
}

/// A material that makes holes.
#[derive(Clone, Debug, PartialEq)]
pub struct CutoutMaterial {
    /// Row of the images; `None` where the texture's alpha is 1 everywhere.
    pub image: Option<usize>,
    /// How u and v find texels.
    pub wrap: [Wrap; 2],
    /// True if the nearest texel decides; else the four around are interpolated bilinearly. Centers
    /// of texels are at (k + ½) / size.
    pub nearest: bool,
    /// Alpha of the material's colour, from 0 to 1.
    pub factor: f64,
    /// Smallest alpha at which there is a surface.
    pub cutoff: f64,
}

/// A corner of a triangle of a cut-out material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutoutCorner {
    /// Texture coordinates, after the texture's transform.
    pub uv: [f32; 2],
    /// Alpha of the vertex colour, from 0 to 1; 1 without one. Between the corners it is
    /// interpolated linearly.
    pub alpha: f32,
}

/// The cut-out materials of a mesh and the triangles that have them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cutouts {
    /// Images.
    pub images: Vec<AlphaImage>,
    /// Materials.
    pub materials: Vec<CutoutMaterial>,
    /// Triangles of these materials, by ascending triangle id.
    pub triangles: Vec<CutoutTriangle>,
    /// Number of triangles of the mesh.
    pub mesh_triangles: usize,
}

/// A triangle of a cut-out material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutoutTriangle {
    /// Triangle id.
    pub triangle: u32,
    /// Row of the materials.
    pub material: u32,
    /// Corners in the order of the mesh's triangle.
    pub corners: [CutoutCorner; 3],
}
