//! The top level after commits: what it holds, when it is refitted, and that threads do not matter.

use super::*;
use crate::instances::{INSTANCE, TopLevel};
use bth_format::layout::NONE;

/// Checks that each visible instance is in the top level once, within the boxes of all nodes above
/// it.
pub(super) fn check(scene: &Scene) {
    let world = scene.world().expect("instances");
    let mut seen = vec![0; world.placements.len()];
    let mut stack = vec![];
    if !world.top.is_empty() {
        stack.push((0, [f32::NEG_INFINITY; 3], [f32::INFINITY; 3]));
    }
    while let Some((code, lower, upper)) = stack.pop() {
        if code & INSTANCE != 0 {
            let placement = world.placements[(code & !INSTANCE) as usize].as_ref().expect("visible");
            for k in 0..3 {
                assert!(lower[k] <= placement.lower[k] && placement.upper[k] <= upper[k], "{placement:?}");
            }
            seen[(code & !INSTANCE) as usize] += 1;
            continue;
        }
        let node = world.top.nodes().node(code);
        for slot in (0..16).filter(|&slot| node.child[slot] != NONE) {
            let ends = [0, 1].map(|end| [0, 1, 2].map(|k| node.bounds[k][end][slot]));
            for k in 0..3 {
                assert!(lower[k] <= ends[0][k] && ends[1][k] <= upper[k], "{code}, {slot}");
            }
            assert!(node.child[slot] & INSTANCE != 0 || node.child[slot] > code);
            stack.push((node.child[slot], ends[0], ends[1]));
        }
    }
    for (placement, count) in world.placements.iter().zip(seen) {
        assert_eq!(count, u32::from(placement.is_some()));
    }
}

/// A builder with many instances in a cube, not committed.
fn crowd(count: usize, rng: &mut Rng) -> (SceneBuilder, Vec<u32>, Vec<[f64; 12]>) {
    let mut builder = SceneBuilder::new();
    let objects = [0, 1].map(|i| builder.add(&crate::from_bytes(FILES[i]).unwrap()));
    let side = (count as f32).cbrt() * 2.0;
    let places: Vec<_> =
        (0..count).map(|_| at(unit(rng) * side, unit(rng) * side, unit(rng) * side)).collect();
    let ids = places.iter().enumerate().map(|(i, m)| builder.instance(objects[i % 2], m).unwrap()).collect();
    (builder, ids, places)
}

#[cfg(feature = "rayon")]
fn aimed(places: &[[f64; 12]], rng: &mut Rng, count: usize) -> Vec<Ray> {
    (0..count)
        .map(|_| {
            let m = places[rng.below(places.len() as u64) as usize];
            let target = [m[3] + 0.25, m[7] + 0.25, m[11]].map(|x| x as f32);
            let origin = target.map(|x| x + unit(rng) * 20.0);
            Ray::new(origin, [0, 1, 2].map(|k| target[k] - origin[k]))
        })
        .collect()
}

#[test]
fn small_motions_refit_and_great_ones_rebuild() {
    let rng = &mut Rng::new(5);
    let (mut builder, ids, mut places) = crowd(500, rng);
    let update = builder.commit().unwrap();
    assert_eq!((update.placed, update.visible, update.rebuilt, update.cost_ratio), (500, 500, true, 1.0));
    assert_eq!(builder.commit().unwrap(), Update { visible: 500, ..Update::default() });
    let mut greatest = 1.0f64;
    let mut rebuilt = 0;
    for step in 0..60 {
        places
            .iter_mut()
            .for_each(|m| [3, 7, 11].into_iter().for_each(|k| m[k] += f64::from(unit(rng)) * 0.8));
        builder.set_transforms(&ids, &places).unwrap();
        let update = builder.commit().unwrap();
        assert!(update.cost_ratio <= 1.5 && update.rebuilt == (update.cost_ratio == 1.0), "{update:?}");
        assert!(step > 0 || !update.rebuilt, "{update:?}");
        rebuilt += u32::from(update.rebuilt);
        greatest = greatest.max(update.cost_ratio);
        check(builder.scene());
    }
    assert!(rebuilt > 0 && rebuilt < 30 && greatest > 1.2, "{rebuilt} of 60, {greatest}");
    // Everything moves in the same way, and then everything to the place of another.
    places.iter_mut().for_each(|m| m[3] += 1000.0);
    builder.set_transforms(&ids, &places).unwrap();
    assert!(!builder.commit().unwrap().rebuilt);
    places.reverse();
    builder.set_transforms(&ids, &places).unwrap();
    assert!(builder.commit().unwrap().rebuilt);
    check(builder.scene());
    // One instance that flies far away does not hide that others have changed places.
    places[0][3] = 1e9;
    let half = places.len() / 2;
    places[1..].rotate_left(half);
    builder.set_transforms(&ids, &places).unwrap();
    assert!(builder.commit().unwrap().rebuilt);
    builder.set_visible(7, false).unwrap();
    assert!(builder.commit().unwrap().rebuilt);
    check(builder.scene());
}

#[test]
#[cfg(all(feature = "rayon", not(miri)))]
fn updates_and_answers_do_not_depend_on_the_number_of_threads() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let rng = &mut Rng::new(17);
            let (mut builder, ids, mut places) = crowd(9_000, rng);
            let mut seen = Vec::new();
            for step in 0..5 {
                if step == 2 {
                    let mut wrong = places.clone();
                    wrong[8_000][0] = f64::NAN;
                    wrong[5_000][..3].fill(0.0);
                    builder.set_transforms(&ids, &wrong).unwrap();
                    let error = builder.commit().unwrap_err().to_string();
                    assert!(error.contains("instance 5000, "), "{error}");
                }
                places.iter_mut().for_each(|m| m[3 + 4 * (step % 3)] += f64::from(unit(rng)) * 0.4);
                builder.set_transforms(&ids, &places).unwrap();
                if step == 4 {
                    (0..4000).for_each(|id| builder.remove(2 * id).unwrap());
                }
                let update = builder.commit().unwrap();
                check(builder.scene());
                let hits = nearest(builder.scene(), &aimed(&places, rng, 3000));
                assert!(hits.iter().filter(|hit| hit.is_hit()).count() > 500);
                seen.push((Update { top_level: Default::default(), ..update }, hits));
            }
            seen
        })
    };
    let expected = run(1);
    for threads in [2, 3, 5] {
        assert_eq!(run(threads), expected);
    }
}

#[test]
fn a_refit_of_the_same_boxes_is_the_tree_that_was_built() {
    let rng = &mut Rng::new(23);
    let (mut builder, ..) = crowd(300, rng);
    builder.commit().unwrap();
    let world = builder.scene().world().expect("instances");
    let (mut top, mut again) = (TopLevel::default(), TopLevel::default());
    top.build(&world.placements, None);
    again.build(&world.placements, None);
    again.refit(&world.placements, None);
    assert_eq!(format!("{top:?}"), format!("{again:?}"));
}
