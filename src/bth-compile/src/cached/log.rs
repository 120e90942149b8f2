//! The log of hits and misses of one compilation.

use serde::Serialize;
use std::collections::BTreeMap;

/// Hits and misses of a compilation.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Log {
    /// Results that came from the cache, by stage.
    pub hits: BTreeMap<String, u64>,
    /// Results that the cache did not have.
    pub misses: Vec<Miss>,
    /// True if a result could not be written.
    pub failed: bool,
}

/// A result that the cache did not have.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Miss {
    /// Its stage.
    pub stage: String,
    /// The object or mesh, where the source has several.
    pub part: String,
    /// Differences from the last key of the same source; `new` for a source without one, `evicted`
    /// where the key is the same.
    pub because: Vec<String>,
}
