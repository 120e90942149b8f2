//! Scenes: from glTF to a manifest (`import`), and from a manifest to a file (`compile`).

mod compile;
mod encode;
mod import;
mod import_tracks;
mod objects;
mod visible;

pub use compile::{SceneReport, compile};
pub use import::{ImportOptions, ImportReport, import};
pub use import_tracks::Chosen;
pub use objects::ObjectReport;
