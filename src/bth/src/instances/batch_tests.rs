//! Tests of batches through instances. The oracle is a loop over all instances.

use super::super::exact_loop;
use super::super::placement::PartBoxes;
use super::super::test_worlds::{FILES, START_FILES, rays, unit, world};
use super::*;
use crate::hits::Accept;
use crate::instances::RayInInstance;
use crate::nodes::affine::Affine;
use crate::query::better;
use crate::rays::{PrimitiveRef, Ray, Start, StartRay};
use crate::scene::Scene;
use crate::start_points::place;
use crate::starts::world_ray::WorldRay;
use bth_format::File;
use bth_random::Rng;

/// Oracle: the nearest hit of a loop over all instances, without the top level.
fn nearest_by_loop(world: &World, objects: &Objects, ray: &Ray) -> Hit {
    let mut best = Hit::MISS;
    for (instance, placement) in world.placements.iter().enumerate() {
        let Some(placement) = placement else { continue };
        let instance = instance as u32;
        let of_instance = RayInInstance::new(
            world,
            objects,
            (instance, world.placement(instance)),
            WorldRay::plain(ray),
            ray.tmax,
        );
        let hit = object::nearest(objects.view(placement.object()), &of_instance, instance);
        best = better(ray, &best, &hit, of_instance.of_object.t_scale).unwrap_or(best);
    }
    best
}

/// The answers of a batch.
fn traced(world: &World, objects: &Objects, rays: &[Ray]) -> (Vec<Hit>, Vec<bool>) {
    let (mut hits, mut found) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
    world.nearest(objects, WorldRays { rays, starts: &[], wide: &[] }, &mut hits);
    world.any(objects, WorldRays { rays, starts: &[], wide: &[] }, &mut found);
    (hits, found)
}

#[test]
fn the_top_level_does_not_change_results() {
    let mut rng = Rng::new(11);
    let (mut hit_count, mut far_hits, mut ray_count) = (0, 0, 0);
    for case in 0..200 {
        let file = File::from_bytes(FILES[case % 2]).unwrap();
        let objects = Objects::of_file(file.clone());
        let count = [1, 2, 7, 16, 17, 40, 300][case % 7];
        let (world, transforms) = world(&file, &mut rng, count);
        let rays = rays(&mut rng, &transforms, 40);
        let (hits, found) = traced(&world, &objects, &rays);
        for (i, ray) in rays.iter().enumerate() {
            let expected = nearest_by_loop(&world, &objects, ray);
            assert_eq!(hits[i], expected, "case {case}, ray {i}: {ray:?}");
            assert_eq!(found[i], expected.is_hit(), "case {case}, ray {i}: {ray:?}");
            // What a single ray stored before does not matter.
            let mut alone = Hit { t: 0.0, ..expected };
            let world_ray = WorldRay::plain(ray);
            world.store_nearest_of_ray(&objects, world_ray, &mut alone);
            let any = world.any_of_ray(&objects, world_ray);
            assert_eq!((alone, any), (expected, expected.is_hit()), "case {case}, ray {i} alone: {ray:?}");
            if i % 8 == 0 {
                assert_eq!(world.nearest_counted(&objects, world_ray).0, expected);
            }
            let farthest = ray.origin.iter().fold(0.0f32, |m, x| m.max(x.abs()));
            far_hits += u32::from(expected.is_hit() && farthest > world.top.reach);
            hit_count += u32::from(expected.is_hit());
            ray_count += 1;
        }
    }
    assert!(
        hit_count > ray_count / 3 && far_hits > 150,
        "{hit_count} of {ray_count} hit, {far_hits} from afar"
    );
}

/// Oracle: the nearest hit of a ray that starts on an instance, of a loop over all instances.
fn nearest_start_by_loop(scene: &Scene, ray: &StartRay) -> Hit {
    let mut best = Hit::MISS;
    let Some(placed) = place(scene, ray) else { return best };
    let world = scene.world().expect("instances");
    for (instance, placement) in world.placements.iter().enumerate() {
        let Some(placement) = placement else { continue };
        let (instance, world_ray) = (instance as u32, placed.world_ray());
        let objects = scene.objects();
        let of_instance =
            RayInInstance::new(world, objects, (instance, world.placement(instance)), world_ray, ray.tmax);
        let hit = object::nearest(objects.view(placement.object()), &of_instance, instance);
        best = better(&placed.ray, &best, &hit, of_instance.of_object.t_scale).unwrap_or(best);
    }
    best
}

#[test]
fn starts_on_instances_have_the_hits_of_a_loop() {
    let mut rng = Rng::new(13);
    let (mut hit_count, mut ray_count, mut unusable) = (0, 0, 0);
    for case in 0..300 {
        let file = File::from_bytes(START_FILES[case % 2]).unwrap();
        let count = [1, 2, 7, 16, 17, 40, 300][case % 7];
        let (world, transforms) = world(&file, &mut rng, count);
        let scene = Scene::with_instances(file, world);
        let rays: Vec<StartRay> = rays(&mut rng, &transforms, [40, 300][case / 7 % 2])
            .into_iter()
            .map(|ray| {
                let (instance, triangle) = (rng.below(count as u64 + 1) as u32, rng.below(4) as u32);
                let [u, v] = [[0.0, 0.0], [0.3, 0.4], [0.5, 0.5], [0.0, 1.0]][rng.below(4) as usize];
                let start = Start { primitive: PrimitiveRef { instance, triangle }, u, v };
                start.ray(ray.direction).with_tmax(ray.tmax)
            })
            .collect();
        let (mut hits, mut found) = (vec![Hit { t: 7.0, ..Hit::MISS }; rays.len()], vec![true; rays.len()]);
        scene.batch(&rays).nearest(&mut hits);
        scene.batch(&rays).any(&mut found);
        for (i, ray) in rays.iter().enumerate() {
            let expected = nearest_start_by_loop(&scene, ray);
            let is_hit = expected.is_hit();
            assert_eq!((hits[i], found[i]), (expected, is_hit), "case {case}, ray {i}: {ray:?}");
            let alone = (scene.nearest(ray), scene.any(ray));
            assert_eq!(alone, (is_hit.then_some(expected), is_hit), "case {case}, ray {i} alone: {ray:?}");
            unusable += u32::from(scene.check_start(&ray.start).is_err());
            hit_count += u32::from(is_hit);
            ray_count += 1;
        }
    }
    assert!(
        hit_count > ray_count / 20 && unusable > 100 && unusable < ray_count * 3 / 4,
        "{hit_count} of {ray_count} hit, {unusable} unusable"
    );
}

#[test]
fn rays_that_are_not_finite_or_have_an_empty_range_hit_nothing() {
    let file = File::from_bytes(FILES[0]).unwrap();
    let objects = Objects::of_file(file.clone());
    let world = world(&file, &mut Rng::new(3), 50).0;
    let good = Ray { origin: [0.0; 3], tmin: 0.0, direction: [1.0; 3], tmax: 1.0 };
    for ray in [
        Ray { origin: [f32::NAN, 0.0, 0.0], ..good },
        Ray { direction: [0.0, -0.0, 0.0], ..good },
        Ray { direction: [f32::INFINITY, 0.0, 0.0], ..good },
        Ray { tmin: 2.0, ..good },
        Ray { tmax: f32::NAN, ..good },
        Ray { tmin: f32::NAN, ..good },
    ] {
        let (mut hit, mut found) = ([Hit::MISS], [false]);
        world.nearest(&objects, WorldRays { rays: &[ray], starts: &[], wide: &[] }, &mut hit);
        world.any(&objects, WorldRays { rays: &[ray], starts: &[], wide: &[] }, &mut found);
        assert_eq!((hit[0], found[0]), (Hit::MISS, false), "{ray:?}");
        (hit, found) = ([Hit { t: 1.0, ..Hit::MISS }], [true]);
        world.store_nearest_of_ray(&objects, WorldRay::plain(&ray), &mut hit[0]);
        found[0] = world.any_of_ray(&objects, WorldRay::plain(&ray));
        assert_eq!((hit[0], found[0]), (Hit::MISS, false), "{ray:?} alone");
    }
}

/// Coherent rays: of nearly the same direction, from points close to each other.
fn bundle(rng: &mut Rng, transforms: &[Affine], count: usize) -> Vec<Ray> {
    let transform = &transforms[rng.below(transforms.len() as u64) as usize];
    let target = transform.apply([0.3, 0.3, 0.0]);
    let distance = [0.5, 3.0, 30.0, 1e5][rng.below(4) as usize];
    let offset = [(); 3].map(|()| (0.2 + unit(rng).abs()) * distance * [1.0, -1.0][rng.below(2) as usize]);
    let (direction_spread, origin_spread) =
        ([0.0, 0.01, 0.05][rng.below(3) as usize], [0.0, 0.1][rng.below(2) as usize]);
    let scale = [1.0, 1e-3, 1e3, 1e-20][rng.below(4) as usize];
    let tmax = [f64::INFINITY, 1.0 / scale][rng.below(2) as usize] as f32;
    (0..count)
        .map(|_| {
            let origin = [0, 1, 2]
                .map(|k| (target[k] + offset[k] + unit(rng) * origin_spread * distance * 0.1) as f32);
            let direction =
                [0, 1, 2].map(|k| ((-offset[k] + unit(rng) * direction_spread * distance) * scale) as f32);
            Ray { origin, tmin: 0.0, direction, tmax }
        })
        .collect()
}

#[test]
fn packets_through_the_top_level_do_not_change_results() {
    let mut rng = Rng::new(23);
    let (mut in_packets, mut ray_count, mut hit_count, mut refused) = (0, 0, 0, 0);
    for case in 0..200 {
        let file = File::from_bytes(FILES[case % 2]).unwrap();
        let objects = Objects::of_file(file.clone());
        let count = [1, 7, 17, 40, 150][case % 5];
        let (world, transforms) = world(&file, &mut rng, count);
        let rays = bundle(&mut rng, &transforms, [33, 64, 100][case % 3]);
        let (mut hits, mut found) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
        world.nearest(&objects, WorldRays { rays: &rays, starts: &[], wide: &[] }, &mut hits);
        world.any(&objects, WorldRays { rays: &rays, starts: &[], wide: &[] }, &mut found);
        for (i, ray) in rays.iter().enumerate() {
            let expected = nearest_by_loop(&world, &objects, ray);
            assert_eq!(hits[i], expected, "case {case}, ray {i}: {ray:?}");
            assert_eq!(found[i], expected.is_hit(), "case {case}, ray {i}: {ray:?}");
            hit_count += usize::from(expected.is_hit());
        }
        let mut active_rays = ActiveRays::default();
        let chunk = Chunk { top: &world.top, rays: &rays, first: 0 };
        Isa::chosen().run(StartKernel { chunk, starts: &[], active_rays: &mut active_rays });
        in_packets += usize::from(!active_rays.packets.is_empty());
        refused += usize::from(active_rays.packets.is_empty() && count == 150);
        ray_count += rays.len();
    }
    // There are no packets in scalar code.
    let expected = if Isa::chosen() == Isa::Scalar { 0..=0 } else { 61..=200 };
    assert!(expected.contains(&in_packets), "{in_packets} of 200 cases in packets");
    assert!(hit_count > ray_count / 5 && refused > 2, "{hit_count} of {ray_count} hit, {refused} refused");
}

#[test]
fn a_single_instance_in_world_space_has_the_same_hits_with_and_without_the_top_level() {
    let mut rng = Rng::new(31);
    let (mut hit_count, mut ray_count) = (0, 0);
    for case in 0..60 {
        let file = File::from_bytes(FILES[case % 2]).unwrap();
        let objects = Objects::of_file(file.clone());
        let identity = Affine::IDENTITY;
        let object = rng.below(u64::from(file.object_count())) as u32;
        let parts = PartBoxes::whole(file.object_header(object), [0.0; 3]);
        let placement = Placement::new(&identity, object, file.object_header(object), &parts).unwrap();
        // The other instances are not visible.
        let (row, count) = (case % 5, [1, 3, 40, 64][case % 4]);
        let mut placements = vec![None; 5];
        placements[row] = Some(placement);
        let world = World::with_placements(placements.clone(), file.object_count());
        assert_eq!(world.sole(), Some((row as u32, object)));
        placements[(row + 1) % 5] = Some(placement);
        assert_eq!(World::with_placements(placements, file.object_count()).sole(), None);

        let rays = rays(&mut rng, &[identity], count);
        let (hits, found) = traced(&world, &objects, &rays);
        let scene = Scene::with_instances(file, world);
        let (mut sole_hits, mut sole_found) = (vec![Hit { t: 7.0, ..Hit::MISS }; count], vec![true; count]);
        scene.batch(&rays).nearest(&mut sole_hits);
        scene.batch(&rays).any(&mut sole_found);
        assert_eq!((&sole_hits, &sole_found), (&hits, &found), "case {case}: {rays:?}");
        assert_eq!(scene.nearest_counted(&rays[0]).0, hits[0]);
        assert_eq!(scene.touched_objects(), 1);
        hit_count += hits.iter().filter(|hit| hit.is_hit()).count();
        ray_count += count;
    }
    assert!(hit_count > ray_count / 4, "{hit_count} of {ray_count} hit");
}

/// Oracle: the hits of a ray in all instances and triangles, each decided exactly, in the
/// documented order.
fn hits_by_loop(world: &World, objects: &Objects, ray: &Ray) -> Vec<Hit> {
    let mut found = vec![];
    for (instance, placement) in world.placements.iter().enumerate() {
        let Some(placement) = placement else { continue };
        let object = objects.view(placement.object());
        exact_loop::add_hits(object, (world, objects), instance as u32, ray, &mut found);
    }
    exact_loop::in_order(found)
}

#[test]
fn several_hits_are_those_of_a_loop_over_all_instances_and_triangles() {
    let mut rng = Rng::new(41);
    let (mut hit_count, mut ray_count, mut far_hits, mut several) = (0, 0, 0, 0);
    for case in 0..300 {
        let file = File::from_bytes(FILES[case % 2]).unwrap();
        let count = [1, 2, 7, 16, 17, 40, 300][case % 7];
        let (world, transforms) = world(&file, &mut rng, count);
        let (reach, scene) = (world.top.reach, Scene::with_instances(file, world));
        let (world, objects) = (scene.world().expect("instances"), scene.objects());
        for ray in rays(&mut rng, &transforms, 20) {
            let expected = hits_by_loop(world, objects, &ray);
            let mut hits = vec![Hit::MISS];
            let all = |_: &Ray, _: &Hit| true;
            for accept in [Accept::default(), Accept { filter: Some(&all), ..Accept::default() }] {
                scene.all_hits(&ray, &accept, &mut hits);
                assert_eq!(hits, expected, "case {case}: {ray:?}");
                let first = expected.first().copied();
                assert_eq!(scene.nearest_accepted(&ray, &accept), first, "case {case}: {ray:?}");
                assert_eq!(scene.any_accepted(&ray, &accept), first.is_some(), "case {case}: {ray:?}");
            }
            let k = 1 + rng.below(4) as usize;
            scene.nearest_hits(&ray, k, &Accept::default(), &mut hits);
            assert_eq!(hits, expected[..k.min(expected.len())], "case {case}, {k}: {ray:?}");
            let start = ray.origin.iter().fold(0.0f32, |m, x| m.max(x.abs()));
            far_hits += u32::from(!expected.is_empty() && start > reach);
            several += u32::from(expected.len() > 1);
            hit_count += u32::from(!expected.is_empty());
            ray_count += 1;
        }
    }
    assert!(
        hit_count > ray_count / 3 && far_hits > 200 && several > 300,
        "{hit_count} of {ray_count} hit, {far_hits} from afar, {several} several times"
    );
}
