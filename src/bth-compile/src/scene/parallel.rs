//! Runs the parts of a scene in parallel, limited by threads and memory.

use super::context::Context;
use crate::error::Result;
use crate::jobs;
use crate::monitor::Monitor;
use crate::stage::Clock;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Runs `work` on all items, at most as many at a time as there are threads and as fit in memory by
/// the `estimate` in bytes. Fails with the first failure in the order of the items, and warns in
/// that order, whichever item is ready first.
pub(super) fn run_parallel<J: Send, T: Send>(
    items: Vec<J>,
    context: &Context<'_>,
    clock: &mut Clock,
    estimate: impl Fn(&J) -> u64 + Sync,
    work: impl Fn(&Context<'_>, &mut Clock, J) -> Result<T> + Sync,
) -> Result<Vec<T>> {
    let threads = rayon::current_num_threads().min(items.len());
    let failed = AtomicUsize::new(usize::MAX);
    let one = |(place, item): (usize, J)| {
        let mut clock = Clock::default();
        let monitor = OfItem { to: context.monitor, warnings: Mutex::default() };
        if failed.load(Ordering::Relaxed) < place {
            return (clock, monitor.warnings, None);
        }
        let done = work(&context.with_monitor(&monitor), &mut clock, item);
        if done.is_err() {
            failed.fetch_min(place, Ordering::Relaxed);
        }
        (clock, monitor.warnings, Some(done))
    };
    let memory = context.options.objects_memory;
    let items = items.into_iter().enumerate().collect();
    let within = |worker: &(dyn Fn() + Sync)| match own_pool(threads) {
        Some(pool) => pool.install(worker),
        None => worker(),
    };
    let done = jobs::run(items, threads, memory, |(_, item)| estimate(item), within, one);
    let results = done.into_iter().filter_map(|(times, warnings, result)| {
        clock.add(times);
        let warnings = warnings.into_inner().unwrap_or_else(PoisonError::into_inner);
        warnings.iter().for_each(|message| context.monitor.warn(message));
        result
    });
    results.collect()
}

/// A pool of one thread for one item at a time; `None` where a single item runs at a time. In the
/// shared pool an item that waits for another process could block the item that this process waits
/// for.
fn own_pool(threads: usize) -> Option<rayon::ThreadPool> {
    let pool = || rayon::ThreadPoolBuilder::new().num_threads(1).build();
    // If no pool can be made, the work runs in the global pool, which only uses more threads.
    (threads > 1).then(pool)?.ok()
}

/// A monitor for one of several items, which shows no stages and keeps warnings.
struct OfItem<'a> {
    to: &'a dyn Monitor,
    warnings: Mutex<Vec<String>>,
}

impl Monitor for OfItem<'_> {
    fn cancelled(&self) -> bool {
        self.to.cancelled()
    }
    fn warn(&self, message: &str) {
        self.warnings.lock().unwrap_or_else(PoisonError::into_inner).push(message.to_owned());
    }
    fn notice(&self, message: &str) {
        self.to.notice(message);
    }
}
