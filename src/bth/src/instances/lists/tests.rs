//! Lists of instances, compared with the enumeration for one ray.

use super::*;
use crate::instances::test_worlds::{FILES, rays, world};
use crate::instances::top_level::TopLevel;
use crate::rays::{Hit, Ray};
use crate::simd::{Isa, Kernel};
use bth_format::File;
use bth_random::Rng;
use std::collections::BTreeSet;

/// The rays and what their lists say.
struct ListKernel<'a> {
    top: &'a TopLevel,
    rays: &'a [Ray],
    /// Nearest hits that are found after the first visits.
    hits: &'a [Hit],
}

/// What the lists of rays say.
#[derive(Default)]
struct ListResult {
    /// The instance that each ray visits at once, the nearest, and those later on.
    nearest: Vec<Visit>,
    later: Vec<Visit>,
    /// The rays that have no list, and those that go on behind their list.
    without: BTreeSet<u32>,
    unfinished: BTreeSet<u32>,
    /// True if rays that reach many boxes have lists.
    lists_many: bool,
}

impl Kernel for ListKernel<'_> {
    type Output = ListResult;
    const SCALAR: bool = false;
    fn run<S: Simd>(self, s: S) -> ListResult {
        let ListKernel { top, rays, hits } = self;
        let mut lists = InstanceLists::default();
        let mut rest: Vec<u32> = (0..rays.len() as u32).collect();
        let mut found = ListResult::default();
        lists.start(s, &Chunk { top, rays, first: 0 }, &mut rest, &mut found.nearest);
        while !lists.active.is_empty() {
            lists.advance(BatchProgress::Nearest(hits), 0, &mut found.later);
            found.unfinished.extend(&lists.unfinished);
        }
        ListResult { without: rest.into_iter().collect(), lists_many: S::HAS_FAST_COMPRESS, ..found }
    }
}

fn of_ray(visits: &[Visit], ray: usize) -> Vec<u32> {
    visits.iter().filter(|visit| visit.ray as usize == ray).map(|visit| visit.instance).collect()
}

#[test]
fn rays_visit_what_is_enumerated_for_one_ray_or_are_not_listed() {
    let mut rng = Rng::new(29);
    let (mut listed, mut visits, mut shortened, mut many, mut ends) = (0, 0, 0, 0, 0);
    let mut all_listed = false;
    for case in 0..180 {
        let file = File::from_bytes(FILES[case % 2]).unwrap();
        let (world, transforms) = world(&file, &mut rng, [2, 17, 40, 300, 2000][case % 5]);
        let rays = rays(&mut rng, &transforms, 40);
        let nearest_t = |ray: &Ray, random: u64| match random % 3 {
            0 => f32::INFINITY,
            _ => ray.tmin.max(0.0) + (random % 1000) as f32 / 500.0 / ray.direction[0].abs().max(1e-20),
        };
        let hits: Vec<Hit> =
            rays.iter().map(|ray| Hit { t: nearest_t(ray, rng.next()), ..Hit::MISS }).collect();
        let kernel = ListKernel { top: &world.top, rays: &rays, hits: &hits };
        if Isa::chosen() == Isa::Scalar {
            return;
        }
        let ListResult { nearest, later, without, unfinished, lists_many } = Isa::chosen().run(kernel);
        assert!(lists_many || unfinished.is_empty(), "case {case}");
        all_listed |= lists_many;
        for (i, ray) in rays.iter().enumerate().filter(|(i, _)| !without.contains(&(*i as u32))) {
            let enumerated = |tmax: f32| {
                let mut all = BTreeSet::new();
                world.enumerate(&Ray { tmax, ..*ray }, &mut |instance| {
                    all.insert(instance);
                    Some(tmax)
                });
                all
            };
            let expected = enumerated(ray.tmax);
            let (first, rest) = (of_ray(&nearest, i), of_ray(&later, i));
            assert_eq!(first.is_empty(), expected.is_empty(), "case {case}: {ray:?}");
            assert!(ray.tmin >= 0.0 || first.is_empty(), "case {case}: {ray:?}");
            let mut visited: BTreeSet<u32> = first.iter().copied().collect();
            visited.extend(&rest);
            assert_eq!(visited.len(), first.len() + rest.len(), "case {case}: an instance is visited twice");
            assert!(visited.len() <= MAX_LISTED && first.len() < 2);
            assert!(visited.is_subset(&expected), "case {case}: {ray:?}");
            if unfinished.contains(&(i as u32)) {
                assert!(visited.len() == MAX_LISTED && visited != expected, "case {case}: {ray:?}");
                ends += 1;
                continue;
            }
            assert!(enumerated(ray.tmax.min(hits[i].t)).is_subset(&visited), "case {case}: {ray:?}");
            if hits[i].t >= ray.tmax && visited.len() < MAX_LISTED {
                assert_eq!(visited, expected, "case {case}: {ray:?}");
            }
            listed += 1;
            visits += visited.len();
            shortened += usize::from(visited.len() < expected.len());
            many += usize::from(expected.len() > 8);
        }
    }
    assert!(
        listed > 1000 && visits > 2000 && shortened > 100 && many > 50 && (ends > 50) == all_listed,
        "{listed}, {visits}, {shortened}, {many}, {ends}"
    );
}
