//! Several jobs at once: how many threads and how much memory each gets.

use super::job::Job;
use crate::args::Compile;
use bth_compile::jobs;

/// Estimated memory of a compilation, as a multiple of the size of its source file (measured: 8 for
/// text, 14 for binary meshes).
const MEMORY_PER_BYTE: u64 = 16;
/// Memory of a compilation in addition, with the worker for tetrahedra.
const MEMORY_AT_LEAST: u64 = 64 << 20;

/// Threads of all jobs together.
fn threads(args: &Compile) -> usize {
    match args.threads {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        n => n,
    }
}

/// The number of jobs that run at once.
fn at_once(args: &Compile, jobs: usize) -> usize {
    args.jobs.jobs.map_or(threads(args), |n| n as usize).clamp(1, jobs.max(1))
}

/// Bytes that all jobs may take together.
fn memory(args: &Compile) -> u64 {
    args.jobs.memory.map_or_else(bth_format::memory::available, |mib| mib.saturating_mul(1 << 20))
}

/// Bytes that the objects of one of `jobs` jobs may take, if it is a scene.
pub(super) fn memory_of_objects(args: &Compile, jobs: usize) -> u64 {
    match memory(args) {
        u64::MAX => u64::MAX,
        bytes => bytes / at_once(args, jobs) as u64,
    }
}

/// Runs the jobs, several at once; the results are in the order of the jobs. `work` gets the number
/// of threads of a job.
pub(super) fn run<T: Send>(args: &Compile, all: &[Job], work: impl Fn(&Job, usize) -> T + Sync) -> Vec<T> {
    let at_once = at_once(args, all.len());
    let share = (threads(args) / at_once).max(1);
    jobs::run(
        all.iter().collect(),
        at_once,
        memory(args),
        |job| estimate(job),
        |worker| worker(),
        |job| work(job, share),
    )
}

fn estimate(job: &Job) -> u64 {
    let size = std::fs::metadata(&job.model).map_or(0, |m| m.len());
    size.saturating_mul(MEMORY_PER_BYTE).saturating_add(MEMORY_AT_LEAST)
}
