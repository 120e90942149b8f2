//! The BTH file format: layout, reading and validation. Nothing here traces a ray.
//!
//! The specification is `format-spec/README.md`; its invariants have the numbers of the error codes
//! ([`Code`]). A file is checked in three steps:
//!
//! 1. [`File::read`], [`File::map`] and [`File::from_bytes`] check the header and the section
//!    table: O(sections).
//! 2. [`File::check`] and [`File::check_scene`] check every index of an object or of the scene,
//!    after which traversing it is safe: O(bytes of their sections).
//! 3. [`verify::verify`] checks hashes, gaps and geometry too, with exact predicates ([`exact`]):
//!    O(bytes of the file).
//!
//! ```no_run
//! let file = bth_format::File::read("bunny.bth")?;
//! for object in 0..file.object_count() {
//!     let view = file.check(object)?;
//!     let header = view.header;
//!     println!("{} triangles", header.triangles);
//!     println!("from {:?} to {:?}", header.lower, header.upper);
//! }
//! # Ok::<(), bth_format::Error>(())
//! ```
#![warn(missing_docs)]
// What zerocopy tells about bytes that do not fit says less than the message, and its texts would
// be part of every program.
#![allow(clippy::ok_expect)]

mod check;
mod code;
pub mod error;
pub mod exact;
pub mod file;
pub mod groups;
mod identity;
pub mod layout;
pub mod limits;
pub mod memory;
mod names;
pub mod object;
mod unpack;
pub mod verify;
mod view;

pub use code::Code;
pub use error::Error;
pub use file::{File, FileMemory};
pub use identity::Identity;
pub use object::ObjectView;
pub use view::{
    DeformationView, FramePosition, ImagesView, MaterialsView, MorphDeltas, SceneView, SequenceView,
};
