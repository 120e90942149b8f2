//! Wall-clock times of the stages.

use serde::Serialize;
use std::time::Instant;

/// Wall-clock time of a stage.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StageTime {
    /// Name of the stage.
    pub name: &'static str,
    /// Seconds on the wall clock.
    pub seconds: f64,
}

/// Sums up the time of each stage, in order of first use.
#[derive(Default)]
pub(crate) struct Clock(Vec<StageTime>);

impl Clock {
    /// Runs a part of a stage and adds its time to that of the stage.
    pub(crate) fn time<T>(&mut self, name: &'static str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = work();
        self.add(Clock(vec![StageTime { name, seconds: start.elapsed().as_secs_f64() }]));
        result
    }

    /// Adds the times of another clock.
    pub(crate) fn add(&mut self, other: Clock) {
        for StageTime { name, seconds } in other.0 {
            match self.0.iter_mut().find(|stage| stage.name == name) {
                Some(stage) => stage.seconds += seconds,
                None => self.0.push(StageTime { name, seconds }),
            }
        }
    }

    /// The times, in order of first use.
    pub(crate) fn into_times(self) -> Vec<StageTime> {
        self.0
    }
}
