//! The rays are the same for every tracer and run, and rivals answer them as we do, up to their own
//! errors.

use bth::Scene;
use bth::rays::{Hit, Ray};
use bth_bench::model::Model;
use bth_bench::rays::{self, Finder, Options, RaySet, View, sets};
use bth_bench::rivals::RIVALS;
use bth_bench::structures::{self, SceneTracer, Use};
use bth_bench::tracer::{Answers, BLOCK, Batch, Starting, Tracer, spread};

const OPTIONS: Options = Options { size: (128, 72), most: usize::MAX, view: None };

fn compiled(name: &str) -> (Model, Vec<u8>, Scene) {
    let model = Model::load(name).unwrap();
    let bytes = structures::compile(&model, &structures::BVH).unwrap().bytes;
    let scene = bth::from_bytes(&bytes).unwrap();
    (model, bytes, scene)
}

fn traced(tracer: &dyn Tracer, set: &RaySet) -> [Answers; 2] {
    [false, true].map(|any| {
        let mut answers = Answers::empty(any, set.rays.len());
        answers.trace(tracer, set.batch());
        answers
    })
}

#[test]
fn ray_sets_are_what_their_names_say_in_every_run() {
    let (model, _, scene) = compiled("torus-knot:720");
    let (view, all) = sets(&Finder::new(&model, &scene), &OPTIONS);
    assert_eq!((view, &all), (View::Outside, &sets(&Finder::new(&model, &scene), &OPTIONS).1));
    assert_eq!(all.iter().map(|s| s.name).collect::<Vec<_>>(), rays::NAMES);
    let diagonal = model.bounds().diagonal() as f32;
    for set in &all {
        assert!(set.rays.len() > 500, "{}: {} rays", set.name, set.rays.len());
        for Ray { direction: [x, y, z], .. } in &set.rays {
            assert!((x * x + y * y + z * z - 1.0).abs() < 1e-5, "{}", set.name);
        }
        let starts = set.starts.as_ref().map(|starts| {
            starts.len() == set.rays.len() && starts.iter().all(|s| scene.check_start(s).is_ok())
        });
        assert_eq!(starts, ["diffuse", "ao", "shadow"].contains(&set.name).then_some(true), "{}", set.name);
        let mut hits = vec![Hit::MISS; set.rays.len()];
        scene.batch(&set.rays).nearest(&mut hits);
        let hits = hits.iter().filter(|h| h.is_hit()).count();
        assert!(hits > if set.name == "closeup" { set.rays.len() / 2 } else { 0 }, "{}", set.name);
        if set.name.starts_with("ao") {
            assert!(set.rays.iter().all(|r| (r.tmax - 0.05 * diagonal).abs() < 1e-4 * diagonal));
        }
    }
    // Thinned sets keep starts with their rays.
    let (_, thinned) = sets(&Finder::new(&model, &scene), &Options { most: 1000, ..OPTIONS });
    for (whole, thinned) in all.iter().zip(&thinned) {
        assert!(thinned.rays.len() < 1000 + 64, "{}: {}", thinned.name, thinned.rays.len());
        let Some((starts, all)) = thinned.starts.as_ref().zip(whole.starts.as_ref()) else { continue };
        for (ray, start) in thinned.rays.iter().zip(starts) {
            assert!(whole.rays.iter().zip(all).any(|(r, s)| r == ray && s == start));
        }
    }
}

#[test]
fn rooms_are_seen_from_inside() {
    let (model, _, scene) = compiled("torus-knots-in-a-box:10000");
    let (view, sets) = sets(&Finder::new(&model, &scene), &OPTIONS);
    assert_eq!(view, View::Inside);
    let mut hits = vec![Hit::MISS; sets[0].rays.len()];
    scene.batch(&sets[0].rays).nearest(&mut hits);
    assert!(hits.iter().all(Hit::is_hit), "a closed room is seen everywhere");
}

#[test]
fn our_structures_answer_with_the_same_bits_in_every_use() {
    let (model, bvh, scene) = compiled("torus-knot:720");
    let (_, sets) = sets(&Finder::new(&model, &scene), &OPTIONS);
    let [without_own, from_start] =
        [Use::Own, Use::StartSingle].map(|usage| structures::tracer(&bvh, usage).unwrap());
    let at_origin = SceneTracer(scene);
    for kind in [structures::BTH, structures::BVH] {
        let compiled = structures::compile(&model, &kind).unwrap();
        for contender in structures::contenders(&kind, &compiled).unwrap() {
            for set in &sets {
                let expected = match (contender.tracer.starting(), &set.starts) {
                    (Starting::RejectOwn, Some(_)) => traced(&*without_own, set),
                    (Starting::OnSurface, Some(_)) => traced(&*from_start, set),
                    _ => traced(&at_origin, set),
                };
                assert_eq!(traced(&*contender.tracer, set), expected, "{} on {}", contender.name, set.name);
            }
        }
    }
}

/// Rivals that are not crates take part if they are installed; the others always. At the hits from
/// which rays start, rivals hit or miss the surface as they round.
#[test]
fn rivals_agree_with_the_exact_answers_up_to_their_errors() {
    let (model, _, scene) = compiled("torus-knot:720");
    let (_, sets) = sets(&Finder::new(&model, &scene), &OPTIONS);
    let exact = SceneTracer(scene);
    for rival in &RIVALS {
        let contender = match rival.build(&model, 1) {
            Ok(contender) => contender,
            Err(error) => {
                let native = ["embree", "tinybvh"].iter().any(|n| rival.name.starts_with(n));
                assert!(native, "{}: {error:#}", rival.name);
                continue;
            }
        };
        for set in sets.iter().filter(|set| set.starts.is_none()) {
            let (found, expected) = (traced(&*contender.tracer, set), traced(&exact, set));
            for (found, expected) in found.iter().zip(&expected) {
                let wrong = expected.differences(found, false);
                assert!(wrong <= set.rays.len() / 1000, "{}, {}: {wrong}", rival.name, set.name);
            }
            let [Answers::Nearest(found), Answers::Nearest(expected)] = [&found[0], &expected[0]] else {
                panic!()
            };
            for (a, b) in found.iter().zip(expected).filter(|(a, b)| a.is_hit() && b.is_hit()) {
                assert!((a.t - b.t).abs() < 1e-3 * b.t.max(1.0), "{}, {}: {a:?}", rival.name, set.name);
                assert!((a.primitive.triangle as usize) < model.triangles(), "{}: {a:?}", rival.name);
            }
        }
    }
}

#[test]
fn threads_trace_all_rays_once_in_each_pass() {
    let rays: Vec<Ray> = (0..3 * BLOCK + 17).map(|i| Ray::new([i as f32; 3], [1.0, 0.0, 0.0])).collect();
    let mut seen = vec![0; rays.len()];
    let batch = Batch { rays: &rays, starts: None, coherent: false };
    spread(batch, &mut seen, (3, 2), BLOCK, |batch, seen| {
        batch.rays.iter().zip(seen).for_each(|(ray, seen)| *seen += 1 + ray.origin[0] as usize);
    });
    assert!(seen.iter().enumerate().all(|(i, n)| *n == 2 * (1 + i)));
}
