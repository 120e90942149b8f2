//! The visits of instances by rays that are to be traced next, sorted by instance.

use crate::query::sink::Visit;
use crate::simd::{LANES, Simd};

/// Several visits of one instance that follow each other.
#[derive(Clone, Copy)]
struct VisitRun {
    instance: u32,
    count: u32,
}

/// Visits, and their order by instance and by object.
#[derive(Default)]
pub(super) struct VisitQueue {
    /// Visits in the order in which they were queued.
    pub(super) all: Vec<Visit>,
    /// The runs that `all` begins with.
    runs: Vec<VisitRun>,
    /// The same visits in the order of the instances.
    pub(super) sorted: Vec<Visit>,
    /// Runs of `sorted` through instances that few rays visit: the object in the upper half, the
    /// first visit in the lower.
    pub(super) short_runs: Vec<u64>,
    /// The visits of several such runs with the same object.
    pub(super) gathered: Vec<Visit>,
    /// For each instance the index in `sorted` of its next visit.
    next: Vec<u32>,
    /// Instances and rays of few visits, as numbers that are sorted.
    keys: Vec<u64>,
}

impl VisitQueue {
    pub(super) fn clear(&mut self) {
        self.all.clear();
        self.runs.clear();
    }

    /// Queues visits of an instance by up to 64 rays, one bit per ray from the index `first` on.
    /// Must come before any single visits.
    #[inline(always)]
    pub(super) fn push_run<S: Simd>(&mut self, s: S, first: u32, rays: u64, instance: u32) {
        const ROW: [u32; LANES] = {
            let mut row = [0; LANES];
            let mut i = 0;
            while i < LANES {
                row[i] = i as u32;
                i += 1;
            }
            row
        };
        let mut count = self.all.len();
        self.all.resize(count + 64, Visit { ray: 0, instance: 0 });
        let mut index = s.add_u(s.load_u(&ROW), s.splat_u(first));
        let mut rest = rays;
        while rest != 0 {
            let mut rays = [0; LANES];
            let found = s.compress(rest as u32 & 0xffff, index, &mut rays);
            let to: &mut [Visit; LANES] =
                self.all[count..].first_chunk_mut().expect("there is room for all rays");
            for (to, ray) in to.iter_mut().zip(rays) {
                *to = Visit { ray, instance };
            }
            count += found;
            rest >>= LANES;
            index = s.add_u(index, s.splat_u(LANES as u32));
        }
        self.all.truncate(count);
        self.runs.push(VisitRun { instance, count: rays.count_ones() });
    }

    /// Fills `sorted` with all visits, by instance and then by ray: a counting sort, or for few
    /// visits a comparison sort.
    pub(super) fn sort(&mut self, instances: usize) {
        let VisitQueue { all, runs, sorted, next, keys, .. } = self;
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
        let mut in_runs = 0;
        for run in &*runs {
            next[run.instance as usize] += run.count;
            in_runs += run.count as usize;
        }
        let (in_runs, single) = all.split_at(in_runs);
        for visit in single {
            next[visit.instance as usize] += 1;
        }
        let mut total = 0;
        for count in &mut *next {
            total += std::mem::replace(count, total);
        }
        sorted.resize(all.len(), Visit { ray: 0, instance: 0 });
        let mut rest = in_runs;
        for run in runs {
            let index = &mut next[run.instance as usize];
            let visits;
            (visits, rest) = rest.split_at(run.count as usize);
            sorted[*index as usize..][..visits.len()].copy_from_slice(visits);
            *index += run.count;
        }
        for visit in single {
            let index = &mut next[visit.instance as usize];
            sorted[*index as usize] = *visit;
            *index += 1;
        }
    }
}
