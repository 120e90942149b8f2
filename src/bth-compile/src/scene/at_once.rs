//! The parts of a scene, as many at once as there are threads and memory.

use super::compile::Context;
use crate::error::Result;
use crate::jobs;
use crate::monitor::Monitor;
use crate::pipeline::Clock;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Does the same with all items, as many at once as there are threads and as `estimate` allows in bytes. The first failure
/// in the order of the items, if there is one.
pub(super) fn at_once<J: Send, T: Send>(
    items: Vec<J>,
    context: &Context<'_>,
    clock: &mut Clock,
    estimate: impl Fn(&J) -> u64 + Sync,
    work: impl Fn(&Context<'_>, &mut Clock, J) -> Result<T> + Sync,
) -> Result<Vec<T>> {
    let threads = rayon::current_num_threads().min(items.len());
    let quiet = Quiet(context.monitor);
    let context = context.with_monitor(&quiet);
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
    let within = |worker: &(dyn Fn() + Sync)| match alone(threads) {
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

/// A pool of one thread: what runs there takes no other. In the pool of all, an item that waits for another process
/// could hold up one that it waits for.
fn alone(threads: usize) -> Option<rayon::ThreadPool> {
    let pool = || rayon::ThreadPoolBuilder::new().num_threads(1).build();
    // Without one the work goes to the global pool, which only takes more threads.
    (threads > 1).then(pool)?.ok()
}

/// Watches one of several: shows no stages.
struct Quiet<'a>(&'a dyn Monitor);

impl Monitor for Quiet<'_> {
    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
    fn warn(&self, message: &str) {
        self.0.warn(message);
    }
}
