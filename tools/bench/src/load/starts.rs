//! Runs every way to start, each time in a new process, in interleaved rounds.

use super::probe::StartTimes;
use super::results::{StartCase, StartsRun, Times};
use crate::args::Starts;
use crate::progress::Progress;
use anyhow::{Context, Result, ensure};
use std::path::Path;
use std::process::Command;

/// Everything that the starts of one model or scene share.
pub(super) struct StartRounds<'a> {
    /// The model or scene, for progress.
    pub(super) name: &'a str,
    /// The ways to start.
    pub(super) cases: &'a [StartCase],
    /// Rounds and numbers of threads.
    pub(super) starts: &'a Starts,
    /// How many of the rays are the first ones; all if absent.
    pub(super) first: Option<usize>,
    /// Vector instructions of our kernels.
    pub(super) isa: &'a str,
    /// The file of the rays.
    pub(super) rays: &'a Path,
}

impl StartRounds<'_> {
    /// Medians of all cases, for each number of threads.
    ///
    /// # Errors
    /// If a start fails, or the starts disagree by more than 1 % on how many rays hit.
    pub(super) fn run(&self, progress: &Progress) -> Result<Vec<StartsRun>> {
        self.starts.threads.iter().map(|&threads| self.on_threads(threads, progress)).collect()
    }

    fn on_threads(&self, threads: usize, progress: &Progress) -> Result<StartsRun> {
        let mut taken = vec![Vec::new(); self.cases.len()];
        for round in 0..=self.starts.rounds {
            for (case, taken) in self.cases.iter().zip(&mut taken) {
                progress.show(format!("{}: {}, {threads} thread(s), round {round}", self.name, case.name));
                case.cache.prepare(&case.file)?;
                let probed = self.start(case, threads).with_context(|| case.name.clone())?;
                // The first round brings programs and libraries into the page cache and does not count.
                if round > 0 {
                    taken.push(probed);
                }
            }
        }
        let hits: Vec<usize> = taken.iter().flatten().map(|p| p.hits).collect();
        ensure!(
            hits.iter().all(|h| h.abs_diff(hits[0]) * 100 <= hits[0]),
            "starts disagree on how many rays hit: {hits:?}"
        );
        let times = self.cases.iter().zip(taken);
        let times = times.map(|(case, taken)| (case.name.clone(), Times::medians(&taken)));
        Ok(StartsRun { threads, starts: times.collect() })
    }

    /// One start, in a process of its own.
    fn start(&self, case: &StartCase, threads: usize) -> Result<StartTimes> {
        let mut command = Command::new(std::env::current_exe()?);
        command.args(["probe", "--start", case.start.name()]);
        command.args(["--threads", &threads.to_string(), "--isa", self.isa]);
        command.args(self.first.map(|n| format!("--first={n}")));
        let output = command.arg(&case.file).arg(self.rays).output()?;
        ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr).trim());
        Ok(serde_json::from_slice(&output.stdout)?)
    }
}
