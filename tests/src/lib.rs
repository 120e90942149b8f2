//! What the end-to-end tests share.

pub mod oracle;

/// Compiles the Rust code of the readme.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
pub struct Readme;
