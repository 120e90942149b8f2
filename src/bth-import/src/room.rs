//! The check that there is memory for a model, before the work.

use crate::error::{Error, Result};

/// Bytes of memory that a triangle takes until it is compiled, from the reading of its
/// model on (measured: 162 with `--quality fast`, 219 by default).
pub const BYTES_PER_TRIANGLE: u64 = 165;
/// Objects of more triangles are built in parts of at most this number by default. It is a
/// constant, since bytes of files do not depend on the memory.
pub const TRIANGLES_AT_ONCE: u64 = 1 << 24;
/// Bytes of memory that each triangle beyond these takes.
const BYTES_IN_PARTS: u64 = 110;
/// Models of fewer triangles are not checked.
const FEW: u64 = 1 << 17;

/// Refuses triangles where there is less memory than they take: `each` bytes for a triangle that is
/// built at once with all, or with a part of `at_once` triangles.
///
/// # Errors
/// `BTH-L034`.
pub fn check_memory(triangles: u64, each: u64, at_once: u64) -> Result<()> {
    if triangles < FEW {
        return Ok(());
    }
    let at_once = triangles.min(at_once);
    let needed = at_once.saturating_mul(each).saturating_add((triangles - at_once) * BYTES_IN_PARTS);
    let left = bth_format::memory::available();
    if needed <= left {
        return Ok(());
    }
    let [needed, left] = [needed, left].map(|bytes| bytes >> 20);
    let message = format!(
        "{triangles} triangles take about {needed} MiB of memory to compile, and {left} MiB are left"
    );
    Err(Error::Limit { code: "BTH-L034", message })
}
