//! Runtime of BTH files: opens a compiled file and traces rays, zero-copy.
#![warn(missing_docs)]

pub mod check;
pub mod error;
pub mod file;
pub mod layout;
pub mod limits;
pub mod object;
pub mod rays;

pub use error::{Code, Error};
pub use file::File;
