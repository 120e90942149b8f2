//! How long a frame takes before its first ray: tracks, hierarchy, instances and top level, on one
//! thread.
//!
//!     cargo run --release -p bth-tests --example top_level
#![allow(clippy::print_stdout)]

use std::time::Instant;

fn main() {
    println!(
        "instances  tracks      median       least   instances and top level   hierarchy (bytes an instance)"
    );
    for (count, repeats) in [(101, 2001), (1_000, 501), (10_000, 101), (100_000, 31)] {
        for own_tracks in [false, true] {
            let mut world = bth::from_bytes(&bth_tests::crowd::crowd(count, own_tracks)).unwrap();
            let mut seconds: Vec<f64> = (0..repeats)
                .map(|frame| {
                    let start = Instant::now();
                    let update = world.set_frame(frame + 1).unwrap();
                    let taken = start.elapsed().as_secs_f64();
                    assert_eq!(update.placed, count as usize);
                    taken
                })
                .collect();
            seconds.sort_by(f64::total_cmp);
            let (instances, hierarchy) = world.heap_bytes();
            println!(
                "{count:>9}  {:>6}  {:>7.1} µs  {:>7.1} µs   {:>23.0}   {:>9.0}",
                if own_tracks { "each" } else { "root" },
                1e6 * seconds[seconds.len() / 2],
                1e6 * seconds[0],
                instances as f64 / f64::from(count),
                hierarchy as f64 / f64::from(count),
            );
        }
    }
}
