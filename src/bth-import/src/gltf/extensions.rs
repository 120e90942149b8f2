//! Which glTF extensions are read, and the error for those that are not.

use crate::error::Error;
use crate::source::Source;

/// Compresses the triangles of a primitive.
pub(super) const DRACO: &str = "KHR_draco_mesh_compression";
/// Compress buffer views; the two have the same properties and streams.
pub(super) const MESHOPT: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];
/// Changes the texture coordinates of a texture.
pub(super) const TEXTURE_TRANSFORM: &str = "KHR_texture_transform";
/// Hides nodes and all that are below them.
pub(crate) const VISIBILITY: &str = "KHR_node_visibility";
/// Places a mesh many times.
pub(super) const INSTANCING: &str = "EXT_mesh_gpu_instancing";
/// Moves any number of a document.
const POINTER: &str = "KHR_animation_pointer";

/// Required extensions that are read or that do not change where triangles are. A name that ends
/// with `_` includes all names that begin with it.
const SUPPORTED: [&str; 21] = [
    "KHR_mesh_quantization",
    VISIBILITY,
    DRACO,
    MESHOPT[0],
    MESHOPT[1],
    POINTER,
    "KHR_lights_punctual",
    "KHR_materials_",
    "KHR_texture_",
    "KHR_xmp",
    "EXT_lights_",
    "EXT_texture_",
    "MSFT_texture_dds",
    "MSFT_packing_",
    "ADOBE_materials_",
    "AGI_articulations",
    "AGI_stk_metadata",
    "EXT_mesh_features",
    "EXT_structural_metadata",
    "EXT_instance_features",
    "KHR_audio",
];

/// What a document is opened for.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Use {
    /// One model of all meshes, which cannot read instancing.
    Flat,
    /// Single meshes.
    Parts,
    /// A scene. Its tracks cannot hold what animation pointers move.
    Scene,
}

impl Use {
    /// Returns true for a required extension that this use reads or need not read.
    pub(super) fn reads(self, name: &str) -> bool {
        let known = |s: &&str| name == *s || s.ends_with('_') && name.starts_with(*s);
        match name {
            INSTANCING => self != Use::Flat,
            POINTER => self != Use::Scene,
            _ => SUPPORTED.iter().any(known),
        }
    }
}

/// Returns the error for an extension that is needed and not read.
pub(super) fn unsupported_extension(source: &Source<'_>, name: &str) -> Error {
    let known = [POINTER, INSTANCING].contains(&name) || MESHOPT.contains(&name);
    let message = match known || name.contains("compression") {
        true => format!("expected no required extension that changes geometry, found {name}"),
        false => {
            format!("expected required extensions that are known, found {name}, which may change geometry")
        }
    };
    let hint = if MESHOPT.contains(&name) {
        "decompress the model, for example with gltf-transform copy, or build with the cargo feature meshopt"
    } else if name.contains("compression") {
        "decompress the model, for example with gltf-transform copy"
    } else {
        "export the model without this extension"
    };
    source.error_in_part("BTH-I011", name, message, hint)
}
