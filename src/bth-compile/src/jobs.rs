//! A pool of jobs that share threads and memory.
//!
//! Jobs run on separate threads, not in the shared pool of rayon, where a job that waits for
//! another process could block the job for which that process waits.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};

/// Runs the jobs, at most `parallel` at a time. The jobs that run together need at most `memory`
/// bytes by the `estimate`; a job that needs more runs alone. Results are in the order of the jobs.
/// Where the system starts fewer threads, fewer jobs run at a time.
///
/// `within` runs the work of each thread, for example in a separate pool.
pub fn run<J: Send, T: Send>(
    jobs: Vec<J>,
    parallel: usize,
    memory: u64,
    estimate: impl Fn(&J) -> u64 + Sync,
    within: impl Fn(&(dyn Fn() + Sync)) + Sync,
    work: impl Fn(J) -> T + Sync,
) -> Vec<T> {
    let memory = Memory::new(memory);
    let next = AtomicUsize::new(0);
    let parallel = parallel.clamp(1, jobs.len().max(1));
    let places: Vec<Mutex<(Option<J>, Option<T>)>> =
        jobs.into_iter().map(|job| Mutex::new((Some(job), None))).collect();
    let lock = |place: usize| Some(places.get(place)?.lock().unwrap_or_else(PoisonError::into_inner));
    let worker = || {
        loop {
            let place = next.fetch_add(1, Ordering::Relaxed);
            let Some(mut taken) = lock(place) else { break };
            let Some(job) = taken.0.take() else { break };
            drop(taken);
            let _share = memory.take(estimate(&job));
            let done = work(job);
            if let Some(mut taken) = lock(place) {
                taken.1 = Some(done);
            }
        }
    };
    if parallel == 1 {
        within(&worker);
    } else {
        std::thread::scope(|scope| {
            let start = |_| std::thread::Builder::new().spawn_scoped(scope, || within(&worker)).is_ok();
            let started = (0..parallel).take_while(|&n| start(n)).count();
            if started == 0 {
                within(&worker);
            }
        });
    }
    let result =
        |place: Mutex<(Option<J>, Option<T>)>| place.into_inner().unwrap_or_else(PoisonError::into_inner).1;
    places.into_iter().map(|place| result(place).expect("every job has run")).collect()
}

/// Memory that jobs reserve before they start and release when they end.
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

    /// Waits until there is enough memory, or no other job has reserved any.
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
        let (now, most) = (AtomicU64::new(0), AtomicU64::new(0));
        let jobs = vec![40, 60, 30, 500, 70, 20, 100, 10];
        let work = |bytes: u64| {
            let sum = now.fetch_add(bytes, Ordering::SeqCst) + bytes;
            if bytes == 500 {
                assert_eq!(sum, 500, "alone");
            } else {
                most.fetch_max(sum, Ordering::SeqCst);
            }
            std::thread::sleep(std::time::Duration::from_millis(5));
            now.fetch_sub(bytes, Ordering::SeqCst);
            bytes
        };
        assert_eq!(run(jobs.clone(), 8, 100, |bytes| *bytes, |worker| worker(), work), jobs);
        assert!(most.load(Ordering::SeqCst) <= 100);
    }

    /// Runs itself again in a process in which no thread has the memory for its stack.
    #[test]
    fn jobs_run_where_no_thread_can_be_started() {
        const VARIABLE: &str = "BTH_TEST_NO_THREADS";
        if std::env::var_os(VARIABLE).is_some() {
            assert!(std::thread::Builder::new().spawn(|| ()).is_err());
            let done = run((0..20u64).collect(), 4, u64::MAX, |_| 1, |worker| worker(), |n| n + 1);
            return assert_eq!(done, (1..21).collect::<Vec<_>>());
        }
        let mut again = std::process::Command::new(std::env::current_exe().unwrap());
        again.args(["--exact", "jobs::tests::jobs_run_where_no_thread_can_be_started", "--test-threads=1"]);
        let done = again.env(VARIABLE, "1").env("RUST_MIN_STACK", (1u64 << 47).to_string()).output().unwrap();
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stdout));
    }

    #[test]
    fn results_are_in_order_for_every_number_of_threads() {
        for parallel in [0, 1, 3, 100] {
            let started = AtomicUsize::new(0);
            let within = |worker: &(dyn Fn() + Sync)| {
                started.fetch_add(1, Ordering::Relaxed);
                worker();
            };
            let squares = run((0..20u64).collect(), parallel, u64::MAX, |_| 1, within, |n| n * n);
            assert_eq!(squares, (0..20).map(|n| n * n).collect::<Vec<_>>());
            assert_eq!(started.into_inner(), parallel.clamp(1, 20));
        }
        assert!(run(Vec::<u8>::new(), 4, 0, |_| 0, |worker| worker(), |n| n).is_empty());
    }
}
