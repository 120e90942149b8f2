//! Reads MDD files, the motion designer data of LightWave and Blender: the numbers of frames and points, the time of each frame in
//! seconds, then the positions of each frame; all numbers are big-endian.

use super::vertex_cache::{VertexCache, length_hint};
use super::{MAX_FRAMES, MISMATCH, Timing};
use crate::error::Result;
use crate::source::{MALFORMED, Source, TRUNCATED, TRUNCATED_HINT};

const HEADER: usize = 8;

/// Reads an MDD file.
pub(super) fn read(source: &Source<'_>, timing: &Timing) -> Result<VertexCache> {
    if let Some(rate) = timing.rate {
        let message = format!("an MDD file states the times of its frames; found a rate of {rate}, too");
        return Err(source.error(MISMATCH, message, "leave out the rate"));
    }
    let Some((header, body)) = source.data.split_first_chunk::<HEADER>() else {
        let message = format!("expected the numbers of frames and points, found {} bytes", source.data.len());
        return Err(source.error(TRUNCATED, message, TRUNCATED_HINT));
    };
    let [frames, points] =
        [0, 4].map(|at| i32::from_be_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]]));
    let count = |at: usize, what: &str, count: i32, most: u64| {
        let fits = usize::try_from(count).ok().filter(|count| *count as u64 <= most);
        fits.ok_or_else(|| {
            let message = format!("expected a number of {what} up to {most}, found {count}");
            source.error_at_byte(MALFORMED, at, message, "this is no MDD file, or it is damaged")
        })
    };
    let frames = count(0, "frames", frames, MAX_FRAMES as u64)?;
    let points = count(4, "points", points, i32::MAX as u64)?;
    let bytes = (points as u64).saturating_mul(12).saturating_add(4).saturating_mul(frames as u64);
    if bytes != body.len() as u64 {
        let message = format!(
            "expected {bytes} bytes for the times and positions of {frames} frames of {points} points, found {}",
            body.len()
        );
        return Err(source.error_at_byte(TRUNCATED, HEADER, message, length_hint(body.len(), bytes)));
    }
    let (times, rows) = body.split_at(4 * frames);
    let number = |bytes: &[u8]| f32::from_be_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    let times = times.chunks_exact(4).map(|bytes| timing.start + f64::from(number(bytes))).collect();
    let mut positions = Vec::with_capacity(points * frames);
    for (row, bytes) in rows.chunks_exact(12).enumerate() {
        source.tick(row as u64, HEADER + 4 * frames + 12 * row)?;
        positions.push(std::array::from_fn(|k| number(&bytes[4 * k..])));
    }
    Ok(VertexCache { format: "mdd", points, times, positions })
}
