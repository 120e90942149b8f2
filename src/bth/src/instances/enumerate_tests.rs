//! The two ways to enumerate instances, compared.

use super::super::test_worlds::{FILES, rays, world};
use super::*;
use bth_format::File;
use bth_random::Rng;

#[test]
fn instances_are_enumerated_in_the_same_order_in_trees_of_any_depth() {
    let mut rng = Rng::new(17);
    let mut visited = 0;
    for case in 0..60 {
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
                (ended, order)
            };
            let expected = by(true);
            assert_eq!(by(false), expected, "case {case}: {ray:?}");
            visited += expected.1.len();
        }
    }
    assert!(visited > 3000, "{visited} visits");
}
