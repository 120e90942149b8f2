//! The conformance files of `format-spec/conformance`, made byte by byte.
//!
//! `BTH_BLESS=1 cargo test -p bth-tests --test conformance` writes them; without it the test
//! compares the committed files with what is made here.

mod deformable;
mod deformers;
mod edit;
mod exact;
mod invalid;
mod materials;
mod scenes;
mod trees;
mod valid;
pub mod worst;

pub use edit::{Editor, Seal};
pub use invalid::invalid;
pub use valid::valid;

/// A conformance file.
#[derive(Clone, Debug)]
pub struct Case {
    /// Name without extension; invalid files start with the code, as in `F012-overlap`.
    pub name: String,
    /// The whole file.
    pub bytes: Vec<u8>,
}

impl Case {
    fn new(name: &str, bytes: Vec<u8>) -> Self {
        Self { name: name.into(), bytes }
    }
    /// The code with which the file must be rejected, such as `BTH-F012`.
    pub fn code(&self) -> String {
        format!("BTH-{}", self.name.split('-').next().unwrap_or_default())
    }
}
