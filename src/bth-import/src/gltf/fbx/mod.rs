//! FBX, read by the library ufbx into a glTF document.
//!
//! `load` opens the file, `scene` makes nodes, cameras and lights, `mesh` meshes with their skins
//! and shapes, `material` materials with their textures, and `motion` animations.

#[cfg(feature = "fbx")]
mod load;
#[cfg(feature = "fbx")]
mod material;
#[cfg(feature = "fbx")]
mod mesh;
#[cfg(feature = "fbx")]
mod motion;
#[cfg(feature = "fbx")]
mod scene;

#[cfg(feature = "fbx")]
pub(super) use scene::document;

use crate::source::Source;

/// Its name in reports.
pub(crate) const NAME: &str = "fbx";

/// Returns true for content of the format.
pub(crate) fn is_like(data: &[u8]) -> bool {
    data.starts_with(b"Kaydara FBX Binary") || data.starts_with(b"; FBX")
}

/// Returns true for a file of the format.
pub(super) fn is_fbx(source: &Source<'_>) -> bool {
    source.path.extension().is_some_and(|e| e.eq_ignore_ascii_case(NAME)) || is_like(source.data)
}

/// Without the library there is only an error.
#[cfg(not(feature = "fbx"))]
pub(super) fn document(
    source: &Source<'_>,
    _: crate::gltf::extensions::Use,
    _: crate::mesh::Polygons,
) -> crate::error::Result<crate::gltf::made::Made> {
    let message = "expected a format that this build reads, found an FBX file";
    let hint = "build with the cargo feature fbx, or export the model as glTF";
    Err(source.error(crate::source::UNSUPPORTED, message, hint))
}
