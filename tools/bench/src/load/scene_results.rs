//! What `load-scenes` measured, as it is written to JSON.

use super::results::StartsRun;
use crate::output::Head;
use serde::Serialize;
use std::collections::BTreeMap;

/// Everything that was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SceneLoadResults {
    /// When and where.
    #[serde(flatten)]
    pub head: Head,
    /// First rays that were traced.
    pub rays: usize,
    /// Rays of a picture.
    pub picture: usize,
    /// In the order of the command line.
    pub scenes: Vec<SceneStarts>,
}

/// What was measured on a scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SceneStarts {
    /// Name without folder.
    pub name: String,
    /// Objects.
    pub objects: u32,
    /// Instances.
    pub instances: u32,
    /// Triangles of all objects.
    pub triangles: u64,
    /// Seconds that compiling without a cache took, by structure.
    pub compile_s: BTreeMap<&'static str, f64>,
    /// Bytes of our compiled files.
    pub file_bytes: BTreeMap<&'static str, usize>,
    /// One for each number of threads.
    pub runs: Vec<StartsRun>,
}
