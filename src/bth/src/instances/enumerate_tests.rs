//! Enumerated instances, compared with plain tests of all boxes.

use super::super::test_worlds::{FILES, rays, world};
use super::super::top_nodes::InstanceBounds;
use super::*;
use crate::bvh::box_oracle;
use crate::intersect::vector::wide;
use bth_format::File;
use bth_random::Rng;
use std::collections::BTreeSet;

fn ends(bounds: &InstanceBounds) -> [[f32; 3]; 2] {
    let ([x, y, z, _], [to_x, to_y, to_z, _]) = (bounds.lower.to_array(), bounds.upper.to_array());
    [[-x, -y, -z], [to_x, to_y, to_z]]
}

/// The t at which a ray enters a box, by plain arithmetic.
fn entry(ray: &Ray, [lower, upper]: [[f32; 3]; 2]) -> f64 {
    (0..3).fold(f64::from(ray.tmin), |entry, k| {
        let [a, b] = [lower[k], upper[k]]
            .map(|plane| (f64::from(plane) - f64::from(ray.origin[k])) / f64::from(ray.direction[k]));
        entry.max(a.min(b))
    })
}

/// The world boxes of the visible instances.
fn boxes(world: &World) -> Vec<(u32, [[f32; 3]; 2])> {
    let visible = world.placements.iter().zip(0..).filter(|(placement, _)| placement.is_some());
    visible.map(|(_, i)| (i, ends(&world.top.bounds_of(&world.placement(i).row_box())))).collect()
}

#[test]
fn rays_visit_every_box_that_they_meet_in_order_until_they_end() {
    let mut rng = Rng::new(17);
    let (mut visited, mut missed, mut pairs, mut wrong_pairs, mut ends) = (0, 0, 0, 0, 0);
    for case in 0..120 {
        let file = File::from_bytes(FILES[case % 2]).unwrap();
        let (world, transforms) = world(&file, &mut rng, [2, 17, 40, 300][case % 4]);
        let boxes = boxes(&world);
        for ray in rays(&mut rng, &transforms, 20).iter().filter(|ray| ray.tmin <= ray.tmax) {
            // Hits are found in some of the instances, and shorten the ray; some end it.
            let (shorten, end) = (rng.below(3), rng.below(40) as usize);
            let (mut order, mut tmax) = (Vec::new(), ray.tmax);
            let ended = world.enumerate(ray, &mut |instance: u32| {
                order.push(instance);
                if order.len() % 4 < shorten as usize && tmax > 0.0 {
                    tmax = if tmax.is_finite() { tmax * 0.7 } else { 1e6 };
                }
                (order.len() != end).then_some(tmax)
            });
            assert_eq!(ended, order.len() == end && end > 0, "case {case}: {ray:?}");
            let has_line = ray.origin.iter().chain(&ray.direction).all(|x| x.is_finite())
                && ray.direction.iter().any(|x| *x != 0.0);
            let set: BTreeSet<u32> = order.iter().copied().collect();
            assert_eq!(set.len(), order.len(), "case {case}: {ray:?}");
            for (instance, [lower, upper]) in &boxes {
                let meets = box_oracle::meets(&Ray { tmax, ..*ray }, *lower, *upper, 0.0);
                assert!(
                    ended || !has_line || !meets || set.contains(instance),
                    "case {case}: {instance}, {ray:?}"
                );
                missed += usize::from(!meets);
            }
            let entry_of = |i: u32| entry(ray, boxes.iter().find(|(at, _)| *at == i).unwrap().1);
            for pair in order.windows(2) {
                pairs += 1;
                wrong_pairs += usize::from(entry_of(pair[0]) > entry_of(pair[1]) * 1.0001);
            }
            visited += order.len();
            ends += usize::from(ended);
        }
    }
    assert!(visited > 5000 && missed > 5000 && ends > 50, "{visited} visits, {missed} missed, {ends} ended");
    // The children of a node come in order, but a node after a nearer one may hold nearer
    // instances.
    assert!(wrong_pairs * 4 < pairs && pairs > 1000, "{wrong_pairs} of {pairs} pairs are not in order");
}

#[test]
fn points_and_boxes_visit_every_instance_within_reach_and_few_others() {
    let mut rng = Rng::new(23);
    let (mut near, mut visited, mut all) = (0, 0, 0);
    for case in 0..60 {
        let file = File::from_bytes(FILES[case % 2]).unwrap();
        let (world, transforms) = world(&file, &mut rng, [2, 17, 40, 300][case % 4]);
        let boxes = boxes(&world);
        for ray in rays(&mut rng, &transforms, 20) {
            let (point, size) = (ray.origin, ray.direction[0].abs().min(1e3));
            if !point.iter().all(|x| x.is_finite()) {
                continue;
            }
            let outside = |[lower, upper]: &[[f32; 3]; 2]| {
                [0, 1, 2].map(|k| f64::from(lower[k] - point[k]).max(f64::from(point[k] - upper[k])).max(0.0))
            };
            let region = [point.map(|x| x - size), point.map(|x| x + size)];
            let (mut of_point, mut of_box) = (BTreeSet::new(), BTreeSet::new());
            let squared = f64::from(size).powi(2);
            assert!(!world.enumerate_near(point, squared, &mut |i| {
                assert!(of_point.insert(i));
                Some(squared)
            }));
            assert!(!world.enumerate_in_box(region.map(wide), &mut |i| !of_box.insert(i)));
            for (instance, bounds) in &boxes {
                let away = outside(bounds);
                let is_near = away.iter().map(|x| x * x).sum::<f64>() < squared * 0.9999;
                assert!(!is_near || of_point.contains(instance), "case {case}: {instance}, {point:?}");
                let [lower, upper] = bounds;
                let overlaps = (0..3).all(|k| lower[k] <= region[1][k] && region[0][k] <= upper[k]);
                assert!(!overlaps || of_box.contains(instance), "case {case}: {instance}, {region:?}");
                near += usize::from(is_near) + usize::from(overlaps);
            }
            visited += of_point.len() + of_box.len();
            all += 2 * boxes.len();
        }
    }
    assert!(near > 1000 && visited < near + near / 10, "{visited} visits, {near} near, {all} instances");
}
