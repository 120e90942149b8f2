//! Enumerated instances, compared with the slow traversal of a tree of any depth.

use super::super::test_worlds::{FILES, rays, world};
use super::super::top_nodes::Bounds;
use super::*;
use crate::simd::LANES;
use bth_format::File;
use bth_random::Rng;
use std::collections::BTreeSet;

/// The t at which a ray enters a box, by plain arithmetic.
fn entry(ray: &Ray, bounds: &Bounds) -> f64 {
    let (lower, upper) = (bounds.lower.to_array(), bounds.upper.to_array());
    (0..3).fold(f64::from(ray.tmin), |entry, k| {
        let [a, b] = [-lower[k], upper[k]]
            .map(|plane| (f64::from(plane) - f64::from(ray.origin[k])) / f64::from(ray.direction[k]));
        entry.max(a.min(b))
    })
}

#[test]
fn instances_are_enumerated_by_depth_or_as_in_trees_of_any_depth() {
    let mut rng = Rng::new(17);
    let (mut visited, mut listed, mut pairs, mut wrong_pairs, mut ends) = (0, 0, 0, 0, 0);
    for case in 0..120 {
        let file = File::from_bytes(FILES[case % 2]).unwrap();
        let (world, transforms) = world(&file, &mut rng, [2, 17, 40, 300][case % 4]);
        for ray in rays(&mut rng, &transforms, 20).iter().filter(|ray| ray.tmin <= ray.tmax) {
            // Hits are found in some of the instances, and shorten the ray; some end it.
            let (shorten, end) = (rng.below(3), rng.below(40) as usize);
            let by = |deep: bool| {
                let (mut order, mut tmax) = (Vec::new(), ray.tmax);
                let mut visit = |instance: u32| {
                    order.push(instance);
                    if order.len() % 4 < shorten as usize && tmax > 0.0 {
                        tmax = if tmax.is_finite() { tmax * 0.7 } else { 1e6 };
                    }
                    (order.len() != end).then_some(tmax)
                };
                let ended = match deep {
                    true => enumerate_deep(&world.top, ray, &mut visit),
                    false => world.enumerate(ray, &mut visit),
                };
                (ended, order, tmax)
            };
            let of_range = |tmax: f32| {
                let mut all = BTreeSet::new();
                enumerate_deep(&world.top, &Ray { tmax, ..*ray }, &mut |instance| {
                    all.insert(instance);
                    Some(tmax)
                });
                all
            };
            let (expected, found) = (by(true), by(false));
            visited += found.1.len();
            let (all, (ended, order, tmax)) = (of_range(ray.tmax), found);
            let has_list = Isa::chosen() == Isa::Avx512 && ray.tmin >= 0.0 && all.len() <= LANES;
            if !has_list {
                assert_eq!(
                    (ended, &order, tmax),
                    (expected.0, &expected.1, expected.2),
                    "case {case}: {ray:?}"
                );
                continue;
            }
            let set: BTreeSet<u32> = order.iter().copied().collect();
            assert!(set.len() == order.len() && set.is_subset(&all), "case {case}: {ray:?}");
            assert_eq!(ended, order.len() == end && end > 0, "case {case}: {ray:?}");
            assert!(ended || of_range(tmax).is_subset(&set), "case {case}: {ray:?}");
            if tmax == ray.tmax && !ended {
                assert_eq!(set, all, "case {case}: {ray:?}");
            }
            let entry_of = |instance: u32| entry(ray, &world.top.bounds_of(world.placement(instance)));
            for pair in order.windows(2) {
                pairs += 1;
                wrong_pairs += usize::from(entry_of(pair[0]) > entry_of(pair[1]) * 1.0001);
            }
            listed += 1;
            ends += usize::from(ended);
        }
    }
    if Isa::chosen() != Isa::Avx512 {
        return assert!(visited > 5000, "{visited} visits");
    }
    assert!(visited > 5000 && listed > 1000 && ends > 50, "{visited} visits, {listed} listed, {ends} ended");
    // The boxes are widened for rounding, by more where a ray leaves their planes at a small angle.
    assert!(wrong_pairs * 20 < pairs && pairs > 1000, "{wrong_pairs} of {pairs} pairs are not in order");
}
