//! Queries for several hits and with conditions agree with the exact oracle, with the nearest hit
//! and any hit, and with each other, in every structure and on every instruction set.

mod instances;

use crate::instances::{instances, world_corners};
use bth::rays::{Hit, PrimitiveRef, Ray};
use bth::{Accept, Cull, Isa, Scene};
use bth_compile::pipeline::Structure;
use bth_format::layout::GridBits;
use bth_random::Rng;
use bth_scenes::{Model, blob::blob, knot::torus_knot, soup::soup};
use bth_tests::oracle::{self, Triangle};
use bth_tests::rays::assorted;
use bth_tests::structures::{Traced, bits, compiled, every_structure, options};
use std::sync::Mutex;

const WHOLE_LINE: (f32, f32) = (f32::NEG_INFINITY, f32::INFINITY);

fn all_bits(hits: &[Hit]) -> Vec<[u32; 5]> {
    hits.iter().map(bits).collect()
}

pub(crate) fn all_hits(scene: &Scene, ray: &Ray, accept: &Accept) -> Vec<Hit> {
    let mut hits = vec![Hit::MISS];
    scene.all_hits(ray, accept, &mut hits);
    hits
}

fn nearest_hits(scene: &Scene, ray: &Ray, k: usize, accept: &Accept) -> Vec<Hit> {
    let mut hits = vec![Hit::MISS];
    scene.nearest_hits(ray, k, accept, &mut hits);
    hits
}

/// A filter that accepts everything, with which the nearest hit and any hit are searched among all
/// candidates.
fn everything(_: &Ray, _: &Hit) -> bool {
    true
}

/// A filter that accepts some of the triangles.
fn some(_: &Ray, hit: &Hit) -> bool {
    let PrimitiveRef { instance, triangle } = hit.primitive;
    (triangle.wrapping_mul(0x9e37_79b9) ^ instance.wrapping_mul(0x85eb_ca6b)) >> 7 & 3 == 0
}

/// The hits of the whole line: exactly the triangles that the oracle finds, each with its t, u and
/// v, and its side.
fn check_against_oracle(scene: &Scene, triangles: &[Triangle], ray: &Ray) -> usize {
    let ray = Ray { tmin: WHOLE_LINE.0, tmax: WHOLE_LINE.1, ..*ray };
    let mut hits = all_hits(scene, &ray, &Accept::default());
    hits.sort_by_key(|hit| hit.primitive.triangle);
    let mut remaining = hits.iter();
    for triangle in triangles {
        let Some(at) = oracle::intersection(ray, triangle.corners) else { continue };
        let t = oracle::to_f64(&at.t) as f32;
        if t.is_infinite() {
            continue;
        }
        let context = || format!("{ray:?}: {triangle:?}, exactly {at:?}");
        let hit = remaining.next().unwrap_or_else(|| panic!("missed: {}", context()));
        assert_eq!(hit.primitive, PrimitiveRef { instance: 0, triangle: triangle.id }, "{}", context());
        assert!(hit.t.to_bits().abs_diff(t.to_bits()) <= 1 || hit.t == t, "t {}: {}", hit.t, context());
        for (found, exact) in [(hit.u, &at.u), (hit.v, &at.v)] {
            let error = (f64::from(found) - oracle::to_f64(exact)).abs();
            assert!(error <= 2f64.powi(-24), "weight {found}: {}", context());
        }
        // The hit with the other side culled.
        let (seen, other) = match oracle::is_front(ray, triangle.corners) {
            true => (Cull::Back, Cull::Front),
            false => (Cull::Front, Cull::Back),
        };
        let only = |_: &Ray, hit: &Hit| hit.primitive.triangle == triangle.id;
        let with = |cull| Accept { cull, filter: Some(&only), ..Accept::default() };
        assert!(scene.any_accepted(&ray, &with(seen)), "side: {}", context());
        assert!(!scene.any_accepted(&ray, &with(other)), "side: {}", context());
    }
    assert_eq!(remaining.next(), None, "ghost: {ray:?}");
    hits.len()
}

/// All queries of a ray against the hits of its whole line.
pub(crate) fn check_queries(scene: &Scene, ray: &Ray, context: &str) {
    let line = Ray { tmin: WHOLE_LINE.0, tmax: WHOLE_LINE.1, ..*ray };
    let in_line = all_hits(scene, &line, &Accept::default());
    let context = || format!("{context}: {ray:?}");
    for filter in [everything, some] {
        let accept = Accept { filter: Some(&filter), ..Accept::default() };
        let in_range = |hit: &Hit| ray.tmin <= hit.t && hit.t <= ray.tmax && filter(ray, hit);
        let expected: Vec<Hit> = in_line.iter().copied().filter(in_range).collect();
        let wanted = all_bits(&expected);
        assert_eq!(all_bits(&all_hits(scene, ray, &accept)), wanted, "{}", context());
        assert_eq!(scene.count_hits(ray, &accept), expected.len(), "{}", context());
        assert_eq!(scene.any_accepted(ray, &accept), !expected.is_empty(), "{}", context());
        let nearest = scene.nearest_accepted(ray, &accept);
        assert_eq!(nearest.as_ref().map(bits), wanted.first().copied(), "{}", context());
        for k in [0, 1, 2, 5, usize::MAX] {
            let first = &wanted[..k.min(wanted.len())];
            assert_eq!(all_bits(&nearest_hits(scene, ray, k, &accept)), first, "{k} of {}", context());
        }
        check_filter_calls(scene, ray, &expected, filter);
    }
    let nearest = scene.nearest(ray);
    let accept = Accept { filter: Some(&everything), ..Accept::default() };
    let accepted = scene.nearest_accepted(ray, &accept);
    assert_eq!(accepted.as_ref().map(bits), nearest.as_ref().map(bits), "{}", context());
    assert_eq!(scene.nearest_accepted(ray, &Accept::default()), nearest);
    assert_eq!(scene.any_accepted(ray, &Accept::default()), nearest.is_some(), "{}", context());
    let by_side = |cull| all_hits(scene, ray, &Accept { cull, ..Accept::default() });
    let (front, back) = (by_side(Cull::Back), by_side(Cull::Front));
    let mut sides = all_bits(&[front.clone(), back.clone()].concat());
    let mut both = all_bits(&by_side(Cull::None));
    sides.sort_unstable();
    both.sort_unstable();
    assert_eq!(sides, both, "{}", context());
    for (cull, hits) in [(Cull::Back, &front), (Cull::Front, &back)] {
        let nearest = scene.nearest_accepted(ray, &Accept { cull, ..Accept::default() });
        assert_eq!(nearest, hits.first().copied(), "{}", context());
    }
}

/// Which hits are passed to the filter of a query for the nearest hit.
fn check_filter_calls(scene: &Scene, ray: &Ray, expected: &[Hit], filter: fn(&Ray, &Hit) -> bool) {
    let calls = Mutex::new(Vec::<Hit>::new());
    let recorded = |ray: &Ray, hit: &Hit| {
        calls.lock().unwrap().push(*hit);
        filter(ray, hit)
    };
    scene.nearest_accepted(ray, &Accept { filter: Some(&recorded), ..Accept::default() });
    let calls = calls.into_inner().unwrap();
    let mut best = f32::INFINITY;
    for (i, hit) in calls.iter().enumerate() {
        assert!(hit.t <= best, "{hit:?} is passed although one at {best} is accepted");
        assert!(calls[..i].iter().all(|before| before.primitive != hit.primitive), "{hit:?} is passed twice");
        if filter(ray, hit) {
            assert!(expected.iter().any(|expected| bits(expected) == bits(hit)), "{hit:?}");
            best = hit.t;
        }
    }
}

/// Rays of every kind, ended at one of their hits, before it or behind it, from the other side as
/// well.
pub(crate) fn rays(scene: &Scene, corners: &[[[f32; 3]; 3]], count: usize, seed: u64) -> Vec<Ray> {
    let mut rng = Rng::new(seed);
    let mut rays = assorted(corners, count, seed);
    for (i, ray) in rays.iter_mut().enumerate() {
        if i % 4 != 0 {
            continue;
        }
        (ray.tmin, ray.tmax) = WHOLE_LINE;
        let hits = all_hits(scene, ray, &Accept::default());
        if hits.is_empty() {
            continue;
        }
        let t = hits[rng.below(hits.len() as u64) as usize].t;
        (ray.tmin, ray.tmax) = match rng.below(5) {
            0 => (t, t),
            1 => (t, f32::INFINITY),
            2 => (f32::NEG_INFINITY, t),
            3 => (t.next_up(), f32::INFINITY),
            _ => (f32::NEG_INFINITY, t.next_down()),
        };
    }
    rays
}

fn for_every_isa(mut check: impl FnMut(Isa)) {
    for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
        isa.choose().unwrap();
        check(isa);
    }
    Isa::best().choose().unwrap();
}

/// Checks a model in every structure. Its triangles are stored as they are.
fn check(model: &Model, whole: bool, ray_count: usize, seed: u64) {
    let traced = every_structure(model, whole);
    let triangles = oracle::triangles(&traced[0].scene.object(0));
    let corners: Vec<_> = triangles.iter().map(|triangle| triangle.corners).collect();
    let rays = rays(&traced[0].scene, &corners, ray_count, seed);
    let most = rays.iter().map(|ray| check_against_oracle(&traced[0].scene, &triangles, ray)).max();
    assert!(most > Some(2), "{most:?} hits");
    let everything = Accept::default();
    let (mut offsets, mut hits) = (Vec::new(), Vec::new());
    traced[0].scene.all_hits_batch(&rays, &everything, &mut offsets, &mut hits);
    for Traced { name, scene } in &traced {
        for_every_isa(|isa| {
            let (mut same_offsets, mut same_hits) = (Vec::new(), Vec::new());
            scene.all_hits_batch(&rays, &everything, &mut same_offsets, &mut same_hits);
            assert_eq!(same_offsets, offsets, "{name}, {isa}");
            assert_eq!(all_bits(&same_hits), all_bits(&hits), "{name}, {isa}");
        });
        for ray in &rays {
            check_queries(scene, ray, name);
        }
    }
}

#[test]
fn a_closed_knot() {
    check(&torus_knot(720), true, 300, 1);
}

#[test]
fn soup_that_intersects_itself() {
    check(&soup(500), false, 300, 2);
}

#[test]
fn scales_of_1e30_and_1e_minus_30() {
    for scale in [1e30_f32, 1e-30] {
        let mut model = torus_knot(400);
        model.positions.iter_mut().for_each(|p| *p = p.map(|x| x * scale));
        check(&model, false, 150, 3);
    }
}

/// Layers of squares with integer coordinates, each triangle twice, the second time with another
/// first vertex or the other way round.
pub(crate) fn layers(n: i32) -> Model {
    let mut model = Model::default();
    for (z, x, y) in (0..n * n * n).map(|i| (i / n / n, i / n % n, i % n)) {
        let first = model.positions.len() as u32;
        let corners = [(0, 0), (1, 0), (1, 1), (0, 1)];
        model.positions.extend(corners.map(|(i, j)| [(x + i) as f32, (y + j) as f32, z as f32]));
        let [a, b, c, d] = [first, first + 1, first + 2, first + 3];
        model.triangles.extend([[a, b, c], [a, c, d], [b, c, a], [d, c, a]]);
    }
    model
}

#[test]
fn duplicates_and_shared_edges_and_vertices() {
    check(&layers(4), false, 400, 4);
}

#[test]
fn a_ray_through_a_vertex_of_layers_hits_every_triangle_around_it_on_each_layer_in_order() {
    let scene = compiled(&layers(3), &options(Structure::Bvh));
    let ray = Ray::new([1.0, 1.0, -5.0], [0.0, 0.0, 2.0]);
    let hits = all_hits(&scene, &ray, &Accept::default());
    // Around an inner vertex lie four squares: of two of them both triangles, of the others one,
    // and all of them twice.
    assert_eq!(hits.len(), 3 * 2 * 6, "{hits:?}");
    for (i, hit) in hits.iter().enumerate() {
        assert_eq!(hit.t, [2.5, 3.0, 3.5][i / 12]);
    }
    let keys: Vec<_> = hits.iter().map(|hit| (hit.t.to_bits(), hit.primitive.triangle)).collect();
    assert!(keys.is_sorted(), "{keys:?}");
    // From below the vertices of three of four triangles appear clockwise.
    let front = all_hits(&scene, &ray, &Accept { cull: Cull::Back, ..Accept::default() });
    assert!(front.iter().all(|hit| hit.primitive.triangle % 4 == 3), "{front:?}");
    assert_eq!(front.len(), 3 * 3);
    // A ray in the plane of a layer hits none of its triangles.
    let along = Ray { origin: [-1.0, 0.5, 1.0], direction: [1.0, 0.0, 0.0], ..ray };
    assert_eq!(all_hits(&scene, &along, &Accept::default()), []);
}

#[test]
fn grids_and_tetrahedra_on_grids() {
    let mut structures = vec![Structure::Bvh];
    if bth_tests::worker().is_some() {
        structures.extend([Structure::Tets, Structure::Bth]);
    }
    for structure in structures {
        for grid in GridBits::ALL {
            let mut options = options(structure);
            options.coordinates.bits = Some(grid);
            let scene = compiled(&blob(400), &options);
            let triangles = oracle::triangles(&scene.object(0));
            let corners: Vec<_> = triangles.iter().map(|triangle| triangle.corners).collect();
            for ray in rays(&scene, &corners, 150, 5) {
                check_against_oracle(&scene, &triangles, &ray);
                check_queries(&scene, &ray, &format!("{structure:?}, {grid:?}"));
            }
        }
    }
}

#[test]
fn rays_without_a_line_hit_nothing() {
    let ray = Ray::new([0.0; 3], [0.0, 0.0, 1.0]);
    let bad = [
        Ray { direction: [0.0; 3], ..ray },
        Ray { direction: [f32::NAN, 0.0, 1.0], ..ray },
        Ray { direction: [f32::INFINITY, 0.0, 1.0], ..ray },
        Ray { origin: [f32::NAN; 3], ..ray },
        Ray { origin: [f32::INFINITY, 0.0, 0.0], ..ray },
        Ray { tmin: f32::NAN, ..ray },
        Ray { tmax: f32::NAN, ..ray },
        Ray { tmin: 2.0, tmax: 1.0, ..ray },
    ];
    let mut scenes: Vec<Scene> =
        every_structure(&torus_knot(400), true).into_iter().map(|traced| traced.scene).collect();
    scenes.push(instances());
    for scene in &scenes {
        for ray in &bad {
            assert_eq!(all_hits(scene, ray, &Accept::default()), [], "{ray:?}");
            let accept = Accept { filter: Some(&everything), ..Accept::default() };
            assert_eq!(scene.nearest_accepted(ray, &accept), None, "{ray:?}");
            assert!(!scene.any_accepted(ray, &accept), "{ray:?}");
        }
    }
}

#[test]
fn batches_give_the_results_of_single_rays() {
    let scene = instances();
    let rays = rays(&scene, &world_corners(&scene), 300, 9);
    for accept in [
        Accept::default(),
        Accept { cull: Cull::Front, ..Accept::default() },
        Accept { filter: Some(&some), ..Accept::default() },
    ] {
        let (mut nearest, mut any) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
        let mut counts = vec![0; rays.len()];
        scene.nearest_accepted_batch(&rays, &accept, &mut nearest);
        scene.any_accepted_batch(&rays, &accept, &mut any);
        scene.count_hits_batch(&rays, &accept, &mut counts);
        let (mut offsets, mut hits) = (vec![7], vec![Hit::MISS]);
        scene.all_hits_batch(&rays, &accept, &mut offsets, &mut hits);
        let (mut k_offsets, mut k_hits) = (vec![7], vec![Hit::MISS]);
        scene.nearest_hits_batch(&rays, 3, &accept, &mut k_offsets, &mut k_hits);
        assert_eq!((offsets.len(), k_offsets.len()), (rays.len() + 1, rays.len() + 1));
        for (i, ray) in rays.iter().enumerate() {
            let expected = all_hits(&scene, ray, &accept);
            assert_eq!(hits[offsets[i]..offsets[i + 1]], expected);
            assert_eq!(k_hits[k_offsets[i]..k_offsets[i + 1]], expected[..expected.len().min(3)]);
            assert_eq!(nearest[i], expected.first().copied().unwrap_or(Hit::MISS));
            assert_eq!((any[i], counts[i]), (!expected.is_empty(), expected.len()));
        }
    }
    let (mut offsets, mut hits) = (vec![], vec![Hit::MISS]);
    scene.all_hits_batch::<Ray>(&[], &Accept::default(), &mut offsets, &mut hits);
    assert_eq!((offsets, hits), (vec![0], vec![]));
}
