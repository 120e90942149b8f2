//! Runs work on a pool of threads.

use crate::failure::Failure;

/// Runs work on a pool of `threads` threads; 0 means one per processor.
///
/// # Errors
/// `BTH-L090` if the threads cannot be started.
pub(super) fn with_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> Result<T, Failure> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(|e| {
        Failure::Compile(bth_compile::Error::Limit {
            code: "BTH-L090",
            message: format!("cannot start {threads} threads: {e}"),
        })
    })?;
    Ok(pool.install(work))
}
