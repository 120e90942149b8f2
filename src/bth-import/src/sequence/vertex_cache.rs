//! What a vertex cache holds, whatever its format.

use crate::source::TRUNCATED_HINT;

/// The positions of a vertex cache.
#[derive(Clone, Debug, PartialEq)]
pub struct VertexCache {
    /// Name of the format.
    pub format: &'static str,
    /// Vertices of a frame.
    pub points: usize,
    /// Seconds of the frames, strictly ascending.
    pub times: Vec<f64>,
    /// Positions by frame, then by vertex; they may not be finite.
    pub positions: Vec<[f32; 3]>,
}

/// The hint for a body of another length than the header tells: cut off, or longer.
pub(super) fn length_hint(found: usize, expected: u64) -> &'static str {
    match (found as u64) < expected {
        true => TRUNCATED_HINT,
        false => "export the cache again; its header does not belong to what follows",
    }
}
