//! Times of the queries for several hits and with conditions, compared with the nearest hit and any
//! hit, one ray a call.
//!
//!     cargo run --release -p bth --example hits -- MODEL.bth…
#![allow(clippy::print_stdout)]

use bth::rays::{Hit, Ray};
use bth::{Accept, Cull, Scene};
use bth_random::Rng;
use std::hint::black_box;
use std::time::Instant;

/// Rays between random points around the first instance.
fn rays(scene: &Scene, count: usize) -> Vec<Ray> {
    let (lower, upper) = scene.instance_bounds(0).expect("something visible");
    let mut rng = Rng::new(1);
    let mut point = |margin: f32| {
        [0, 1, 2].map(|k| {
            let (middle, size) = (0.5 * (lower[k] + upper[k]), upper[k] - lower[k]);
            middle + size * margin * (rng.unit_f32() - 0.5)
        })
    };
    let mut ray = || {
        let (origin, target) = (point(1.5), point(1.0));
        let direction = [0, 1, 2].map(|k| target[k] - origin[k]);
        Ray::new(origin, direction)
    };
    (0..count).map(|_| ray()).collect()
}

/// Nanoseconds a ray in the fastest of several rounds, and a sum of results.
fn time(rays: &[Ray], mut query: impl FnMut(&Ray) -> usize) -> (f64, usize) {
    let round = |query: &mut dyn FnMut(&Ray) -> usize| {
        let start = Instant::now();
        let sum = rays.iter().map(|ray| black_box(query(black_box(ray)))).sum();
        (start.elapsed().as_secs_f64() * 1e9 / rays.len() as f64, sum)
    };
    (0..7).map(|_| round(&mut query)).min_by(|a, b| a.0.total_cmp(&b.0)).expect("rounds")
}

fn main() {
    let accept_all = |_: &Ray, _: &Hit| true;
    let everything = Accept::default();
    let filtered = Accept { filter: Some(&accept_all), ..everything };
    let front = Accept { cull: Cull::Back, ..everything };
    for path in std::env::args().skip(1) {
        let scene = bth::open(&path).unwrap_or_else(|e| panic!("{e}"));
        let rays = rays(&scene, 100_000);
        let mut hits = Vec::new();
        let one = |hit: Option<Hit>| usize::from(hit.is_some());
        println!("{path}");
        let print = |name: &str, (nanoseconds, sum)| println!("  {name:<34} {nanoseconds:>8.0} ns  {sum:>8}");
        print("nearest", time(&rays, |ray| one(scene.nearest(ray))));
        print(
            "nearest_accepted, everything",
            time(&rays, |ray| one(scene.nearest_accepted(ray, &everything))),
        );
        print("nearest_accepted, filter", time(&rays, |ray| one(scene.nearest_accepted(ray, &filtered))));
        print("nearest_accepted, front faces", time(&rays, |ray| one(scene.nearest_accepted(ray, &front))));
        print("any", time(&rays, |ray| usize::from(scene.any(ray))));
        print("any_accepted, filter", time(&rays, |ray| usize::from(scene.any_accepted(ray, &filtered))));
        let mut first = |k| {
            time(&rays, |ray| {
                scene.nearest_hits(ray, k, &everything, &mut hits);
                hits.len()
            })
        };
        print("nearest_hits, 1", first(1));
        print("nearest_hits, 4", first(4));
        print("count_hits", time(&rays, |ray| scene.count_hits(ray, &everything)));
        let mut all = |ray: &Ray| {
            scene.all_hits(ray, &everything, &mut hits);
            hits.len()
        };
        print("all_hits", time(&rays, &mut all));
    }
}
