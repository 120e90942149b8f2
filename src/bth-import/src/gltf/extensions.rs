//! Which glTF extensions are read, and the error for those that are not.

use crate::error::Error;
use crate::source::Source;

const EXTENSION: &str = "BTH-I011";

/// Compresses the triangles of a primitive.
pub(crate) const DRACO: &str = "KHR_draco_mesh_compression";

/// Compress buffer views; the two have the same properties and streams.
pub(crate) const MESHOPT: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// Changes the texture coordinates of a texture.
pub(crate) const TEXTURE_TRANSFORM: &str = "KHR_texture_transform";

/// Hides nodes and all that are below them.
pub(crate) const VISIBILITY: &str = "KHR_node_visibility";

/// Required extensions that are read or that do not change where triangles are. A name that ends with `_` stands for all
/// names that begin with it.
pub(crate) const SUPPORTED: [&str; 21] = [
    "KHR_mesh_quantization",
    VISIBILITY,
    DRACO,
    MESHOPT[0],
    MESHOPT[1],
    "KHR_animation_pointer",
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

/// Extensions of nodes that scenes read and flat models cannot.
pub(crate) const SCENE_EXTENSIONS: [&str; 1] = ["EXT_mesh_gpu_instancing"];

/// Whether `name` is among `supported`.
pub(crate) fn is_supported(name: &str, supported: &[&str]) -> bool {
    supported.iter().any(|s| name == *s || s.ends_with('_') && name.starts_with(s))
}

/// The error for an extension that is needed and not read.
pub(crate) fn unsupported_extension(source: &Source<'_>, name: &str) -> Error {
    let message = format!("expected no required extension that changes geometry, found {name}");
    let hint = if MESHOPT.contains(&name) {
        "decompress the model, for example with gltf-transform copy, or build with the cargo feature meshopt"
    } else if name.contains("compression") {
        "decompress the model, for example with gltf-transform copy"
    } else {
        "export the model without this extension"
    };
    source.error_in_part(EXTENSION, name, message, hint)
}
