//! Wall-clock times of the stages. Only the pipeline reads clocks; the stages themselves are functions of their input and their
//! options.

use crate::error::Result;
use crate::{bvh, costs, free, marks, tets};
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

/// The report of a stage, with the stage's wall-clock time.
pub(crate) trait StageReport {
    /// Where the time of the stage is stored, in seconds.
    fn seconds(&mut self) -> &mut f64;
}

impl StageReport for bvh::BvhReport {
    fn seconds(&mut self) -> &mut f64 {
        &mut self.seconds
    }
}

impl StageReport for marks::MarkReport {
    fn seconds(&mut self) -> &mut f64 {
        &mut self.seconds
    }
}

impl StageReport for costs::CostReport {
    fn seconds(&mut self) -> &mut f64 {
        &mut self.seconds
    }
}

impl StageReport for free::FreeReport {
    fn seconds(&mut self) -> &mut f64 {
        &mut self.seconds
    }
}

impl StageReport for tets::TetReport {
    fn seconds(&mut self) -> &mut f64 {
        &mut self.seconds
    }
}

impl StageReport for bvh::CollapseReport {
    fn seconds(&mut self) -> &mut f64 {
        &mut self.seconds
    }
}

/// Runs a stage and stores its wall-clock time in its report. A result that comes from the cache keeps the time of the run
/// that made it.
///
/// # Errors
/// Those of the stage.
pub(crate) fn timed<T, R: StageReport>(stage: impl FnOnce() -> Result<(T, R)>) -> Result<(T, R)> {
    let start = Instant::now();
    let (output, mut report) = stage()?;
    *report.seconds() = start.elapsed().as_secs_f64();
    Ok((output, report))
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
