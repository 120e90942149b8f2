//! The BTH file format: layout, reading, validation. Nothing here traces a ray.
//!
//! [`file::File`] opens a file and checks its header and section table. [`check`] checks every index of an object or of the
//! scene, after which tracing is safe; [`verify`] checks hashes, gaps and geometry too, with exact predicates ([`exact`]).
//! The specification is `format-spec/README.md`.
#![warn(missing_docs)]

pub mod check;
pub mod error;
pub mod exact;
pub mod file;
pub mod layout;
pub mod limits;
pub mod object;
mod scene_view;
mod unpack;
pub mod verify;

pub use error::{Code, Error};
pub use file::File;
pub use object::ObjectView;
pub use scene_view::SceneView;
pub use unpack::Room;
