//! Meshes whose vertices move from frame to frame: numbered files of equal topology, and a model
//! with a vertex cache.

mod files;
mod frames;
mod vertex_cache;

pub use files::sequence_files;
pub use frames::{import_sequence, import_sequence_bytes, import_vertex_cache, import_vertex_cache_bytes};
pub use vertex_cache::{VertexCache, read_vertex_cache};

use crate::error::Result;
use crate::source::Source;

/// Code: frames that do not fit each other or their model.
const MISMATCH: &str = "BTH-I017";

/// Most frames of a sequence.
pub const MAX_FRAMES: usize = 1 << 20;

/// When the frames of a sequence or of a vertex cache are shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    /// Frames a second, if the caller states them; above 0.
    pub rate: Option<f64>,
    /// Frames a second where neither the caller nor the file states them; above 0.
    pub usual_rate: f64,
    /// Seconds at which the first frame of a sequence, or frame 0 of a vertex cache, is shown.
    pub start: f64,
}

impl Timing {
    /// Returns the frames a second of a sequence.
    fn rate(&self) -> f64 {
        self.rate.unwrap_or(self.usual_rate)
    }
}

/// Checks that the times of frames ascend strictly and are finite.
fn check_times(source: &Source<'_>, times: &[f64]) -> Result<()> {
    let in_order = |pair: &[f64]| pair[0] < pair[1];
    let wrong = times.iter().position(|t| !t.is_finite());
    let wrong = wrong.or_else(|| times.windows(2).position(|pair| !in_order(pair)).map(|row| row + 1));
    let Some(row) = wrong else { return Ok(()) };
    let before = row.checked_sub(1).map_or(f64::NEG_INFINITY, |row| times[row]);
    let message = format!("frame {row}: expected a finite time after {before} s, found {} s", times[row]);
    Err(source.error(MISMATCH, message, "give another rate, or export the frames again"))
}
