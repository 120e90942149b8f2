//! A clock for reports and choices, also on targets that have none.

use std::time::{Duration, Instant};

/// The current time; `None` on targets without a clock, where [`Instant::now`] panics.
pub(crate) fn now() -> Option<Instant> {
    if cfg!(all(target_family = "wasm", target_os = "unknown")) { None } else { Some(Instant::now()) }
}

/// The time that has passed since [`now`] was called; zero on targets without a clock.
pub(crate) fn elapsed(start: Option<Instant>) -> Duration {
    start.map_or(Duration::ZERO, |start| start.elapsed())
}
