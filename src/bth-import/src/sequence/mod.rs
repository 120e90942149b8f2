//! Meshes whose vertices move from frame to frame: numbered files of equal topology, and a model
//! with a vertex cache.

mod files;
mod frames;
mod vertex_cache;

pub use files::sequence_files;
pub use frames::{import_sequence, import_sequence_bytes, import_vertex_cache, import_vertex_cache_bytes};
pub use vertex_cache::{VertexCache, read_vertex_cache};

use std::collections::HashMap;
use std::sync::atomic::AtomicU32;

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

/// Returns for each vertex the first row that is equal to it in every frame. All frames have
/// equally many rows. -0 equals +0.
pub(crate) fn equal_vertices(frames: &[&[[f32; 3]]]) -> Vec<AtomicU32> {
    // Vertices of the same hash are compared in every frame.
    let mut of_hash: HashMap<u64, Vec<usize>> = HashMap::new();
    let first = |row: usize| {
        let same = of_hash.entry(hash(frames, row)).or_default();
        let equal = |other: &&usize| frames.iter().all(|frame| frame[row] == frame[**other]);
        let found = same.iter().find(equal).copied();
        if found.is_none() {
            same.push(row);
        }
        AtomicU32::new(found.unwrap_or(row) as u32)
    };
    (0..frames[0].len()).map(first).collect()
}

/// Hashes a vertex's positions in all frames.
fn hash(frames: &[&[[f32; 3]]], row: usize) -> u64 {
    let mix = |hash: u64, x: f32| {
        (hash.rotate_left(23) ^ u64::from((x + 0.0).to_bits())).wrapping_mul(0x9e37_79b9_7f4a_7c15)
    };
    frames.iter().flat_map(|frame| frame[row]).fold(0, mix)
}
