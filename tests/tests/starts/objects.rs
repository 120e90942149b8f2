//! Files of several objects without scene sections: each object is an instance in world space.

use crate::check::{check_isas, turn};
use bth::rays::{Hit, StartRay};
use bth_format::exact::is_zero_area;
use bth_random::Rng;
use bth_tests::meshes::mesh;
use bth_tests::oracle::World;
use bth_tests::placed_soup::soups;
use bth_tests::rays::{alone, starts};

#[test]
fn starts_on_one_of_several_objects_meet_the_others() {
    let _turn = turn();
    let mut of_others = 0;
    for seed in 0..8 {
        let rng = &mut Rng::new(seed);
        let lists: Vec<Vec<[[f32; 3]; 3]>> = [0, 1, 6]
            .into_iter()
            .map(|kind| {
                loop {
                    let model = mesh(kind, rng);
                    let all = (0..model.triangles.len()).map(|i| model.corners(i));
                    let triangles: Vec<_> = all.filter(|corners| !is_zero_area(*corners)).collect();
                    if !triangles.is_empty() {
                        return triangles;
                    }
                }
            })
            .collect();
        let leaves = |list: &Vec<_>| {
            let ids: Vec<u32> = (0..list.len() as u32).collect();
            ids.chunks(16).map(<[u32]>::to_vec).collect()
        };
        let objects: Vec<(&[_], _)> = lists.iter().map(|list| (&list[..], leaves(list))).collect();
        let scene = bth::from_bytes(&soups(&objects)).unwrap();
        assert_eq!((scene.object_count(), scene.instance_count()), (3, 3));
        let mut rays: Vec<StartRay> = Vec::new();
        for (instance, list) in (0..).zip(&lists) {
            let mut of = starts(list, 60, seed + u64::from(instance));
            of.iter_mut().for_each(|ray| ray.start.primitive.instance = instance);
            rays.extend(of);
        }
        let (expected, world) = (alone(&scene, &rays), World::new(&scene));
        for (ray, hit) in rays.iter().zip(&expected) {
            let truth = world.nearest(ray);
            let is_same = truth.as_ref().map_or(!hit.is_hit(), |truth| {
                let off = (f64::from(hit.t) - truth.t_f64()).abs();
                let is_known = truth.triangles.contains(&hit.primitive);
                hit.is_hit() && off <= truth.t_f64() * 1.01 / f64::from(1 << 24) && is_known
            });
            assert!(is_same, "seed {seed}: {ray:?}: {hit:?} {truth:?}");
            of_others += u32::from(hit.is_hit() && hit.primitive.instance != ray.start.primitive.instance);
        }
        let (mut all, everything) = (Vec::new(), bth::Accept::default());
        check_isas(&scene, &rays, &expected, &format!("seed {seed}"), &|ray, hit, context| {
            let mut hits: Vec<Hit> = Vec::new();
            scene.all_hits(ray, &everything, &mut hits);
            assert_eq!(hits.first().copied().unwrap_or(Hit::MISS), *hit, "{context}: {ray:?}");
        });
        scene.all_hits(&rays[0], &everything, &mut all);
    }
    assert!(of_others > 100, "{of_others}");
}
