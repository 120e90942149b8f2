//! 3MF, read into a glTF document.
//!
//! `package` unzips the parts of a file, `part` reads their elements, `model` resources and what is
//! built, `object` makes meshes, and `scene` nodes.

#[cfg(feature = "3mf")]
mod model;
#[cfg(feature = "3mf")]
mod object;
#[cfg(feature = "3mf")]
mod package;
#[cfg(feature = "3mf")]
mod part;
#[cfg(feature = "3mf")]
mod scene;

use crate::gltf::made::MadeFormat;

/// Reads the format; without its libraries there is only an error.
pub(crate) const FORMAT: MadeFormat = MadeFormat {
    name: "3mf",
    is_like,
    #[cfg(feature = "3mf")]
    document: scene::document,
    #[cfg(not(feature = "3mf"))]
    document: |source, _, _| Err(crate::gltf::made::not_built(source, "a 3MF file", "3mf")),
};

#[cfg(feature = "3mf")]
const EXPORT: &str = "export the model again, or as glTF";
/// The usual name of the root part.
const ROOT: &[u8] = b"3D/3dmodel.model";

/// Returns true for content of the format.
fn is_like(data: &[u8]) -> bool {
    data.starts_with(b"PK\x03\x04") && data.windows(ROOT.len()).any(|name| name == ROOT)
}
