//! Random sequences of calls, good and bad, with commits between them.

use super::expected::{Expected, ExpectedInstance, ExpectedSubscene};
use super::*;
use crate::Accept;

/// A random transform; one in six cannot be used, and one in eight is tiny, huge or mirrored.
fn transform(rng: &mut Rng) -> [f64; 12] {
    let mut m = at(unit(rng) * 6.0, unit(rng) * 6.0, unit(rng) * 6.0);
    if rng.below(4) > 0 {
        for k in 0..9 {
            m[k + k / 3] += f64::from(unit(rng)) * 0.7;
        }
    }
    let scale = |m: &mut [f64; 12], s: f64| (0..9).for_each(|k| m[k + k / 3] *= s);
    match rng.below(48) {
        0 => m[4..7].fill(0.0),
        1 => (0..3).for_each(|k| m[8 + k] = 2.0 * m[4 + k]),
        2 => scale(&mut m, 0.0),
        3 => m[rng.below(12) as usize] = f64::NAN,
        4 => m[rng.below(12) as usize] = f64::INFINITY,
        5 => m[3] = f32::MAX.into(),
        6 => (0..3).for_each(|k| m[4 + k] *= 1e-9),
        7 => scale(&mut m, 3e38),
        8 | 9 => scale(&mut m, 1e-30),
        10 => scale(&mut m, 1e20),
        11..=13 => scale(&mut m, -1.0),
        _ => {}
    }
    m
}

/// Random rays about the instances.
fn rays(rng: &mut Rng, expected: &Expected, count: usize) -> Vec<Ray> {
    let placed = expected.ids(|i| i.visible);
    (0..count)
        .map(|i| {
            let target = placed.get(rng.below(placed.len().max(1) as u64) as usize).map_or([0.0; 3], |&id| {
                let instance = expected.instances[id as usize].as_ref().expect("placed");
                let point = [0.25, 0.25, 0.0].map(|x| x + f64::from(unit(rng)) * 0.2);
                expected.transform(instance).0.apply(point).map(|x| x as f32)
            });
            let distance = [0.0, 1.0, 20.0][rng.below(3) as usize];
            let origin = target.map(|x| x + unit(rng) * distance);
            let mut direction = [0, 1, 2].map(|k| target[k] - origin[k]);
            if direction == [0.0; 3] || i % 5 == 0 {
                direction = [0.0, 0.0, -1.0];
            }
            let tmin = [0.0, f32::NEG_INFINITY][i % 2];
            Ray { origin, tmin, direction, tmax: f32::INFINITY }
        })
        .collect()
}

/// A builder with all files, what is wanted of it, and the indices of the files' first objects.
struct Case {
    builder: SceneBuilder,
    expected: Expected,
    firsts: Vec<u32>,
}

impl Case {
    fn new() -> Case {
        let mut builder = SceneBuilder::new();
        let firsts = FILES.map(|bytes| builder.add(&crate::from_bytes(bytes).unwrap())).to_vec();
        Case { builder, expected: Expected::default(), firsts }
    }

    fn change(&mut self, rng: &mut Rng, transforms: &mut dyn FnMut(&mut Rng) -> [f64; 12]) {
        let Case { builder, expected, .. } = self;
        let own = expected.ids(|i| i.subscene.is_none());
        let any = expected.ids(|_| true);
        let pick = |ids: &[u32], rng: &mut Rng| ids.get(rng.below(ids.len().max(1) as u64) as usize).copied();
        match rng.below(16) {
            0..=4 => {
                let object = rng.below(u64::from(builder.scene().object_count())) as u32;
                let transform = transforms(rng);
                let id = builder.instance(object, &transform).unwrap();
                assert!(!any.contains(&id));
                expected.set(id, Some(ExpectedInstance { object, transform, visible: true, subscene: None }));
            }
            5..=7 => {
                // The last of several transforms of an instance counts.
                let count = rng.below(20) as usize;
                let ids: Vec<u32> = (0..count).filter_map(|_| pick(&own, rng)).collect();
                let transforms: Vec<_> = ids.iter().map(|_| transforms(rng)).collect();
                builder.set_transforms(&ids, &transforms).unwrap();
                for (id, transform) in ids.iter().zip(transforms) {
                    expected.instances[*id as usize].as_mut().unwrap().transform = transform;
                }
            }
            8 | 9 => {
                let (Some(id), visible) = (pick(&any, rng), rng.below(2) == 0) else { return };
                builder.set_visible(id, visible).unwrap();
                expected.instances[id as usize].as_mut().unwrap().visible = visible;
            }
            10 | 11 => {
                let Some(id) = pick(&own, rng) else { return };
                builder.remove(id).unwrap();
                expected.set(id, None);
            }
            _ => self.change_subscenes(rng, transforms),
        }
    }

    fn change_subscenes(&mut self, rng: &mut Rng, transforms: &mut dyn FnMut(&mut Rng) -> [f64; 12]) {
        let Case { builder, expected, firsts } = self;
        let there: Vec<u32> = (0..expected.subscenes.len() as u32)
            .filter(|id| expected.subscenes[*id as usize].is_some())
            .collect();
        if there.is_empty() || rng.below(4) == 0 {
            // The last file has no objects, so no instances.
            let file = rng.below(FILES.len() as u64 - 1) as usize;
            let transform = if rng.below(2) == 0 { IDENTITY } else { transforms(rng) };
            let id = builder.subscene(firsts[file], &transform).unwrap();
            let alone = crate::from_bytes(FILES[file]).unwrap();
            let seconds = alone.seconds();
            expected.set_subscene(id, Some(ExpectedSubscene { file, transform, seconds, visible: true }));
            let ids = builder.subscene_instances(id).unwrap();
            assert_eq!(ids.len(), alone.instance_count() as usize);
            for (row, &instance) in (0..).zip(ids) {
                let object = firsts[file] + alone.object_of(row);
                let subscene = Some((id, row));
                expected.set(
                    instance,
                    Some(ExpectedInstance { object, transform: IDENTITY, visible: true, subscene }),
                );
            }
            return;
        }
        let id = there[rng.below(there.len() as u64) as usize];
        let subscene = expected.subscenes[id as usize].as_mut().unwrap();
        match rng.below(6) {
            0..=2 => {
                subscene.seconds = f64::from(unit(rng)) * 3.0;
                builder.set_subscene_seconds(id, subscene.seconds).unwrap();
            }
            3 => {
                subscene.transform = transforms(rng);
                builder.set_subscene_transform(id, &subscene.transform).unwrap();
            }
            4 => {
                subscene.visible = !subscene.visible;
                builder.set_subscene_visible(id, subscene.visible).unwrap();
            }
            _ => {
                builder.remove_subscene(id).unwrap();
                let gone = expected.ids(|i| i.subscene.is_some_and(|(of, _)| of == id));
                gone.iter().for_each(|id| expected.set(*id, None));
                expected.set_subscene(id, None);
            }
        }
    }

    /// Compares the scene with what is wanted, and returns the number of rays that hit.
    fn check(&self, rng: &mut Rng) -> usize {
        let (scene, expected) = (self.builder.scene(), &self.expected);
        super::top_level::check(scene);
        assert_eq!(scene.instance_count() as usize, expected.instances.len());
        for (id, instance) in (0..).zip(&expected.instances) {
            let view = scene.instance(id);
            assert_eq!(view.object, instance.map_or(u32::MAX, |i| i.object));
            assert_eq!(view.visible, expected.placement(scene, id).is_some());
            if let Some(instance) = instance.filter(|_| view.visible) {
                assert_eq!(view.to_world, expected.transform(&instance).0.rows());
            }
        }
        let rays = rays(rng, expected, 30);
        let hits = nearest(scene, &rays);
        let mut found = vec![false; rays.len()];
        scene.batch(&rays).any(&mut found);
        for (i, all) in expected.all_hits(scene, &rays).iter().enumerate() {
            let first = all.first().copied().unwrap_or(Hit::MISS);
            assert_eq!((hits[i], found[i]), (first, first.is_hit()), "{:?}", rays[i]);
            let mut several = Vec::new();
            scene.all_hits(&rays[i], &Accept::default(), &mut several);
            assert_eq!(&several, all, "{:?}", rays[i]);
            assert_eq!(scene.count_hits(&rays[i], &Accept::default()), all.len());
        }
        hits.iter().filter(|hit| hit.is_hit()).count()
    }

    /// Compares other queries with a scene that was built at once. Only without subscenes.
    fn check_afresh(&self, rng: &mut Rng) {
        let (scene, afresh) = (self.builder.scene(), self.expected.afresh());
        let afresh = afresh.scene();
        for ray in rays(rng, &self.expected, 10) {
            assert_eq!(scene.crossings(&ray), afresh.crossings(&ray));
            let point = ray.origin;
            assert_eq!(scene.winding(point), afresh.winding(point));
            assert_eq!(scene.closest(point, f32::INFINITY), afresh.closest(point, f32::INFINITY));
            assert_eq!(scene.signed_distance(point).to_bits(), afresh.signed_distance(point).to_bits());
            let (mut ours, mut theirs) = (vec![], vec![]);
            scene.triangles_in_sphere(point, 2.0, &mut ours);
            afresh.triangles_in_sphere(point, 2.0, &mut theirs);
            assert_eq!(ours, theirs);
            let upper = point.map(|x| x + 1.0);
            scene.triangles_in_box(point, upper, &mut ours);
            afresh.triangles_in_box(point, upper, &mut theirs);
            assert_eq!(ours, theirs);
            if let Some(hit) = scene.nearest(&ray) {
                assert_eq!(scene.surface(&hit), afresh.surface(&hit));
                assert_eq!(scene.opacity(&hit), afresh.opacity(&hit));
            }
        }
        assert_eq!(scene.bounds(), afresh.bounds());
    }
}

/// All that can be seen of a scene without tracing.
fn snapshot(scene: &Scene) -> Vec<String> {
    let ids = 0..scene.instance_count();
    ids.map(|id| format!("{:?} {:?}", scene.instance(id), scene.instance_bounds(id))).collect()
}

#[test]
fn random_sequences_of_calls_give_the_hits_of_a_loop_and_failed_commits_change_nothing() {
    let (mut commits, mut failures, mut hit_count, mut refits, mut afresh) = (0, 0, 0, 0, 0);
    let sequences = if cfg!(miri) { 1 } else { 240 };
    for seed in 0..sequences {
        let rng = &mut Rng::new(1000 + seed);
        let mut case = Case::new();
        for step in 0..8 {
            (0..1 + rng.below(12)).for_each(|_| case.change(rng, &mut transform));
            let (before, rays) = (snapshot(case.builder.scene()), rays(rng, &case.expected, 10));
            let answers = nearest(case.builder.scene(), &rays);
            let wrong = case.expected.unplaceable(case.builder.scene());
            let update = case.builder.commit();
            assert_eq!(update.is_err(), !wrong.is_empty(), "sequence {seed}, step {step}: {update:?}");
            commits += 1;
            let error = match update {
                Ok(update) => {
                    refits += u32::from(!update.rebuilt && update.placed > 0);
                    hit_count += case.check(rng);
                    continue;
                }
                Err(error) => error,
            };
            failures += 1;
            assert!(matches!(error.code(), Code::Singular | Code::NotFinite), "{error}");
            let text = error.to_string();
            let named = |id: &u32| text.contains(&format!("instance {id}"));
            assert!(wrong.iter().any(named) && error.offset().is_none(), "{wrong:?}: {text}");
            assert_eq!(snapshot(case.builder.scene()), before);
            assert_eq!(nearest(case.builder.scene(), &rays), answers);
            // Some of the wrong instances are hidden, others get a transform that can be used.
            for id in wrong {
                let instance = case.expected.instances[id as usize].as_mut().expect("wrong, so there");
                if instance.subscene.is_some() || rng.below(2) == 0 {
                    case.builder.set_visible(id, false).unwrap();
                    instance.visible = false;
                } else {
                    instance.transform = at(unit(rng), unit(rng), unit(rng));
                    case.builder.set_transform(id, &instance.transform).unwrap();
                }
            }
            case.builder.commit().unwrap();
            hit_count += case.check(rng);
        }
        if case.expected.subscenes.iter().all(Option::is_none) {
            case.check_afresh(rng);
            afresh += 1;
        }
    }
    if sequences > 1 {
        let counts = [commits, failures, refits, afresh, hit_count as u32];
        assert!(commits > 1500 && failures > 200 && refits > 50 && afresh > 0, "{counts:?}");
        assert!(hit_count > 5000, "{counts:?}");
    }
}

#[test]
fn other_queries_do_not_depend_on_how_a_scene_came_about() {
    for seed in 0..if cfg!(miri) { 1 } else { 60 } {
        let rng = &mut Rng::new(7000 + seed);
        let mut case = Case::new();
        let mut usable = |rng: &mut Rng| at(unit(rng) * 3.0, unit(rng) * 3.0, unit(rng) * 3.0);
        for _ in 0..6 {
            for _ in 0..10 {
                case.change(rng, &mut usable);
                // Subscenes are left to the other test.
                let id = case.expected.subscenes.iter().position(Option::is_some);
                if let Some(id) = id {
                    case.builder.remove_subscene(id as u32).unwrap();
                    let gone = case.expected.ids(|i| i.subscene.is_some());
                    gone.iter().for_each(|id| case.expected.set(*id, None));
                    case.expected.set_subscene(id as u32, None);
                }
            }
            case.builder.commit().unwrap();
        }
        case.check(rng);
        case.check_afresh(rng);
    }
}
