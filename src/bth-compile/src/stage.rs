//! A stage of the compilation, and the clock around all stages.

use crate::error::Result;
use crate::monitor::Monitor;
use bth_cache::Key;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::time::Instant;

/// A step of the compilation, with its inputs and options. The result depends on these alone: not
/// on files, clocks, terminals, the cache or the number of threads.
pub(crate) trait Stage: Sized {
    /// The result, with a report if there is one.
    type Output;
    /// Name in the report of times.
    const NAME: &'static str;
    /// Version of the results; part of all keys of what is made from them. Raise it when results
    /// change: `tests/versions.rs` fails otherwise.
    const VERSION: &'static str;

    /// Runs the stage.
    fn run(self, monitor: &dyn Monitor) -> Result<Self::Output>;
}

/// A stage whose results the cache keeps: a value, and a report as JSON.
pub(crate) trait CachedStage<T, R>: Stage<Output = (T, R)>
where
    R: Serialize + DeserializeOwned,
{
    /// All that the result depends on.
    fn key(&self) -> Key;

    /// The bytes of a value.
    fn encode(value: &T) -> Vec<u8>;

    /// The value from its bytes; `None` if they do not fit the inputs.
    fn decode(&self, bytes: &[u8]) -> Option<T>;
}

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
    /// Runs a part of a stage and adds its time to the stage's time.
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
