//! The check that there is memory for a model, before the work.

use crate::error::{Error, Result};

/// Bytes of memory that a triangle takes until it is compiled, from the reading of its
/// model on (measured: 177 with `--quality fast`, 219 by default).
pub const BYTES_PER_TRIANGLE: u64 = 175;
/// Models of fewer triangles are not checked.
const FEW: u64 = 1 << 17;

/// Refuses triangles where there is less memory than `each` bytes for one of them.
///
/// # Errors
/// `BTH-L034`.
pub fn check_memory(triangles: u64, each: u64) -> Result<()> {
    if triangles < FEW {
        return Ok(());
    }
    let (needed, left) = (triangles.saturating_mul(each), bth_format::memory::available());
    if needed <= left {
        return Ok(());
    }
    let [needed, left] = [needed, left].map(|bytes| bytes >> 20);
    let message = format!(
        "{triangles} triangles take about {needed} MiB of memory to compile, and {left} MiB are left"
    );
    Err(Error::Limit { code: "BTH-L034", message })
}
