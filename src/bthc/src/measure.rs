//! Measures the time of rays through compiled objects, on one thread.

use bth::Scene;
use bth::rays::{Hit, Ray};
use bth_compile::sampling::SampleRay;
use std::time::Duration;

/// Rays in one call of a batch.
const BATCH: usize = 1024;

/// Rays of one kind, as the library takes them.
#[derive(Clone, Debug)]
pub(crate) struct Rays(Vec<Ray>);

impl Rays {
    pub(crate) fn new(samples: &[SampleRay]) -> Rays {
        let ray = |s: &SampleRay| Ray {
            origin: s.origin.map(|x| x as f32),
            tmin: 0.0,
            direction: s.direction.map(|x| x as f32),
            tmax: s.tmax as f32,
        };
        Rays(samples.iter().map(ray).collect())
    }

    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }
}

/// How batches are traced.
#[derive(Clone, Copy, Debug)]
pub(crate) enum QueryKind {
    /// Nearest hits.
    Nearest,
    /// Any hits.
    Any,
}

/// A scene, the rays that are traced through it, and the kind of query.
pub(crate) type TimedRun<'a> = (&'a Scene, &'a Rays, QueryKind);

/// Rays of one turn; sets with fewer rays are repeated.
const TURN: usize = 16384;

/// Nanoseconds of a ray in each run: the minimum over the rounds, in which the runs take turns,
/// since other work of the machine can only add time. `None` if it was stopped.
pub(crate) fn nanoseconds(runs: &[TimedRun<'_>], rounds: usize, stop: impl Fn() -> bool) -> Option<Vec<f64>> {
    let mut least = vec![f64::INFINITY; runs.len()];
    for _ in 0..=rounds {
        for ((scene, rays, query), least) in runs.iter().zip(&mut least) {
            if stop() {
                return None;
            }
            for _ in 0..(TURN / rays.len().max(1)).max(1) {
                let seconds = once(scene, rays, *query);
                *least = least.min(1e9 * seconds / rays.len().max(1) as f64);
            }
        }
    }
    Some(least)
}

fn once(scene: &Scene, rays: &Rays, query: QueryKind) -> f64 {
    let (mut hits, mut found) = (vec![Hit::MISS; BATCH], vec![false; BATCH]);
    let start = thread_seconds();
    for batch in rays.0.chunks(BATCH) {
        match query {
            QueryKind::Nearest => scene.batch(batch).nearest(&mut hits[..batch.len()]),
            QueryKind::Any => scene.batch(batch).any(&mut found[..batch.len()]),
        }
    }
    std::hint::black_box((&hits, &found));
    thread_seconds() - start
}

/// CPU seconds of this thread, which exclude the time of other processes.
#[cfg(unix)]
fn thread_seconds() -> f64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    Duration::new(now.tv_sec as u64, now.tv_nsec as u32).as_secs_f64()
}

/// Seconds on the wall clock.
#[cfg(not(unix))]
fn thread_seconds() -> f64 {
    use std::sync::OnceLock;
    static START: OnceLock<std::time::Instant> = OnceLock::new();
    START.get_or_init(std::time::Instant::now).elapsed().as_secs_f64()
}
