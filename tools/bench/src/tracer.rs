//! The interface of all tracers, ours and rivals: batches of rays.

use bth::rays::{Hit, Ray, Start};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Rays to trace.
#[derive(Clone, Copy, Debug)]
pub struct Batch<'a> {
    /// The rays, model space.
    pub rays: &'a [Ray],
    /// The point of the surface at which each ray starts, in sets that start at hits.
    pub starts: Option<&'a [Start]>,
    /// True if neighbouring rays have similar origins and directions; Embree takes this as a flag.
    pub coherent: bool,
}

impl<'a> Batch<'a> {
    /// The batch in pieces of at most `most` rays.
    pub fn chunks(self, most: usize) -> impl Iterator<Item = Batch<'a>> {
        (0..self.rays.len()).step_by(most).map(move |first| {
            let part = first..self.rays.len().min(first + most);
            Batch { rays: &self.rays[part.clone()], starts: self.starts.map(|s| &s[part]), ..self }
        })
    }
}

/// Traces rays through one model. The time of a tracer includes converting our rays into its own
/// and its hits into ours.
pub trait Tracer: Send + Sync {
    /// Nearest hit of every ray; the instance in a surface is 0.
    fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit]);
    /// Sets true for each ray that hits something within [tmin, tmax].
    fn any(&self, batch: Batch<'_>, found: &mut [bool]);
    /// Says how it uses the starts of rays.
    fn starting(&self) -> Starting {
        Starting::AtOrigin
    }
}

/// How a tracer uses the starts of rays. One that uses them is measured only on sets that have
/// them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Starting {
    /// Ignores them: rays start at their origins, and may hit the triangle that they start on.
    AtOrigin,
    /// The same with rays in f64: of hits at an exactly equal t the smallest id wins. Rays of f32
    /// compare t rounded to f64.
    InF64,
    /// Rays start at their origins, with a filter that rejects the triangle on which a ray starts.
    RejectOwn,
    /// Rays start at the exact points.
    OnSurface,
}

/// The answers to a set of rays.
#[derive(Clone, Debug, PartialEq)]
pub enum Answers {
    /// Nearest hits.
    Nearest(Vec<Hit>),
    /// True for each ray that hits something.
    Any(Vec<bool>),
}

impl Answers {
    /// Room for answers to `count` rays.
    pub fn empty(any: bool, count: usize) -> Answers {
        if any { Answers::Any(vec![false; count]) } else { Answers::Nearest(vec![Hit::MISS; count]) }
    }

    /// Traces rays on this thread.
    pub fn trace(&mut self, tracer: &dyn Tracer, batch: Batch<'_>) {
        match self {
            Answers::Nearest(hits) => tracer.nearest(batch, hits),
            Answers::Any(found) => tracer.any(batch, found),
        }
    }

    /// Counts answers that differ from these: for ours in any bit, for rivals in hit or miss.
    pub fn differences(&self, found: &Answers, ours: bool) -> usize {
        let bits = |h: &Hit| ([h.t, h.u, h.v].map(f32::to_bits), h.primitive);
        match (self, found) {
            (Answers::Any(expected), Answers::Any(found)) => {
                expected.iter().zip(found).filter(|(a, b)| a != b).count()
            }
            (Answers::Nearest(expected), Answers::Nearest(hits)) => {
                let same =
                    |a: &Hit, b: &Hit| if ours { bits(a) == bits(b) } else { a.is_hit() == b.is_hit() };
                expected.iter().zip(hits).filter(|(a, b)| !same(a, b)).count()
            }
            _ => 0,
        }
    }
}

/// A tracer that is measured.
pub struct Contender {
    /// Its name in tables and charts.
    pub name: String,
    /// True for ours, whose answers must be the same to the last bit.
    pub ours: bool,
    /// Traces the rays.
    pub tracer: Box<dyn Tracer>,
    /// Wall-clock seconds to compile or build the structure.
    pub build_s: f64,
    /// Bytes that traversal reads, if known.
    pub bytes: Option<u64>,
}

impl Contender {
    /// A rival, built in `build_s` seconds.
    pub fn rival(name: &str, tracer: impl Tracer + 'static, build_s: f64, bytes: Option<u64>) -> Contender {
        Contender { name: name.to_owned(), ours: false, tracer: Box::new(tracer), build_s, bytes }
    }

    /// Traces all rays `passes` times on `threads` threads.
    pub fn trace(&self, batch: Batch<'_>, answers: &mut Answers, threads: usize, passes: usize) {
        let tracer = &self.tracer;
        match answers {
            Answers::Nearest(hits) => {
                spread(batch, hits, (threads, passes), BLOCK, |batch, hits| tracer.nearest(batch, hits));
            }
            Answers::Any(found) => {
                spread(batch, found, (threads, passes), BLOCK, |batch, found| tracer.any(batch, found));
            }
        }
    }
}

/// Rays that a thread takes at a time.
pub const BLOCK: usize = 4096;

/// Traces all rays `passes` times, in blocks of `block` rays. Each of `threads` threads takes the
/// next block. They start once: starting them takes as long as thousands of rays.
pub fn spread<T: Send>(
    batch: Batch<'_>,
    answers: &mut [T],
    (threads, passes): (usize, usize),
    block: usize,
    trace: impl Fn(Batch<'_>, &mut [T]) + Sync,
) {
    if threads <= 1 {
        return (0..passes).for_each(|_| trace(batch, answers));
    }
    let blocks: Vec<_> = batch.chunks(block).zip(answers.chunks_mut(block).map(Mutex::new)).collect();
    let taken = AtomicUsize::new(0);
    let next = || {
        let k = taken.fetch_add(1, Ordering::Relaxed);
        (k < passes * blocks.len()).then(|| &blocks[k % blocks.len()])
    };
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let Some((batch, answers)) = next() {
                    trace(*batch, &mut answers.lock().expect("no thread panics while it holds the lock"));
                }
            });
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use bth::rays::PrimitiveRef;

    #[test]
    fn wrong_answers_are_counted_to_the_last_bit_for_ours() {
        let hit = Hit { t: 1.0, u: 0.25, v: 0.5, primitive: PrimitiveRef { instance: 0, triangle: 7 } };
        let nudged = Hit { u: 0.25f32.next_up(), ..hit };
        let expected = Answers::Nearest(vec![hit, hit, Hit::MISS, Hit::MISS]);
        let found = Answers::Nearest(vec![hit, nudged, Hit::MISS, hit]);
        assert_eq!([true, false].map(|ours| expected.differences(&found, ours)), [2, 1]);
        let [expected, found] = [[true, false], [true, true]].map(|any| Answers::Any(any.to_vec()));
        assert_eq!(expected.differences(&found, false), 1);
    }
}
