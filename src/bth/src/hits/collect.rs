//! Collectors: what queries keep of the hits that are found.

use crate::rays::Hit;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// A hit with its t before it is rounded.
#[derive(Clone, Copy, Debug)]
pub(super) struct FoundHit {
    /// As it is reported; t in world space.
    pub(super) hit: Hit,
    /// t in the space of the object, not rounded to f32. It is compared only in the same instance.
    pub(super) t: f64,
    /// t in world space of a ray in f64, within 2^-40; 0 for others.
    pub(super) wide_t: f64,
}

impl FoundHit {
    /// Max reported t of hits that may be nearer.
    fn limit(&self) -> f32 {
        if self.wide_t == 0.0 { self.hit.t } else { self.hit.t.next_up() }
    }
}

/// Hits are ordered by the t of rays in f64, then by the reported t, then by instance, then by t
/// before rounding, then by triangle. The first hit is the result of
/// [`Scene::nearest`](crate::Scene::nearest).
impl Ord for FoundHit {
    fn cmp(&self, other: &FoundHit) -> Ordering {
        // The additions turn -0.0 to 0.0; no t is NaN.
        let (a, b) = (&self.hit, &other.hit);
        self.wide_t
            .total_cmp(&other.wide_t)
            .then((a.t + 0.0).total_cmp(&(b.t + 0.0)))
            .then(a.primitive.instance.cmp(&b.primitive.instance))
            .then((self.t + 0.0).total_cmp(&(other.t + 0.0)))
            .then(a.primitive.triangle.cmp(&b.primitive.triangle))
    }
}

impl PartialOrd for FoundHit {
    fn partial_cmp(&self, other: &FoundHit) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for FoundHit {
    fn eq(&self, other: &FoundHit) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for FoundHit {}

/// What a query keeps of the hits of a ray.
pub(super) trait Collector {
    /// Max reported t of hits that can still change the result.
    fn limit(&self) -> f32 {
        f32::INFINITY
    }
    /// Returns true if a hit would change the result.
    fn wants(&self, _found: &FoundHit) -> bool {
        true
    }
    /// Takes a hit that it wants and that is accepted. Returns true if the result is complete.
    fn take(&mut self, found: FoundHit) -> bool;
}

/// True if there is a hit.
#[derive(Default)]
pub(super) struct AnyFound(pub(super) bool);

impl Collector for AnyFound {
    fn take(&mut self, _: FoundHit) -> bool {
        self.0 = true;
        true
    }
}

/// The number of hits.
#[derive(Default)]
pub(super) struct HitCount(pub(super) usize);

impl Collector for HitCount {
    fn take(&mut self, _: FoundHit) -> bool {
        self.0 += 1;
        false
    }
}

/// All hits, in no particular order.
impl Collector for Vec<FoundHit> {
    fn take(&mut self, found: FoundHit) -> bool {
        self.push(found);
        false
    }
}

/// The nearest hit.
#[derive(Default)]
pub(super) struct FirstHit(pub(super) Option<FoundHit>);

impl Collector for FirstHit {
    fn limit(&self) -> f32 {
        self.0.map_or(f32::INFINITY, |best| best.limit())
    }
    fn wants(&self, found: &FoundHit) -> bool {
        self.0.is_none_or(|best| *found < best)
    }
    fn take(&mut self, found: FoundHit) -> bool {
        self.0 = Some(found);
        false
    }
}

/// The `count` nearest hits; `count` is not 0.
pub(super) struct FirstHits {
    pub(super) count: usize,
    /// The nearest hits so far, the farthest of them on top.
    pub(super) hits: BinaryHeap<FoundHit>,
}

impl Collector for FirstHits {
    fn limit(&self) -> f32 {
        let farthest = self.hits.peek().filter(|_| self.hits.len() >= self.count);
        farthest.map_or(f32::INFINITY, FoundHit::limit)
    }
    fn wants(&self, found: &FoundHit) -> bool {
        self.hits.len() < self.count || self.hits.peek().is_none_or(|farthest| found < farthest)
    }
    fn take(&mut self, found: FoundHit) -> bool {
        if self.hits.len() >= self.count {
            self.hits.pop();
        }
        self.hits.push(found);
        false
    }
}
