//! The bytes of sections of names.

use std::collections::HashMap;

/// Names one behind the other. Equal names are stored once.
#[derive(Default)]
pub(crate) struct Names {
    pub(crate) bytes: Vec<u8>,
    first: HashMap<String, u32>,
}

impl Names {
    /// Adds a name. Returns its first byte and its length.
    pub(crate) fn add(&mut self, name: &str) -> (u32, u32) {
        let length = name.len() as u32;
        if let Some(first) = self.first.get(name) {
            return (*first, length);
        }
        let (first, length) = self.append(name);
        self.first.insert(name.to_owned(), first);
        (first, length)
    }

    /// Adds a name that is not asked for again.
    pub(crate) fn append(&mut self, name: &str) -> (u32, u32) {
        let first = self.bytes.len() as u32;
        self.bytes.extend_from_slice(name.as_bytes());
        (first, name.len() as u32)
    }
}
