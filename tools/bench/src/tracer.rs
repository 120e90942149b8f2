//! The interface of all tracers, ours and rivals: batches of rays.

use bth::rays::{Hit, Ray, Start};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Rays to trace.
#[derive(Clone, Copy, Debug)]
pub struct Batch<'a> {
    /// The rays, model space.
    pub rays: &'a [Ray],
    /// Where each ray starts on the surface, in sets that start at hits.
    pub starts: Option<&'a [Start]>,
    /// Whether neighbouring rays have similar origins and directions; Embree takes this as a flag.
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

/// Traces rays through one model. The time of a tracer includes converting our rays into its own and its hits into ours.
pub trait Tracer: Send + Sync {
    /// Nearest hit of every ray; the instance in a surface is 0.
    fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit]);
    /// Whether anything lies within [tmin, tmax] of every ray.
    fn any(&self, batch: Batch<'_>, found: &mut [bool]);
    /// What it does with the starts of rays.
    fn starting(&self) -> Starting {
        Starting::AtOrigin
    }
}

/// What a tracer does with the starts of rays. A tracer that uses them is measured only on sets that have them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Starting {
    /// Ignores them: rays start at their origins, and may hit the triangle that they start on.
    AtOrigin,
    /// As `AtOrigin`, with a filter that rejects the triangle on which a ray starts.
    RejectOwn,
    /// Rays start at the exact points.
    OnSurface,
}

/// A tracer that is measured.
pub struct Contender {
    /// Its name in tables and charts.
    pub name: String,
    /// Whether it is one of ours, whose answers have to be the same to the last bit.
    pub ours: bool,
    /// Traces the rays.
    pub tracer: Box<dyn Tracer>,
    /// Wall-clock seconds to compile or build the structure.
    pub build_s: f64,
    /// Bytes that traversal reads, where that is known.
    pub bytes: Option<u64>,
}

impl Contender {
    /// Nearest hits, so many times over on so many threads.
    pub fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit], threads: usize, passes: usize) {
        spread_passes(batch, hits, (threads, passes), BLOCK, |batch, hits| self.tracer.nearest(batch, hits));
    }

    /// Any hits, so many times over on so many threads.
    pub fn any(&self, batch: Batch<'_>, found: &mut [bool], threads: usize, passes: usize) {
        spread_passes(batch, found, (threads, passes), BLOCK, |batch, found| self.tracer.any(batch, found));
    }
}

/// Rays that a thread takes at a time.
pub const BLOCK: usize = 4096;

/// Calls `trace` for blocks of so many rays, from so many threads, each of which takes the next block.
pub fn spread<T: Send>(
    batch: Batch<'_>,
    answers: &mut [T],
    threads: usize,
    block: usize,
    trace: impl Fn(Batch<'_>, &mut [T]) + Sync,
) {
    spread_passes(batch, answers, (threads, 1), block, trace);
}

/// As [`spread`], so many times over the whole batch. The threads start once: starting them takes as long as thousands of rays.
fn spread_passes<T: Send>(
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
