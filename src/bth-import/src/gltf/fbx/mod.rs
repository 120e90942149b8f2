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

use crate::gltf::made::MadeFormat;

/// Reads the format; without the library there is only an error.
pub(crate) const FORMAT: MadeFormat = MadeFormat {
    name: "fbx",
    is_like: |data| data.starts_with(b"Kaydara FBX Binary") || data.starts_with(b"; FBX"),
    #[cfg(feature = "fbx")]
    document: scene::document,
    #[cfg(not(feature = "fbx"))]
    document: |source, _, _| Err(crate::gltf::made::not_built(source, "an FBX file", "fbx")),
};
