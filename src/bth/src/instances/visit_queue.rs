//! The visits of instances by rays that are to be traced next, sorted by instance.

use crate::query::sink::Visit;

/// Visits, and their order by instance and by object.
#[derive(Default)]
pub(super) struct VisitQueue {
    /// Visits in the order of the rays.
    pub(super) all: Vec<Visit>,
    /// The same visits in the order of the instances.
    pub(super) sorted: Vec<Visit>,
    /// Runs of `sorted` through instances that few rays visit: the object in the upper half, the first visit in the lower.
    pub(super) short_runs: Vec<u64>,
    /// The visits of several such runs with the same object.
    pub(super) gathered: Vec<Visit>,
    /// For each instance the index in `sorted` of its next visit.
    next: Vec<u32>,
    /// Instances and rays of few visits, as numbers that are sorted.
    keys: Vec<u64>,
}

impl VisitQueue {
    /// Fills `sorted` with all visits, by instance and then by ray: a counting sort, or for few visits a comparison sort.
    pub(super) fn sort(&mut self, instances: usize) {
        let VisitQueue { all, sorted, next, keys, .. } = self;
        sorted.clear();
        // Often all rays start on one instance, or few instances are left.
        if all.iter().all(|visit| visit.instance == all[0].instance) {
            sorted.extend_from_slice(all);
            return;
        }
        if instances > 4 * all.len() {
            keys.clear();
            keys.extend(all.iter().map(|v| u64::from(v.instance) << 32 | u64::from(v.ray)));
            keys.sort_unstable();
            sorted.extend(keys.iter().map(|&key| Visit { ray: key as u32, instance: (key >> 32) as u32 }));
            return;
        }
        next.clear();
        next.resize(instances, 0);
        for visit in &*all {
            next[visit.instance as usize] += 1;
        }
        let mut total = 0;
        for count in &mut *next {
            total += std::mem::replace(count, total);
        }
        sorted.resize(all.len(), Visit { ray: 0, instance: 0 });
        for visit in all {
            let index = &mut next[visit.instance as usize];
            sorted[*index as usize] = *visit;
            *index += 1;
        }
    }
}
