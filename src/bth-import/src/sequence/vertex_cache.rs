//! Vertex caches: PC2 of 3ds Max and Blender, and MDD of LightWave and Blender.

use super::{MAX_FRAMES, MISMATCH, Timing, check_times};
use crate::error::Result;
use crate::monitor::Monitor;
use crate::source::{MALFORMED, Source, TRUNCATED, TRUNCATED_HINT, UNSUPPORTED};
use std::path::Path;

/// The first bytes of a PC2 file.
const PC2_SIGNATURE: &[u8; 12] = b"POINTCACHE2\0";
const PC2_HEADER: usize = 32;
const MDD_HEADER: usize = 8;
const EXPORT: &str = "export the cache again";

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

/// Reads a PC2 or MDD file from its bytes; `name` is for messages. A PC2 file is known by its first
/// bytes.
///
/// # Errors
/// `BTH-I00…` where the file does not follow its format, `BTH-I017` where times do not ascend or a
/// rate is given for MDD; cancellation.
pub fn read_vertex_cache(
    name: &Path,
    data: &[u8],
    timing: &Timing,
    monitor: &dyn Monitor,
) -> Result<VertexCache> {
    let source = &Source::new(name, data, monitor);
    source.fetched()?;
    let cache = match data.starts_with(PC2_SIGNATURE) {
        true => read_pc2(source, timing)?,
        false => read_mdd(source, timing)?,
    };
    check_times(source, &cache.times)?;
    if cache.times.is_empty() {
        return Err(source.error(MISMATCH, "expected at least one frame, found none", EXPORT));
    }
    Ok(cache)
}

/// Reads a header of 32 bytes, then the positions of each sample; all numbers are little-endian.
/// Samples are at frames, which `timing` turns into seconds.
fn read_pc2(source: &Source<'_>, timing: &Timing) -> Result<VertexCache> {
    let Some((header, body)) = source.data.split_first_chunk::<PC2_HEADER>() else {
        let message = format!("expected a header of {PC2_HEADER} bytes, found {}", source.data.len());
        return Err(source.error(TRUNCATED, message, TRUNCATED_HINT));
    };
    let word = |at: usize| [0, 1, 2, 3].map(|k| header[at + k]);
    let version = i32::from_le_bytes(word(12));
    if version != 1 {
        let message = format!("expected version 1 of PC2, found {version}");
        return Err(source.error_at_byte(UNSUPPORTED, 12, message, EXPORT));
    }
    let count = |at: usize, what: &str, max: usize| {
        checked_count(source, at, i32::from_le_bytes(word(at)), what, max, EXPORT)
    };
    let points = count(16, "points", i32::MAX as usize)?;
    let samples = count(28, "samples", MAX_FRAMES)?;
    let bytes = (points as u64).saturating_mul(samples as u64).saturating_mul(12);
    let what = format!("{samples} samples of {points} points behind the header");
    check_length(source, PC2_HEADER, body, bytes, &what)?;
    let [first, step] = [20, 24].map(|at| f64::from(f32::from_le_bytes(word(at))));
    let time = |sample: usize| timing.start + (first + sample as f64 * step) / timing.rate();
    let positions = positions(source, PC2_HEADER, body, f32::from_le_bytes)?;
    Ok(VertexCache { format: "pc2", points, times: (0..samples).map(time).collect(), positions })
}

/// Reads the numbers of frames and points, the time of each frame in seconds, then the positions of
/// each frame; all numbers are big-endian.
fn read_mdd(source: &Source<'_>, timing: &Timing) -> Result<VertexCache> {
    if let Some(rate) = timing.rate {
        let message = format!("an MDD file states the times of its frames; found a rate of {rate}, too");
        return Err(source.error(MISMATCH, message, "leave out the rate"));
    }
    let Some((header, body)) = source.data.split_first_chunk::<MDD_HEADER>() else {
        let message = format!("expected the numbers of frames and points, found {} bytes", source.data.len());
        return Err(source.error(TRUNCATED, message, TRUNCATED_HINT));
    };
    let count = |at: usize, what: &str, max: usize| {
        let found = i32::from_be_bytes([0, 1, 2, 3].map(|k| header[at + k]));
        checked_count(source, at, found, what, max, "this is no MDD file, or it is damaged")
    };
    let frames = count(0, "frames", MAX_FRAMES)?;
    let points = count(4, "points", i32::MAX as usize)?;
    let bytes = (points as u64).saturating_mul(12).saturating_add(4).saturating_mul(frames as u64);
    let what = format!("the times and positions of {frames} frames of {points} points");
    check_length(source, MDD_HEADER, body, bytes, &what)?;
    let (times, rows) = body.split_at(4 * frames);
    let times = times.as_chunks::<4>().0.iter();
    let times = times.map(|bytes| timing.start + f64::from(f32::from_be_bytes(*bytes))).collect();
    let positions = positions(source, MDD_HEADER + 4 * frames, rows, f32::from_be_bytes)?;
    Ok(VertexCache { format: "mdd", points, times, positions })
}

fn positions(
    source: &Source<'_>,
    start: usize,
    rows: &[u8],
    number: fn([u8; 4]) -> f32,
) -> Result<Vec<[f32; 3]>> {
    let mut positions = Vec::with_capacity(rows.len() / 12);
    for (row, numbers) in rows.as_chunks::<4>().0.as_chunks::<3>().0.iter().enumerate() {
        source.tick(row as u64, start + 12 * row)?;
        positions.push(numbers.map(number));
    }
    Ok(positions)
}

fn checked_count(
    source: &Source<'_>,
    at: usize,
    found: i32,
    what: &str,
    max: usize,
    hint: &str,
) -> Result<usize> {
    let fits = usize::try_from(found).ok().filter(|count| *count <= max);
    fits.ok_or_else(|| {
        let message = format!("expected a number of {what} up to {max}, found {found}");
        source.error_at_byte(MALFORMED, at, message, hint)
    })
}

/// Refuses a body of another length than the header tells.
fn check_length(source: &Source<'_>, at: usize, body: &[u8], bytes: u64, what: &str) -> Result<()> {
    let hint = match bytes.cmp(&(body.len() as u64)) {
        std::cmp::Ordering::Equal => return Ok(()),
        std::cmp::Ordering::Greater => TRUNCATED_HINT,
        std::cmp::Ordering::Less => "export the cache again; its header does not belong to what follows",
    };
    let message = format!("expected {bytes} bytes for {what}, found {}", body.len());
    Err(source.error_at_byte(TRUNCATED, at, message, hint))
}
