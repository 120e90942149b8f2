//! Which ray goes through which instance next.

use crate::query::sink::Visit;

/// What rays are to be traced through.
#[derive(Default)]
pub(super) struct VisitQueue {
    /// In order of the rays.
    pub(super) all: Vec<Visit>,
    /// By instance.
    pub(super) sorted: Vec<Visit>,
    /// Runs of `sorted` through instances that few rays visit, with the object: that, first, end.
    pub(super) short_runs: Vec<[u32; 3]>,
    /// Those runs, one after the other.
    pub(super) gathered: Vec<Visit>,
    /// Where those of each instance go.
    place: Vec<u32>,
}

impl VisitQueue {
    /// Fills `sorted`: by instance, of one in order of the rays.
    pub(super) fn sort(&mut self, instances: usize) {
        let VisitQueue { all, sorted, place, .. } = self;
        sorted.clear();
        if instances > 4 * all.len() {
            sorted.extend_from_slice(all);
            sorted.sort_unstable_by_key(|v| (v.instance, v.ray));
            return;
        }
        place.clear();
        place.resize(instances, 0);
        for visit in &*all {
            place[visit.instance as usize] += 1;
        }
        let mut next = 0;
        for count in &mut *place {
            next += std::mem::replace(count, next);
        }
        sorted.resize(all.len(), Visit { ray: 0, instance: 0 });
        for visit in all {
            let at = &mut place[visit.instance as usize];
            sorted[*at as usize] = *visit;
            *at += 1;
        }
    }
}
