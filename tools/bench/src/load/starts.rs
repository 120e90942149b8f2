//! Runs every way to start, each time in a new process, in interleaved rounds.

use super::probe::{Start, StartTimes};
use crate::output::progress;
use crate::report::{Report, Subject};
use crate::rounds::median;
use anyhow::{Context, Result, ensure};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::Command;

/// How much of a file is in memory when a process starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PageCache {
    /// Nothing: the system dropped its pages.
    Cold,
    /// All of it: it was just read.
    Warm,
}

impl PageCache {
    pub(super) const ALL: [PageCache; 2] = [PageCache::Warm, PageCache::Cold];

    /// Brings a file into this state.
    fn prepare(self, path: &Path) -> Result<()> {
        match self {
            PageCache::Warm => std::fs::read(path).map(drop)?,
            PageCache::Cold => drop_pages(&File::open(path)?)?,
        }
        Ok(())
    }
}

#[cfg(target_os = "linux")]
fn drop_pages(file: &File) -> Result<()> {
    Ok(rustix::fs::fadvise(file, 0, None, rustix::fs::Advice::DontNeed)?)
}

#[cfg(not(target_os = "linux"))]
fn drop_pages(_: &File) -> Result<()> {
    anyhow::bail!("dropping a file's pages from memory needs Linux")
}

/// A way to start.
#[derive(Clone, Debug)]
pub(super) struct StartCase {
    /// Its name in tables.
    pub(super) name: String,
    /// True if it opens a file; false if Embree builds.
    pub(super) ours: bool,
    /// How the program starts.
    pub(super) start: Start,
    /// The state of the page cache before the start.
    pub(super) cache: PageCache,
    /// The file that it reads.
    pub(super) file: PathBuf,
}

/// What all starts of one model or scene share.
pub(super) struct StartRounds<'a> {
    /// The model or scene.
    pub(super) name: &'a str,
    /// The ways to start.
    pub(super) cases: &'a [StartCase],
    pub(super) rounds: usize,
    /// The file of the rays.
    pub(super) rays: &'a Path,
}

impl StartRounds<'_> {
    /// Measures all cases on `threads` threads.
    pub(super) fn run(&self, threads: usize, report: &mut Report) -> Result<()> {
        let mut taken = vec![Vec::new(); self.cases.len()];
        for round in 0..=self.rounds {
            for (case, taken) in self.cases.iter().zip(&mut taken) {
                progress(format!("{}: {}, {threads} thread(s), round {round}", self.name, case.name));
                case.cache.prepare(&case.file)?;
                let probed =
                    self.start(case, threads, &report.head.isa).with_context(|| case.name.clone())?;
                // The first round brings programs and libraries into the page cache and does not
                // count.
                if round > 0 {
                    taken.push(probed);
                }
            }
        }
        let hits: Vec<usize> = taken.iter().flatten().map(|p| p.hits).collect();
        ensure!(
            hits.iter().all(|h| h.abs_diff(hits[0]) * 100 <= hits[0]),
            "starts disagree on the number of rays that hit: {hits:?}"
        );
        for (case, taken) in self.cases.iter().zip(taken) {
            self.add(case, threads, &taken, report);
        }
        Ok(())
    }

    /// Adds the medians of a case.
    fn add(&self, case: &StartCase, threads: usize, taken: &[StartTimes], report: &mut Report) {
        let of = Subject { engine: &case.name, ours: case.ours, model: self.name, threads };
        for (i, set) in ["ready", "first hit", "total", "CPU"].into_iter().enumerate() {
            let figure = |t: &StartTimes| [t.ready_s, t.first_hit_s, t.total_s, t.cpu_s][i];
            if let Some(seconds) = median(taken.iter().map(figure).collect()) {
                report.add(&of, set, 1e3 * seconds, "ms");
            }
        }
        let storage: Option<Vec<f64>> = taken.iter().map(|t| Some(t.storage_bytes? as f64)).collect();
        if let Some(bytes) = storage.and_then(median) {
            report.add(&of, "storage", bytes / 1048576.0, "MiB");
        }
    }

    /// Starts once, in a separate process.
    fn start(&self, case: &StartCase, threads: usize, isa: &str) -> Result<StartTimes> {
        let mut command = Command::new(std::env::current_exe()?);
        command.args(["probe", "--start", &case.start.name(), "--isa", isa]);
        command.args(["--threads", &threads.to_string()]);
        let output = command.arg(&case.file).arg(self.rays).output()?;
        ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr).trim());
        Ok(serde_json::from_slice(&output.stdout)?)
    }
}
