//! Clocks. One thread is timed by its CPU clock, which skips the time of other jobs; several
//! threads by the wall clock.

use rustix::time::{ClockId, clock_gettime};
use std::time::Instant;

/// A clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Clock {
    /// CPU time of the calling thread.
    ThreadCpu,
    /// Wall clock.
    Wall,
}

impl Clock {
    /// The clock for work on `threads` threads.
    pub(crate) fn for_threads(threads: usize) -> Clock {
        if threads <= 1 { Clock::ThreadCpu } else { Clock::Wall }
    }

    /// Seconds that the work takes.
    pub(crate) fn time(self, work: impl FnOnce()) -> f64 {
        match self {
            Clock::ThreadCpu => {
                let start = read(ClockId::ThreadCPUTime);
                work();
                read(ClockId::ThreadCPUTime) - start
            }
            Clock::Wall => {
                let start = Instant::now();
                work();
                start.elapsed().as_secs_f64()
            }
        }
    }
}

/// CPU seconds of this process so far, over all its threads.
pub(crate) fn process_cpu() -> f64 {
    read(ClockId::ProcessCPUTime)
}

fn read(clock: ClockId) -> f64 {
    let now = clock_gettime(clock);
    now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9
}
