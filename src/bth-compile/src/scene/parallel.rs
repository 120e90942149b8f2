//! Runs the parts of a scene in parallel, limited by threads and memory.

use super::context::Context;
use crate::error::Result;
use crate::jobs;
use crate::monitor::Monitor;
use crate::pipeline::Clock;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Runs `work` on all items, at most as many at a time as there are threads and as fit in memory by the `estimate` in
/// bytes. Fails with the first failure in the order of the items.
pub(super) fn run_parallel<J: Send, T: Send>(
    items: Vec<J>,
    context: &Context<'_>,
    clock: &mut Clock,
    estimate: impl Fn(&J) -> u64 + Sync,
    work: impl Fn(&Context<'_>, &mut Clock, J) -> Result<T> + Sync,
) -> Result<Vec<T>> {
    let threads = rayon::current_num_threads().min(items.len());
    let without_stages = WithoutStages(context.monitor);
    let context = context.with_monitor(&without_stages);
    let failed = AtomicUsize::new(usize::MAX);
    let one = |(place, item): (usize, J)| {
        let mut clock = Clock::default();
        if failed.load(Ordering::Relaxed) < place {
            return (clock, None);
        }
        let done = work(&context, &mut clock, item);
        if done.is_err() {
            failed.fetch_min(place, Ordering::Relaxed);
        }
        (clock, Some(done))
    };
    let memory = context.options.objects_memory;
    let items = items.into_iter().enumerate().collect();
    let within = |worker: &(dyn Fn() + Sync)| match own_pool(threads) {
        Some(pool) => pool.install(worker),
        None => worker(),
    };
    let done = jobs::run(items, threads, memory, |(_, item)| estimate(item), within, one);
    let results = done.into_iter().filter_map(|(times, result)| {
        clock.add(times);
        result
    });
    results.collect()
}

/// A pool of one thread for one item at a time; `None` where a single item runs at a time. In the shared pool an item that
/// waits for another process could block the item that
/// this process waits for.
fn own_pool(threads: usize) -> Option<rayon::ThreadPool> {
    let pool = || rayon::ThreadPoolBuilder::new().num_threads(1).build();
    // If no pool can be made, the work runs in the global pool, which only uses more threads.
    (threads > 1).then(pool)?.ok()
}

/// A monitor for one of several items, which shows no stages.
struct WithoutStages<'a>(&'a dyn Monitor);

impl Monitor for WithoutStages<'_> {
    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
    fn warn(&self, message: &str) {
        self.0.warn(message);
    }
    fn notice(&self, message: &str) {
        self.0.notice(message);
    }
}
