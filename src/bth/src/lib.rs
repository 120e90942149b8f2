//! Runtime of BTH files: opens a compiled file and traces rays, zero-copy.
#![warn(missing_docs)]

pub mod layout;
pub mod limits;
pub mod object;
pub mod rays;
