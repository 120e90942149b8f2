//! The rays are the same for every tracer and run, and rivals answer them as we do, up to their own errors.

use bth::rays::{Hit, PrimitiveRef, Ray, Start};
use bth_bench::model::Model;
use bth_bench::rays::{Finder, Options, RaySet, View, sets};
use bth_bench::rivals::RIVALS;
use bth_bench::structures::Use;
use bth_bench::tracer::{BLOCK, Batch, Contender, Starting, spread};
use bth_bench::{rays, structures};

const OPTIONS: Options = Options { size: (128, 72), most: usize::MAX, view: None };

fn knot() -> (Model, bth::Scene) {
    let model = Model::load("torus-knot:720").unwrap();
    let compiled = structures::compile(&model, &structures::BVH).unwrap();
    let scene = bth::from_bytes(&compiled.bytes).unwrap();
    (model, scene)
}

fn exact(scene: &bth::Scene, set: &RaySet) -> (Vec<Hit>, Vec<bool>) {
    let (mut hits, mut found) = (vec![Hit::MISS; set.rays.len()], vec![false; set.rays.len()]);
    scene.batch(&set.rays).nearest(&mut hits);
    scene.batch(&set.rays).any(&mut found);
    (hits, found)
}

/// Hits that miss in the exact answer or the other way round, and the worst relative error of t of the rest.
fn compare(expected: &[Hit], hits: &[Hit]) -> (usize, f32) {
    let (mut wrong, mut error) = (0, 0f32);
    for (a, b) in expected.iter().zip(hits) {
        if a.is_hit() != b.is_hit() {
            wrong += 1;
        } else if a.is_hit() {
            error = error.max((a.t - b.t).abs() / a.t.max(1.0));
        }
    }
    (wrong, error)
}

#[test]
fn ray_sets_are_the_same_in_every_run() {
    let (model, scene) = knot();
    let (view, first) = sets(&Finder::new(&model, &scene), &OPTIONS);
    let (again, second) = sets(&Finder::new(&model, &scene), &OPTIONS);
    assert_eq!(view, View::Outside);
    assert_eq!((view, &first), (again, &second));
    assert_eq!(first.iter().map(|s| s.name).collect::<Vec<_>>(), rays::NAMES);
}

#[test]
fn ray_sets_are_what_their_names_say() {
    let (model, scene) = knot();
    let (_, sets) = sets(&Finder::new(&model, &scene), &OPTIONS);
    let diagonal = model.bounds().diagonal() as f32;
    for set in &sets {
        assert!(set.rays.len() > 500, "{}: {} rays", set.name, set.rays.len());
        for Ray { direction: [x, y, z], .. } in &set.rays {
            assert!((x * x + y * y + z * z - 1.0).abs() < 1e-5, "{}", set.name);
        }
        let starts = set.starts.as_ref().map(|starts| {
            starts.len() == set.rays.len() && starts.iter().all(|s| scene.check_start(s).is_ok())
        });
        assert_eq!(starts, ["diffuse", "ao", "shadow"].contains(&set.name).then_some(true), "{}", set.name);
        let (hits, _) = exact(&scene, set);
        match set.name {
            "miss" => assert!(hits.iter().all(|h| !h.is_hit())),
            "ao" | "ao-beside" => {
                assert!(set.rays.iter().all(|r| (r.tmax - 0.05 * diagonal).abs() < 1e-4 * diagonal))
            }
            "closeup" => assert!(hits.iter().filter(|h| h.is_hit()).count() * 2 > hits.len()),
            _ => assert!(hits.iter().any(Hit::is_hit)),
        }
    }
}

#[test]
fn rooms_are_seen_from_inside() {
    let model = Model::load("torus-knots-in-a-box:10000").unwrap();
    let compiled = structures::compile(&model, &structures::BVH).unwrap();
    let scene = bth::from_bytes(&compiled.bytes).unwrap();
    let (view, sets) = sets(&Finder::new(&model, &scene), &OPTIONS);
    assert_eq!(view, View::Inside);
    let (hits, _) = exact(&scene, &sets[0]);
    assert!(hits.iter().all(Hit::is_hit), "a closed room is seen everywhere");
}

#[test]
fn thinned_sets_keep_starts_with_their_rays() {
    let (model, scene) = knot();
    let finder = Finder::new(&model, &scene);
    let (_, whole) = sets(&finder, &OPTIONS);
    let (_, thinned) = sets(&finder, &Options { most: 1000, ..OPTIONS });
    for (whole, thinned) in whole.iter().zip(&thinned) {
        assert!(thinned.rays.len() < 1000 + 64, "{}: {}", thinned.name, thinned.rays.len());
        let Some((starts, all)) = thinned.starts.as_ref().zip(whole.starts.as_ref()) else { continue };
        for (ray, start) in thinned.rays.iter().zip(starts) {
            assert!(whole.rays.iter().zip(all).any(|(r, s)| r == ray && s == start));
        }
    }
}

#[test]
fn our_structures_answer_with_the_same_bits_in_every_use() {
    let (model, scene) = knot();
    let (_, sets) = sets(&Finder::new(&model, &scene), &OPTIONS);
    let bvh = structures::compile(&model, &structures::BVH).unwrap();
    let [without_own, from_start] = [Use::Own, Use::StartSingle].map(|usage| Contender {
        name: String::new(),
        ours: true,
        tracer: structures::tracer(&bvh.bytes, usage).unwrap(),
        build_s: 0.0,
        bytes: None,
    });
    for kind in [structures::BTH, structures::BVH] {
        let compiled = structures::compile(&model, &kind).unwrap();
        for contender in structures::contenders(&kind, &compiled).unwrap() {
            for set in &sets {
                let expected = match (contender.tracer.starting(), &set.starts) {
                    (Starting::RejectOwn, Some(_)) => traced(&without_own, set, 1),
                    (Starting::OnSurface, Some(_)) => traced(&from_start, set, 1),
                    _ => exact(&scene, set),
                };
                assert_eq!(traced(&contender, set, 1), expected, "{} on {}", contender.name, set.name);
            }
        }
    }
}

fn traced(contender: &Contender, set: &RaySet, threads: usize) -> (Vec<Hit>, Vec<bool>) {
    let (mut hits, mut found) = (vec![Hit::MISS; set.rays.len()], vec![false; set.rays.len()]);
    contender.nearest(set.batch(), &mut hits, threads, 1);
    contender.any(set.batch(), &mut found, threads, 1);
    (hits, found)
}

/// Rivals that are no crates take part where they are installed; the others always. At the hits that rays start from, rivals hit
/// or miss the surface as their rounding has it.
#[test]
fn rivals_agree_with_the_exact_answers_up_to_their_errors() {
    let (model, scene) = knot();
    let (_, sets) = sets(&Finder::new(&model, &scene), &OPTIONS);
    let mut measured = Vec::new();
    for rival in &RIVALS {
        let contender = match rival.build(&model, 1) {
            Ok(contender) => contender,
            Err(error) => {
                let native = ["embree", "tinybvh"].iter().any(|n| rival.name.starts_with(n));
                assert!(native, "{}: {error:#}", rival.name);
                continue;
            }
        };
        measured.push(rival.name);
        for set in sets.iter().filter(|set| set.starts.is_none()) {
            let (hits, found) = traced(&contender, set, 2);
            let (expected, expected_found) = exact(&scene, set);
            let (wrong, error) = compare(&expected, &hits);
            let wrong_found = found.iter().zip(&expected_found).filter(|(a, b)| a != b).count();
            let most = set.rays.len() / 1000;
            assert!(wrong <= most, "{}, {}: {wrong} of {}", rival.name, set.name, set.rays.len());
            assert!(wrong_found <= most, "{}, {}: any: {wrong_found}", rival.name, set.name);
            assert!(error < 1e-3, "{}, {}: t is off by {error}", rival.name, set.name);
            let beyond = |h: &Hit| h.is_hit() && h.primitive.triangle as usize >= model.triangles();
            assert!(!hits.iter().any(beyond), "{}, {}: no such triangle", rival.name, set.name);
        }
    }
    assert!(measured.len() >= 3, "{measured:?}");
}

#[test]
fn threads_share_all_rays_out_once() {
    let ray = |i: usize| Ray { origin: [i as f32; 3], tmin: 0.0, direction: [1.0, 0.0, 0.0], tmax: 1.0 };
    let rays: Vec<Ray> = (0..3 * BLOCK + 17).map(ray).collect();
    let start = |triangle| Start { primitive: PrimitiveRef { instance: 0, triangle }, u: 0.0, v: 0.0 };
    let starts: Vec<Start> = (0..rays.len() as u32).map(start).collect();
    let mut seen = vec![0; rays.len()];
    let batch = Batch { rays: &rays, starts: Some(&starts), coherent: false };
    spread(batch, &mut seen, 3, BLOCK, |batch, seen| {
        for ((ray, start), seen) in batch.rays.iter().zip(batch.starts.unwrap()).zip(seen) {
            assert_eq!(ray.origin[0], start.primitive.triangle as f32);
            *seen += 1 + start.primitive.triangle;
        }
    });
    assert!(seen.iter().enumerate().all(|(i, n)| *n == 1 + i as u32));
}
