//! What a compilation found in the cache and what not.

use serde::Serialize;
use std::collections::BTreeMap;

/// What was found and what was not.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Log {
    /// Results that were there, by stage.
    pub hits: BTreeMap<String, u64>,
    /// Results that were not.
    pub misses: Vec<Miss>,
    /// Whether something could not be kept.
    pub failed: bool,
}

/// A result that was not there.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Miss {
    /// Its stage.
    pub stage: String,
    /// Which object or mesh, where there are several.
    pub part: String,
    /// What differs from the last key of the same source; `new` for one never seen, `evicted` for one that had
    /// been there.
    pub because: Vec<String>,
}
