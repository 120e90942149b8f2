//! A pool of jobs that share threads and memory.

use super::compile::Job;
use crate::args::Compile;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};

/// Memory of a compilation, as a multiple of its source file (measured: 8 for text, 14 for binary meshes)...
const MEMORY_PER_BYTE: u64 = 16;
/// ...and in any case, with the worker for tetrahedra.
const MEMORY_AT_LEAST: u64 = 64 << 20;

/// Runs the jobs, several at once; results in the order of the jobs. `work` gets the threads for a job.
///
/// Each job has a pool of threads of its own: in a common one a job that waits for another process to finish the same
/// work could hold up one that it waits for.
pub(super) fn run<T: Send>(args: &Compile, jobs: &[Job], work: impl Fn(&Job, usize) -> T + Sync) -> Vec<T> {
    let threads = match args.threads {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        n => n,
    };
    let at_once = args.jobs.jobs.map_or(threads, |n| n as usize).clamp(1, jobs.len().max(1));
    let memory = Memory::new(args.jobs.memory.map_or(u64::MAX, |mib| mib.saturating_mul(1 << 20)));
    let next = AtomicUsize::new(0);
    let results: Vec<Mutex<Option<T>>> = jobs.iter().map(|_| Mutex::new(None)).collect();
    std::thread::scope(|scope| {
        for _ in 0..at_once {
            scope.spawn(|| {
                while let Some((job, result)) =
                    jobs.iter().zip(&results).nth(next.fetch_add(1, Ordering::Relaxed))
                {
                    let _share = memory.take(estimate(job));
                    let done = work(job, (threads / at_once).max(1));
                    *result.lock().unwrap_or_else(PoisonError::into_inner) = Some(done);
                }
            });
        }
    });
    let take = |result: Mutex<Option<T>>| result.into_inner().unwrap_or_else(PoisonError::into_inner);
    results.into_iter().map(take).map(|done| done.expect("every job has run")).collect()
}

fn estimate(job: &Job) -> u64 {
    let size = std::fs::metadata(&job.model).map_or(0, |m| m.len());
    size.saturating_mul(MEMORY_PER_BYTE).saturating_add(MEMORY_AT_LEAST)
}

/// Memory that is taken before a job and given back after it.
struct Memory {
    limit: u64,
    taken: Mutex<u64>,
    given_back: Condvar,
}

struct Share<'a>(&'a Memory, u64);

impl Memory {
    fn new(limit: u64) -> Self {
        Self { limit, taken: Mutex::new(0), given_back: Condvar::new() }
    }

    /// Waits until there is enough, or nobody else has any.
    fn take(&self, bytes: u64) -> Share<'_> {
        let taken = self.taken.lock().unwrap_or_else(PoisonError::into_inner);
        let too_much = |taken: &mut u64| *taken > 0 && taken.saturating_add(bytes) > self.limit;
        let mut taken = self.given_back.wait_while(taken, too_much).unwrap_or_else(PoisonError::into_inner);
        *taken = taken.saturating_add(bytes);
        Share(self, bytes)
    }
}

impl Drop for Share<'_> {
    fn drop(&mut self) {
        let mut taken = self.0.taken.lock().unwrap_or_else(PoisonError::into_inner);
        *taken = taken.saturating_sub(self.1);
        self.0.given_back.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicU64;

    #[test]
    fn memory_is_shared_and_one_job_always_runs() {
        let memory = Memory::new(100);
        let (now, most) = (AtomicU64::new(0), AtomicU64::new(0));
        std::thread::scope(|scope| {
            for bytes in [40, 60, 30, 500, 70, 20, 100, 10] {
                let (memory, now, most) = (&memory, &now, &most);
                scope.spawn(move || {
                    let share = memory.take(bytes);
                    let sum = now.fetch_add(bytes, Ordering::SeqCst) + bytes;
                    if bytes == 500 {
                        assert_eq!(sum, 500, "alone");
                    } else {
                        most.fetch_max(sum, Ordering::SeqCst);
                    }
                    std::thread::sleep(std::time::Duration::from_millis(5));
                    now.fetch_sub(bytes, Ordering::SeqCst);
                    drop(share);
                });
            }
        });
        assert!(most.load(Ordering::SeqCst) <= 100);
    }
}
