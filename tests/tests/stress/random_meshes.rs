//! Random meshes, with and without defects, in every structure against the exact oracle.

use bth::rays::Hit;
use bth_scenes::Model;
use bth_tests::oracle;
use bth_tests::rays::assorted;
use bth_tests::structures::{bits, every_structure};
use proptest::prelude::*;

/// A closed surface: circles of latitude around a point, of random radii.
fn closed() -> impl Strategy<Value = Model> {
    (3usize..7, 3usize..9).prop_flat_map(|(rings, around)| {
        prop::collection::vec(0.25f32..1.0, (rings - 1) * around + 2).prop_map(move |radii| {
            let mut model = Model::default();
            let at = |ring: usize, i: usize, radius: f32| {
                let up = std::f32::consts::PI * ring as f32 / rings as f32;
                let turn = std::f32::consts::TAU * i as f32 / around as f32;
                [up.sin() * turn.cos(), up.sin() * turn.sin(), up.cos()].map(|x| x * radius)
            };
            for ring in 1..rings {
                for i in 0..around {
                    model.positions.push(at(ring, i, radii[(ring - 1) * around + i]));
                }
            }
            let [top, bottom] = [0, 1].map(|i| ((rings - 1) * around + i) as u32);
            model.positions.extend([[0.0, 0.0, radii[top as usize]], [0.0, 0.0, -radii[bottom as usize]]]);
            let row = |ring: usize, i: usize| ((ring - 1) * around + i % around) as u32;
            for i in 0..around {
                model.triangles.push([top, row(1, i), row(1, i + 1)]);
                model.triangles.push([bottom, row(rings - 1, i + 1), row(rings - 1, i)]);
                for ring in 1..rings - 1 {
                    let [a, b, c, d] =
                        [row(ring, i), row(ring + 1, i), row(ring + 1, i + 1), row(ring, i + 1)];
                    model.triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
            model
        })
    })
}

fn any_triangles(position: impl Strategy<Value = [f32; 3]>) -> impl Strategy<Value = Model> {
    prop::collection::vec(position, 3..30).prop_flat_map(|positions| {
        let row = 0..positions.len() as u32;
        prop::collection::vec(prop::array::uniform3(row), 1..60)
            .prop_map(move |triangles| Model { positions: positions.clone(), triangles })
    })
}

/// Triangles anywhere, of any size.
fn soup() -> impl Strategy<Value = Model> {
    any_triangles(prop::array::uniform3(prop_oneof![-1.0f32..1.0, -1e-3f32..1e-3, -1e4f32..1e4]))
}

/// Triangles on few integer points: duplicates, coplanar overlaps, collinear ones, T-junctions.
fn degenerate() -> impl Strategy<Value = Model> {
    any_triangles(prop::array::uniform3((-2i32..3).prop_map(|x| x as f32)))
}

/// What every structure must answer.
fn check(model: &Model, seed: u64) -> Result<(), TestCaseError> {
    let corners: Vec<_> = (0..model.triangles.len()).map(|i| model.corners(i)).collect();
    let rays = assorted(&corners, 66, seed);
    let mut expected = vec![Hit::MISS; rays.len()];
    for (i, traced) in every_structure(model, false).iter().enumerate() {
        let mut hits = vec![Hit::MISS; rays.len()];
        traced.scene.batch(&rays).nearest(&mut hits);
        if i == 0 {
            expected.clone_from(&hits);
        }
        for ((ray, hit), first) in rays.iter().zip(&hits).zip(&expected) {
            prop_assert_eq!(bits(hit), bits(first), "{}: {:?}", &traced.name, ray);
            prop_assert_eq!(traced.scene.any(ray), hit.is_hit(), "{}: {:?}", &traced.name, ray);
        }
    }
    for (ray, hit) in rays.iter().zip(&expected) {
        let Some(truth) = oracle::nearest(&corners, ray) else {
            prop_assert!(!hit.is_hit(), "ghost: {ray:?} {hit:?}");
            continue;
        };
        prop_assert!(hit.is_hit(), "miss: {ray:?}, exactly {truth:?}");
        let t = truth.t_f64() as f32;
        // The quotient is rounded twice here.
        prop_assert!(
            hit.t == t || hit.t.to_bits().abs_diff(t.to_bits()) <= 1,
            "t: {hit:?}, exactly {truth:?}"
        );
        if !truth.triangles.contains(&hit.primitive.triangle) {
            let at = oracle::intersection(ray, corners[hit.primitive.triangle as usize]);
            let gap = at.map(|at| (oracle::to_f64(&at.t) - truth.t_f64()).abs());
            prop_assert!(
                gap.is_some_and(|gap| gap <= truth.t_f64().abs() * 1e-12),
                "{hit:?}, exactly {truth:?}"
            );
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn closed_surfaces_are_traced_exactly(model in closed(), seed in any::<u64>()) {
        check(&model, seed)?;
    }

    #[test]
    fn soups_are_traced_exactly(model in soup(), seed in any::<u64>()) {
        check(&model, seed)?;
    }

    #[test]
    fn degenerate_mixes_are_traced_exactly(model in degenerate(), seed in any::<u64>()) {
        check(&model, seed)?;
    }
}
