//! What a vertex cache holds, whatever its format.

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
