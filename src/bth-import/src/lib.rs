//! Reads models: OBJ, PLY, STL, OFF, glTF, GLB, FBX and 3MF into welded triangle meshes, and scenes
//! of glTF, FBX and 3MF into manifests.
//!
//! [`import()`] is the entry point, and [`import_sequence`] and [`import_vertex_cache`] for meshes
//! whose vertices move. `formats` finds the format, whose reader turns the file into a `raw` mesh
//! with the source's own rows. Then `weld` merges equal positions, `attributes` merges shading
//! rows, and `topology` makes the counts of the report. [`gltf::scene`] reads nodes, animations,
//! cameras and lights into a manifest instead.
#![warn(missing_docs)]

mod attributes;
mod concave;
mod coordinate_range;
mod corner_grid;
mod cutout;
mod deformation;
mod disjoint_sets;
mod ears;
pub mod error;
mod exact;
mod foreign;
mod formats;
pub mod gltf;
mod groups;
mod image_file;
mod import;
mod materials;
mod memory;
mod mesh;
pub mod monitor;
mod polygon;
mod raw;
mod room;
mod rounding;
mod sequence;
mod source;
mod text;
mod topology;
mod weld;
mod zero_area;

pub use cutout::{AlphaImage, AlphaMode, CutoutCorner, CutoutMaterial, CutoutTriangle, Cutouts, Wrap};
pub use deformation::Deformation;
pub use error::{Error, Place, Result};
pub use exact::Exact;
pub use formats::{extensions, is_scene, source_files};
pub use gltf::GltfPart;
pub use groups::{Group, Groups};
pub use import::{
    import, import_bytes, import_cutouts, import_cutouts_bytes, import_gltf_cutouts, import_gltf_parts,
    import_gltf_parts_bytes, import_images, import_images_bytes,
};
pub use materials::{ImageFile, Looks, Materials, NO_GLOSS, PLAIN, Unreadable};
pub use memory::{MEMORY_FORMAT, PositionRows, import_triangles};
pub use mesh::{
    Attributes, Keep, Mesh, OpacityReport, Polygons, Positions, Report, Rounding, Sequence,
    TriangleOpacities, Wanted,
};
pub use monitor::{Monitor, Silent};
pub use room::{BYTES_PER_TRIANGLE, TRIANGLES_AT_ONCE, check_memory};
pub use sequence::{
    MAX_FRAMES, Timing, VertexCache, import_sequence, import_sequence_bytes, import_vertex_cache,
    import_vertex_cache_bytes, read_vertex_cache, sequence_files,
};
pub use source::read_file;
pub use zero_area::is_zero_area;
