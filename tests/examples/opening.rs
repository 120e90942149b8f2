//! How long mapped scenes take until they can be traced and until something has moved, and how fast
//! random rays through them are, on one thread.
//!
//!     cargo run --release -p bth-tests --example opening -- FILE.bth...
#![allow(clippy::print_stdout)]

use bth::rays::{Hit, Ray};
use bth_random::Rng;
use std::time::Instant;

/// Calls a function a few times; returns the milliseconds of the fastest call, and its last result.
fn fastest<T>(times: usize, mut call: impl FnMut() -> T) -> (f64, T) {
    let mut least = f64::INFINITY;
    let mut result = None;
    for _ in 0..times {
        let start = Instant::now();
        let made = call();
        least = least.min(1e3 * start.elapsed().as_secs_f64());
        result = Some(made);
    }
    (least, result.expect("at least one call"))
}

fn main() {
    for path in std::env::args().skip(1) {
        // SAFETY: whoever runs this leaves the file alone.
        #[allow(unsafe_code)]
        let (opening, mut scene) = fastest(9, || unsafe { bth::map(&path) }.unwrap());
        let (instances, source) = scene.heap_bytes();
        println!("{path}: {} instances in {} rows", scene.instance_count(), scene.row_count());
        println!("  opened in {opening:.3} ms, then {} bytes on the heap", instances + source);
        let mut seconds = scene.seconds();
        let mut first = None;
        let (moving, placed) = fastest(9, || {
            seconds += 0.05;
            let start = Instant::now();
            let update = scene.set_seconds(seconds).unwrap();
            first.get_or_insert(1e3 * start.elapsed().as_secs_f64());
            update.placed
        });
        println!("  moved in {moving:.3} ms, first {:.3} ms: {placed} rows", first.unwrap_or_default());
        let (lower, upper) = scene.bounds().expect("something visible");
        let mut rng = Rng::new(1);
        let mut point = || [0, 1, 2].map(|k| lower[k] + (upper[k] - lower[k]) * rng.unit_f32());
        let rays: Vec<Ray> = (0..100_000)
            .map(|_| {
                let (from, to) = (point(), point());
                Ray::new(from, [0, 1, 2].map(|k| to[k] - from[k]))
            })
            .collect();
        let mut hits = vec![Hit::MISS; rays.len()];
        let (cold, ()) = fastest(1, || scene.batch(&rays).nearest(&mut hits));
        let (warm, ()) = fastest(5, || scene.batch(&rays).nearest(&mut hits));
        let share = hits.iter().filter(|hit| hit.is_hit()).count() as f64 / rays.len() as f64;
        let nanoseconds = |time: f64| 1e6 * time / rays.len() as f64;
        let (instances, source) = scene.heap_bytes();
        println!(
            "  {:.0} ns a random ray, first {:.0} ns; {share:.3} hit; then {} bytes on the heap",
            nanoseconds(warm),
            nanoseconds(cold),
            instances + source
        );
    }
}
