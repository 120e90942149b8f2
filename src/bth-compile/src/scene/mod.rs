//! Scenes: from glTF to a manifest (`import`), and from a manifest to a file (`compile`).

mod at_once;
mod compile;
mod encode;
mod meshes;
mod object;
mod objects;
mod outline;
mod previous;
mod sources;
mod stored;
mod visible;
mod weights;

pub use bth_import::gltf::Chosen;
pub use bth_import::gltf::scene::{ImportOptions, ImportReport, import};
pub use compile::{Keep, Place, SceneReport, compile, compile_cached, compile_objects, foresee};
pub use objects::ObjectReport;
