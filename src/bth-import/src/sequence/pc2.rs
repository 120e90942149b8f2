//! Reads PC2 files, the point caches of 3ds Max and Blender: a header of 32 bytes, then the positions of each sample; all numbers
//! are little-endian.

use super::vertex_cache::{VertexCache, length_hint};
use super::{MAX_FRAMES, Timing};
use crate::error::Result;
use crate::source::{MALFORMED, Source, TRUNCATED, TRUNCATED_HINT, UNSUPPORTED};

/// The first bytes of a PC2 file.
pub(super) const SIGNATURE: &[u8; 12] = b"POINTCACHE2\0";
const HEADER: usize = 32;

/// Reads a PC2 file. Its samples are at frames, which `timing` turns into seconds.
pub(super) fn read(source: &Source<'_>, timing: &Timing) -> Result<VertexCache> {
    let Some((header, body)) = source.data.split_first_chunk::<HEADER>() else {
        let message = format!("expected a header of {HEADER} bytes, found {}", source.data.len());
        return Err(source.error(TRUNCATED, message, TRUNCATED_HINT));
    };
    let word = |at: usize| [header[at], header[at + 1], header[at + 2], header[at + 3]];
    let hint = "export the cache again";
    let version = i32::from_le_bytes(word(12));
    if version != 1 {
        let message = format!("expected version 1 of PC2, found {version}");
        return Err(source.error_at_byte(UNSUPPORTED, 12, message, hint));
    }
    let (points, samples) = (i32::from_le_bytes(word(16)), i32::from_le_bytes(word(28)));
    let (first, step) = (f32::from_le_bytes(word(20)), f32::from_le_bytes(word(24)));
    let count = |at: usize, what: &str, count: i32, most: u64| {
        let fits = usize::try_from(count).ok().filter(|count| *count as u64 <= most);
        fits.ok_or_else(|| {
            let message = format!("expected a number of {what} up to {most}, found {count}");
            source.error_at_byte(MALFORMED, at, message, hint)
        })
    };
    let points = count(16, "points", points, i32::MAX as u64)?;
    let samples = count(28, "samples", samples, MAX_FRAMES as u64)?;
    let bytes = (points as u64).saturating_mul(samples as u64).saturating_mul(12);
    if bytes != body.len() as u64 {
        let message = format!(
            "expected {bytes} bytes for {samples} samples of {points} points behind the header, found {}",
            body.len()
        );
        return Err(source.error_at_byte(TRUNCATED, HEADER, message, length_hint(body.len(), bytes)));
    }
    let rate = timing.rate();
    let time = |sample: usize| timing.start + (f64::from(first) + sample as f64 * f64::from(step)) / rate;
    let mut positions = Vec::with_capacity(points * samples);
    for (row, bytes) in body.as_chunks::<12>().0.iter().enumerate() {
        source.tick(row as u64, HEADER + 12 * row)?;
        positions.push(std::array::from_fn(|k| {
            f32::from_le_bytes(std::array::from_fn(|byte| bytes[4 * k + byte]))
        }));
    }
    Ok(VertexCache { format: "pc2", points, times: (0..samples).map(time).collect(), positions })
}
