//! The sections of an object.

use super::builder::defect;
use super::{FileBuilder, GroupParts};
use crate::error::{Error, Result};
use bth_format::layout::*;
use bth_import::{Deformation, Exact, Materials};
use std::borrow::Cow;
use zerocopy::{FromBytes, IntoBytes};

/// The contents of an object's sections.
#[derive(Clone, Copy, Debug, Default)]
pub struct ObjectParts<'a> {
    /// Bounds of the triangles that can be hit; `None` without any.
    pub bounds: Option<([f32; 3], [f32; 3])>,
    /// Child code of the root; `NONE` when nothing can be hit.
    pub root: u32,
    /// Triangles of the source.
    pub triangles: u32,
    /// Triangles of zero area, which no leaf holds.
    pub dropped: u32,
    /// Grid of the coordinates in triangle leaves, and the largest distance that a vertex moved;
    /// `None` for `f32`.
    pub grid: Option<(Grid, f32)>,
    /// True if child boxes are widened ([`WIDENED_BOXES`]).
    pub widened_boxes: bool,
    /// Nodes and triangle leaves.
    pub lines: &'a [CacheLine],
    /// Source id of each triangle in leaf order.
    pub triangle_ids: &'a [u32],
    /// Vertices of the source in each leaf; empty but in deformable objects.
    pub leaf_vertices: &'a [[u32; WIDTH]],
    /// Tet leaves.
    pub tet_leaves: &'a [TetLeaf],
    /// The records' bytes.
    pub tets: &'a [u8],
    /// Vertices of the tetrahedra.
    pub tet_vertices: &'a [TetVertex],
    /// Constrained faces.
    pub tet_faces: &'a [TetFace],
    /// Hull faces.
    pub hull_faces: &'a [HullFace],
    /// Row of `tet_faces` per source triangle; not written without tet leaves.
    pub triangle_faces: &'a [u32],
    /// The place of each triangle in the leaves; empty if it is not kept.
    pub places: &'a [u32],
    /// In which directions rays that start on each triangle hit nothing; empty where nothing is
    /// known.
    pub free: &'a [FreeDirections],
    /// Within which distances they hit nothing, instead of `free`.
    pub free_distances: &'a [FreeDistances],
    /// The levels of these distances, one row if there are any.
    pub free_levels: &'a [FreeLevels],
    /// Opacity of each triangle; empty where all are opaque.
    pub opacity: &'a [u32],
    /// States of micro-triangles.
    pub opacity_micro: &'a [u32],
    /// Groups of triangles to keep.
    pub groups: Option<&'a GroupParts>,
    /// How the materials of the groups look, and vertex colours.
    pub materials: Option<&'a Materials>,
    /// Seconds of the frames of a sequence; empty where the vertices do not move by themselves.
    pub sequence_times: &'a [f64],
    /// Positions of the frames of a sequence.
    pub sequence_positions: &'a [[f32; 3]],
    /// What moves the vertices.
    pub deformation: Option<&'a Deformation>,
    /// Positions and attributes to keep.
    pub source: Option<Source<'a>>,
}

/// Positions and attributes of the source; empty slices are not written.
#[derive(Clone, Copy, Debug, Default)]
pub struct Source<'a> {
    /// Welded positions; in deformable objects the positions of all vertices.
    pub positions: &'a [[f32; 3]],
    /// The same positions before they were rounded, where they are kept.
    pub exact: Option<&'a Exact>,
    /// Rows of `positions` per triangle.
    pub triangles: &'a [[u32; 3]],
    /// Rows of `normals` and `uvs` per triangle.
    pub corners: &'a [[u32; 3]],
    /// Shading normals.
    pub normals: &'a [[f32; 3]],
    /// Texture coordinates.
    pub uvs: &'a [[f32; 2]],
}

/// Adds the sections of an object; its depth is measured here.
///
/// # Errors
/// `BTH-L031` when a path has more nodes than the format allows; `BTH-X031` when the parts do not
/// fit together.
pub fn object<'a>(builder: &mut FileBuilder<'a>, index: u32, parts: &ObjectParts<'a>) -> Result<()> {
    let depth = depth(parts)?;
    if depth > bth_format::limits::MAX_DEPTH as u32 {
        let message = format!(
            "the hierarchy has {depth} nodes on a path; the format allows {}",
            bth_format::limits::MAX_DEPTH
        );
        return Err(Error::Limit { code: "BTH-L031", message });
    }
    // Without tet leaves there are no sections of tetrahedra and faces.
    let has_tets = !parts.tet_leaves.is_empty();
    let (lower, upper) = parts.bounds.unwrap_or_default();
    let (coordinates, grid_origin) = parts.grid.map_or_else(Default::default, |(grid, _)| grid.fields());
    let header = Object {
        lower,
        upper,
        root: parts.root,
        record: if has_tets { LINK32 } else { 0 },
        triangles: parts.triangles,
        dropped: parts.dropped,
        depth,
        coordinates: coordinates | if parts.widened_boxes { WIDENED_BOXES } else { 0 },
        grid_origin,
        displacement: parts.grid.map_or(0.0, |(_, displacement)| displacement),
    };
    let row: Cow<'a, [u8]> = header.as_bytes().to_vec().into();
    builder.section(kind::OBJECT, index, size_of::<Object>() as u32, row)?;
    builder.rows(kind::LINES, index, parts.lines)?;
    builder.rows(kind::TRIANGLE_IDS, index, parts.triangle_ids)?;
    builder.rows(kind::LEAF_VERTICES, index, parts.leaf_vertices)?;
    builder.rows(kind::TET_LEAVES, index, parts.tet_leaves)?;
    if has_tets {
        builder.section(kind::TETS, index, size_of::<Link32>() as u32, parts.tets)?;
    }
    builder.rows(kind::TET_VERTICES, index, parts.tet_vertices)?;
    builder.rows(kind::TET_FACES, index, parts.tet_faces)?;
    builder.rows(kind::HULL_FACES, index, parts.hull_faces)?;
    if has_tets {
        builder.rows(kind::TRIANGLE_FACES, index, parts.triangle_faces)?;
    }
    builder.rows(kind::TRIANGLE_PLACES, index, parts.places)?;
    builder.rows(kind::FREE_DIRECTIONS, index, parts.free)?;
    if !parts.free.is_empty() || !parts.free_distances.is_empty() {
        builder.rows(kind::FREE_LEVELS, index, parts.free_levels)?;
    }
    builder.rows(kind::FREE_DISTANCES, index, parts.free_distances)?;
    if let Some(source) = &parts.source {
        builder.rows(kind::POSITIONS, index, source.positions)?;
        if let Some(exact) = source.exact.filter(|exact| !exact.positions.is_empty()) {
            builder.rows(kind::ANCHOR, index, std::slice::from_ref(&exact.anchor))?;
            builder.rows(kind::EXACT_POSITIONS, index, &exact.positions)?;
        }
        builder.rows(kind::TRIANGLES, index, source.triangles)?;
        builder.rows(kind::CORNERS, index, source.corners)?;
        builder.rows(kind::NORMALS, index, source.normals)?;
        builder.rows(kind::UVS, index, source.uvs)?;
    }
    if let Some(groups) = parts.groups {
        groups.write(builder, index)?;
    }
    builder.rows(kind::SEQUENCE_TIMES, index, parts.sequence_times)?;
    builder.rows(kind::SEQUENCE_POSITIONS, index, parts.sequence_positions)?;
    builder.rows(kind::OPACITY, index, parts.opacity)?;
    builder.rows(kind::OPACITY_MICRO, index, parts.opacity_micro)?;
    if let Some(materials) = parts.materials {
        builder.rows(kind::MATERIAL_PARAMETERS, index, &materials.parameters)?;
        builder.rows(kind::GLOSS_PARAMETERS, index, &materials.gloss)?;
        builder.rows(kind::TEXTURES, index, &materials.textures)?;
        builder.rows(kind::COLOR_CORNERS, index, &materials.color_corners)?;
        builder.rows(kind::COLORS, index, &materials.colors)?;
        builder.rows(kind::SECOND_CORNERS, index, &materials.second_corners)?;
        builder.rows(kind::SECOND_UVS, index, &materials.second_uvs)?;
    }
    if let Some(deformation) = parts.deformation {
        builder.rows(kind::DEFORMATION, index, std::slice::from_ref(&deformation.counts))?;
        builder.rows(kind::JOINTS, index, &deformation.joints)?;
        builder.rows(kind::JOINT_WEIGHTS, index, &deformation.weights)?;
        builder.rows(kind::MORPHS, index, &deformation.morphs)?;
        builder.rows(kind::MORPH_ROWS, index, &deformation.morph_rows)?;
        builder.rows(kind::MORPH_DELTAS, index, &deformation.deltas)?;
    }
    Ok(())
}

/// Wide nodes on the longest path.
fn depth(parts: &ObjectParts) -> Result<u32> {
    let mut deepest = 0;
    let mut stack = vec![(parts.root, 0)];
    let mut visits = 0;
    while let Some((code, above)) = stack.pop() {
        match Child::from_code(code) {
            Some(Child::Node(line)) => {
                let missing = || defect(format!("no node at line {line}"));
                let below = parts.lines.get(line as usize..).ok_or_else(missing)?.as_bytes();
                let (node, _) = WideNode::ref_from_prefix(below).map_err(|_| missing())?;
                deepest = deepest.max(above + 1);
                visits += 1;
                // In a tree no two nodes share lines.
                if visits > parts.lines.len() {
                    return Err(defect("the hierarchy is no tree".into()));
                }
                stack.extend(node.child.map(|code| (code, above + 1)));
            }
            Some(Child::Indexed(_) | Child::Raw(_) | Child::Tets(_)) | None => {}
        }
    }
    Ok(deepest)
}
