//! Tests of batches through instances, against a loop over all instances.

use super::super::affine::Affine;
use super::super::placement::Parts;
use super::*;
use crate::scene::Scene;
use bth_random::Rng;

const FILES: [&[u8]; 2] = [
    include_bytes!("../../../../format-spec/conformance/valid/two-objects.bth"),
    include_bytes!("../../../../format-spec/conformance/valid/two-levels.bth"),
];

fn unit(rng: &mut Rng) -> f64 {
    rng.below(1 << 30) as f64 / (1u64 << 29) as f64 - 1.0
}

/// Rigid, scaled, mirrored, sheared, and often on a coarse grid, so that rays meet edges exactly.
fn transform(rng: &mut Rng, spread: f64) -> Affine {
    let coarse = rng.below(3) == 0;
    let number = |rng: &mut Rng| if coarse { (unit(rng) * 2.0).round() } else { unit(rng) };
    let mut parts = [0.0; 10];
    parts.iter_mut().for_each(|x| *x = number(rng));
    parts[6] += 1.5;
    parts[7..].iter_mut().for_each(|x| *x += x.signum() * 0.01 + 0.02);
    parts[..3].iter_mut().for_each(|x| *x *= spread);
    let mut affine = Affine::from_parts(&parts);
    if rng.below(4) == 0 {
        let (row, column) = (rng.below(3) as usize, rng.below(3) as usize);
        affine.linear[row][column] += number(rng) * 50.0;
    }
    affine
}

fn world(file: &File, rng: &mut Rng, count: usize) -> (World, Vec<Affine>) {
    let spread = [0.0, 1.0, 4.0, 1e4][rng.below(4) as usize];
    let transforms: Vec<Affine> = (0..count).map(|_| transform(rng, spread)).collect();
    let place = |transform: &Affine, number: u64| {
        let number = (number % u64::from(file.object_count())) as u32;
        // Of every other one as closely as can be.
        let parts = match number % 2 {
            0 => Parts::of(&file.object(number).unwrap()),
            _ => Parts::whole(file.object_header(number)),
        };
        Placed::new(transform, number, file.object_header(number), &parts).ok()
    };
    let placed = transforms.iter().map(|t| place(t, rng.next()).filter(|_| rng.below(8) > 0)).collect();
    (World::of_places(placed, file.object_count()), transforms)
}

/// All instances, one after another, without the top level.
fn brute(world: &World, file: &File, ray: &Ray) -> Hit {
    let mut best = Hit::MISS;
    for (number, placed) in world.placed.iter().enumerate() {
        let Some(placed) = placed else { continue };
        let object = placed.inverse.ray(ray);
        let view = file.object(placed.object()).unwrap();
        let hit = object::nearest(&view, &object.ray, bth_format::layout::NONE, number as u32);
        best = better(ray, &best, &hit, object.t_scale).unwrap_or(best);
    }
    best
}

fn rays(rng: &mut Rng, transforms: &[Affine], count: usize) -> Vec<Ray> {
    let targets = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.0, 0.25, 0.0], [0.2, 0.3, 0.0]];
    (0..count)
        .map(|i| {
            let transform = &transforms[rng.below(transforms.len() as u64) as usize];
            let target = transform.apply(targets[rng.below(5) as usize]);
            // From close by to so far away that the boxes must be widened for the ray.
            let away = [0.0, 1.0, 10.0, 1e3, 1e5, 1e7, 1e12][rng.below(7) as usize];
            let mut origin = [0, 1, 2].map(|k| (target[k] + unit(rng) * away) as f32);
            if rng.below(3) == 0 {
                let k = rng.below(3) as usize;
                origin[k] = target[k] as f32;
            }
            let scale = [1.0, 1e-20, 1e15, 0.3][i % 4];
            let direction = [0, 1, 2].map(|k| ((target[k] - f64::from(origin[k])) * scale) as f32);
            let (tmin, tmax) = match rng.below(5) {
                0 => (0.0, (1.0 / scale) as f32),
                1 => ((1.0 / scale) as f32, f32::INFINITY),
                2 => (f32::NEG_INFINITY, f32::INFINITY),
                _ => (0.0, f32::INFINITY),
            };
            Ray { origin, tmin, direction, tmax }
        })
        .collect()
}

#[test]
fn the_top_level_and_hints_change_no_answer() {
    let mut rng = Rng::new(11);
    let (mut hits_seen, mut far_hits, mut all) = (0, 0, 0);
    for round in 0..600 {
        let file = File::from_bytes(FILES[round % 2]).unwrap();
        let count = [1, 2, 7, 16, 17, 40, 300][round % 7];
        let (world, transforms) = world(&file, &mut rng, count);
        let rays = rays(&mut rng, &transforms, 40);
        let from: Vec<Surface> = rays
            .iter()
            .map(|_| Surface { instance: rng.below(count as u64 + 2) as u32, triangle: rng.below(3) as u32 })
            .collect();
        for from in [None, Some(from.as_slice())] {
            let mut hits = vec![Hit::MISS; rays.len()];
            let mut found = vec![false; rays.len()];
            world.nearest(&file, &rays, from, &mut hits);
            world.any(&file, &rays, from, &mut found);
            for (i, ray) in rays.iter().enumerate() {
                let expected = brute(&world, &file, ray);
                assert_eq!(hits[i], expected, "round {round}, ray {i}: {ray:?}");
                assert_eq!(found[i], expected.is_hit(), "round {round}, ray {i}: {ray:?}");
                if i % 8 == 0 {
                    assert_eq!(world.nearest_counted(&file, ray, Surface::NONE).0, expected);
                }
                let start = ray.origin.iter().fold(0.0f32, |m, x| m.max(x.abs()));
                far_hits += u32::from(expected.is_hit() && start > world.top.reach);
                hits_seen += u32::from(expected.is_hit());
                all += 1;
            }
        }
    }
    assert!(hits_seen > all / 3 && far_hits > 500, "{hits_seen} of {all} hit, {far_hits} from afar");
}

#[test]
fn rays_without_a_line_hit_nothing() {
    let file = File::from_bytes(FILES[0]).unwrap();
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
        let (mut hit, mut found) = ([Hit::MISS], [true]);
        world.nearest(&file, &[ray], None, &mut hit);
        world.any(&file, &[ray], None, &mut found);
        assert_eq!((hit[0], found[0]), (Hit::MISS, false), "{ray:?}");
    }
}

/// Rays that go nearly the same way, from close together.
fn bundle(rng: &mut Rng, transforms: &[Affine], count: usize) -> Vec<Ray> {
    let transform = &transforms[rng.below(transforms.len() as u64) as usize];
    let target = transform.apply([0.3, 0.3, 0.0]);
    let away = [0.5, 3.0, 30.0, 1e5][rng.below(4) as usize];
    let from = [(); 3].map(|()| (0.2 + unit(rng).abs()) * away * [1.0, -1.0][rng.below(2) as usize]);
    let (spread, apart) = ([0.0, 0.01, 0.05][rng.below(3) as usize], [0.0, 0.1][rng.below(2) as usize]);
    let scale = [1.0, 1e-3, 1e3, 1e-20][rng.below(4) as usize];
    let tmax = [f64::INFINITY, 1.0 / scale][rng.below(2) as usize] as f32;
    (0..count)
        .map(|_| {
            let origin = [0, 1, 2].map(|k| (target[k] + from[k] + unit(rng) * apart * away * 0.1) as f32);
            let direction = [0, 1, 2].map(|k| ((-from[k] + unit(rng) * spread * away) * scale) as f32);
            Ray { origin, tmin: 0.0, direction, tmax }
        })
        .collect()
}

#[test]
fn packets_through_the_top_level_change_no_answer() {
    let mut rng = Rng::new(23);
    let (mut in_packets, mut all, mut hits_seen, mut refused) = (0, 0, 0, 0);
    for round in 0..200 {
        let file = File::from_bytes(FILES[round % 2]).unwrap();
        let count = [1, 7, 17, 40, 150][round % 5];
        let (world, transforms) = world(&file, &mut rng, count);
        let rays = bundle(&mut rng, &transforms, [33, 64, 100][round % 3]);
        let (mut hits, mut found) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
        world.nearest(&file, &rays, None, &mut hits);
        world.any(&file, &rays, None, &mut found);
        for (i, ray) in rays.iter().enumerate() {
            let expected = brute(&world, &file, ray);
            assert_eq!(hits[i], expected, "round {round}, ray {i}: {ray:?}");
            assert_eq!(found[i], expected.is_hit(), "round {round}, ray {i}: {ray:?}");
            hits_seen += usize::from(expected.is_hit());
        }
        let mut active_rays = ActiveRays::default();
        let batch = SceneBatch { world: &world, file: &file, rays: &rays, from: None };
        Isa::chosen().run(StartKernel {
            batch: &batch,
            first: 0,
            count: rays.len(),
            active_rays: &mut active_rays,
        });
        in_packets += usize::from(!active_rays.packets.is_empty());
        refused += usize::from(active_rays.packets.is_empty() && count == 150);
        all += rays.len();
    }
    assert!(in_packets > 60, "{in_packets} of 200 rounds in packets");
    assert!(hits_seen > all / 5 && refused > 2, "{hits_seen} of {all} hit, {refused} refused");
}

#[test]
fn the_only_instance_is_traced_as_one_of_many() {
    let mut rng = Rng::new(31);
    let (mut hits_seen, mut all) = (0, 0);
    for round in 0..60 {
        let file = File::from_bytes(FILES[round % 2]).unwrap();
        let identity = Affine::IDENTITY;
        let number = rng.below(u64::from(file.object_count())) as u32;
        let parts = Parts::whole(file.object_header(number));
        let placed = Placed::new(&identity, number, file.object_header(number), &parts).unwrap();
        // The other instances are not visible.
        let (row, count) = (round % 5, [1, 3, 40, 64][round % 4]);
        let mut places = vec![None; 5];
        places[row] = Some(placed);
        let world = World::of_places(places.clone(), file.object_count());
        assert_eq!(world.sole(), Some((row as u32, number)));
        places[(row + 1) % 5] = Some(placed);
        assert_eq!(World::of_places(places, file.object_count()).sole(), None);

        let rays = rays(&mut rng, &[identity], count);
        let from: Vec<Surface> = rays
            .iter()
            .map(|_| Surface { instance: rng.below(6) as u32, triangle: rng.below(3) as u32 })
            .collect();
        let (mut hits, mut found) = (vec![Hit::MISS; count], vec![false; count]);
        world.nearest(&file, &rays, Some(&from), &mut hits);
        world.any(&file, &rays, Some(&from), &mut found);
        let scene = Scene::of(file, world);
        let (mut sole_hits, mut sole_found) = (vec![Hit { t: 7.0, ..Hit::MISS }; count], vec![true; count]);
        scene.nearest_batch(&rays, Some(&from), &mut sole_hits);
        scene.any_batch(&rays, Some(&from), &mut sole_found);
        assert_eq!((&sole_hits, &sole_found), (&hits, &found), "round {round}: {rays:?}");
        assert_eq!(scene.nearest_counted(&rays[0], from[0]).0, hits[0]);
        assert_eq!(scene.touched_objects(), 1);
        hits_seen += hits.iter().filter(|hit| hit.is_hit()).count();
        all += count;
    }
    assert!(hits_seen > all / 4, "{hits_seen} of {all} hit");
}
