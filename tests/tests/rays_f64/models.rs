//! Models with positions in f64: rays of f32, rays in f64 and rays from starts against exact
//! arithmetic, through models in place and through instances.

use super::{CHOICE, check, check_everywhere, rays, unit};
use bth::rays::{Hit, Ray, Ray64, StartRay};
use bth::{Accept, Scene, SegmentEnd, TraceRay};
use bth_compile::Silent;
use bth_compile::cached::Cache;
use bth_compile::memory::{Instance, PositionRows, TriangleMesh, compile_scene};
use bth_compile::pipeline::{CompileOptions, Structure, compile};
use bth_import::Positions;
use bth_random::Rng;
use bth_tests::meshes::mesh;
use bth_tests::oracle::{self, ExactRay, World, to_f64};

type Corners = [[f64; 3]; 3];

/// A mesh in f64: a random one of f32, scaled by a number that f32 does not hold, and moved far
/// away.
fn far_mesh(kind: usize, rng: &mut Rng) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let model = mesh(kind, rng);
    let size = model.positions.iter().flatten().fold(0.0f64, |most, x| most.max(f64::from(x.abs())));
    let scale = [1.1, 0.1][kind % 2];
    let away = [(); 3].map(|()| unit(rng) * size * [0.0, 1.0, 1e6][rng.below(3) as usize]);
    let place = |p: &[f32; 3]| [0, 1, 2].map(|k| away[k] + f64::from(p[k]) * scale);
    (model.positions.iter().map(place).collect(), model.triangles)
}

/// A scene of the mesh: in place, or at some transforms. `None` if nothing of it has an area, or if
/// f32 holds it.
fn scene(positions: &[[f64; 3]], triangles: &[[u32; 3]], places: &[[[f64; 4]; 3]]) -> Option<Scene> {
    let options =
        CompileOptions { structure: Structure::Bvh, positions: Positions::F64, ..CompileOptions::default() };
    let mesh = TriangleMesh { positions: PositionRows::F64(positions), triangles };
    let scene = match places {
        [] => bth::from_bytes(&compile(mesh, &options, &Silent).unwrap().0.bytes),
        _ => {
            let instances: Vec<_> =
                places.iter().map(|to_world| Instance { mesh: 0, to_world: *to_world }).collect();
            let compiled = compile_scene(&[mesh], &instances, &options, &Cache::none(), &Silent).unwrap();
            bth::from_bytes(&compiled.content.unwrap().bytes().unwrap())
        }
    };
    let scene = scene.unwrap();
    let view = scene.object(0);
    (!view.exact.is_empty() && view.header.dropped < view.header.triangles).then_some(scene)
}

/// A transform that turns, scales or mirrors, and moves.
fn place(rng: &mut Rng) -> [[f64; 4]; 3] {
    [0, 1, 2].map(|k| {
        let [x, y, z] = [0, 1, 2].map(|j| unit(rng) + if j == k { 1.5 } else { 0.0 });
        [x, y, z, unit(rng) * 10.0]
    })
}

/// The images of the triangles that have an area, rounded.
pub(crate) fn images(scene: &Scene) -> Vec<Corners> {
    let mut images = Vec::new();
    for instance in 0..scene.instance_count() {
        let rows = scene.instance(instance).to_world;
        let apply = |p: [f64; 3]| rows.map(|[x, y, z, w]| x * p[0] + y * p[1] + z * p[2] + w);
        let view = scene.object(scene.object_of(instance));
        let triangles = oracle::exact_triangles(&view);
        images.extend(triangles.into_iter().map(|(_, corners)| corners.map(apply)));
    }
    images
}

/// Checks rays whose t is a number of f32, and returns the number of those that hit.
fn check_narrow<R>(scene: &Scene, rays: &[R], context: &str) -> usize
where
    R: TraceRay + Into<ExactRay> + std::fmt::Debug,
{
    let (world, mut expected) = (World::new(scene), Vec::new());
    // Exact arithmetic decides about some of many rays.
    let step = rays.len().div_ceil(200);
    for (i, &ray) in rays.iter().enumerate() {
        let hit = scene.nearest(&ray);
        if i % step != 0 {
            expected.push(hit.unwrap_or(Hit::MISS));
            continue;
        }
        let truth = world.nearest(ray);
        let context = || format!("{context}: {ray:?}: {hit:?}, {truth:?}");
        assert_eq!(hit.is_some(), truth.is_some(), "{}", context());
        assert_eq!(scene.any(&ray), truth.is_some(), "any hit, {}", context());
        let mut all = Vec::new();
        scene.all_hits(&ray, &Accept::default(), &mut all);
        assert_eq!(all.first().copied(), hit, "all hits, {}", context());
        expected.push(hit.unwrap_or(Hit::MISS));
        let (Some(hit), Some(truth)) = (hit, &truth) else { continue };
        let t = truth.t_f64();
        assert!((hit.t - t as f32).abs() <= t.abs() as f32 / (1 << 23) as f32, "{}", context());
        // Of triangles whose t f64 does not tell apart, the first.
        let at = world.intersection(ray, hit.primitive).expect("a hit");
        assert!((to_f64(&at.t) - t).abs() <= t.abs() / (1 << 27) as f64, "{}", context());
        let [u, v] = [&at.u, &at.v].map(to_f64);
        let off = (f64::from(hit.u) - u).abs().max((f64::from(hit.v) - v).abs());
        assert!(off <= 1.0 / (1 << 23) as f64, "{}", context());
        let precise = scene.hit_f64(&ray, &hit).t;
        assert!((precise - to_f64(&at.t)).abs() <= t.abs() / (1u64 << 40) as f64, "{}", context());
    }
    check_everywhere(scene, rays, &expected, context)
}

fn narrow(ray: &Ray64) -> Ray {
    let [origin, direction] = [ray.origin, ray.direction].map(|v| v.map(|x| x as f32));
    Ray { origin, direction, tmin: ray.tmin as f32, tmax: ray.tmax as f32 }
}

/// Checks crossings of rays, and visibility between starts, in a model in place.
fn check_sides(scene: &Scene, rays: &[Ray64], starts: &[StartRay], context: &str) {
    let view = scene.object(0);
    let corners: Vec<_> = (0..view.header.triangles).filter_map(|id| view.exact.corners(id)).collect();
    for ray in rays.iter().take(30) {
        assert_eq!(scene.crossings(ray), oracle::crossings(&corners, ray), "{context}: {ray:?}");
    }
    for pair in starts.windows(2).take(30) {
        let ends: [SegmentEnd; 2] = [pair[0].start.into(), pair[1].start.into()];
        let expected = oracle::starts::visible(&corners, ends[0], ends[1]);
        assert_eq!(scene.visible(ends[0], ends[1]), expected, "{context}: {ends:?}");
        assert_eq!(scene.visible(ends[1], ends[0]), expected, "{context}: {ends:?}");
    }
}

#[test]
fn models_in_f64_are_hit_where_exact_arithmetic_says() {
    let _choice = CHOICE.lock();
    let (mut hits, mut counts) = ([0; 3], [0; 3]);
    for seed in 0..bth_tests::by_day(18, 90) {
        let rng = &mut Rng::new(seed);
        let (positions, triangles) = far_mesh(seed as usize % 7, rng);
        let places: Vec<_> = (0..[0, 1, 3][seed as usize % 3]).map(|_| place(rng)).collect();
        let Some(scene) = scene(&positions, &triangles, &places) else { continue };
        let context = format!("seed {seed}");
        let wide = rays(&images(&scene), 60, rng);
        let plain: Vec<Ray> = wide.iter().map(narrow).collect();
        let onward = |ray: &Ray64| Some((scene.nearest(ray)?, ray.direction.map(|x| -x as f32)));
        let starts: Vec<StartRay> =
            wide.iter().filter_map(onward).map(|(hit, back)| StartRay::from_hit(&hit, back)).collect();
        if places.is_empty() {
            check_sides(&scene, &wide, &starts, &context);
        }
        let found = [
            check(&scene, &wide, &context),
            check_narrow(&scene, &plain, &context),
            check_narrow(&scene, &starts, &context),
        ];
        for (i, count) in [wide.len(), plain.len(), starts.len()].into_iter().enumerate() {
            (hits[i], counts[i]) = (hits[i] + found[i], counts[i] + count);
        }
    }
    assert!(hits[0] > counts[0] / 2 && hits[1] > 100 && hits[2] > 50, "{hits:?} of {counts:?}");
}

#[test]
fn packets_through_models_in_f64_have_the_answers_of_single_rays() {
    let _choice = CHOICE.lock();
    let rng = &mut Rng::new(1);
    let model = bth_scenes::gyroid::gyroid(2000);
    for away in [[0.1, 0.2, 0.3], [5.5e6, 4.2e5, 300.0]] {
        let place = |p: &[f32; 3]| [0, 1, 2].map(|k| away[k] + f64::from(p[k]) * 1.1);
        let positions: Vec<_> = model.positions.iter().map(place).collect();
        let scene = scene(&positions, &model.triangles, &[]).expect("a model in f64");
        // A camera, and rays from what it sees.
        let towards = |i: usize| [(i % 32) as f64 / 16.0 - 1.0, (i / 32) as f64 / 16.0 - 1.0, -2.0];
        let eye = [0, 1, 2].map(|k| away[k] + [0.1, 0.2, 4.0][k]);
        let wide: Vec<_> = (0..1024).map(|i| Ray64::new(eye, towards(i))).collect();
        let plain: Vec<Ray> = wide.iter().map(narrow).collect();
        let hits = wide.iter().filter_map(|ray| scene.nearest(ray));
        let starts: Vec<StartRay> =
            hits.map(|hit| StartRay::from_hit(&hit, [(); 3].map(|()| unit(rng) as f32))).collect();
        assert!(check_narrow(&scene, &plain, "camera") > 100);
        assert!(check_narrow(&scene, &starts, "starts") > 100);
        // Rays that f32 cannot follow do not disturb the others.
        let (mut wide, mut batch) = (wide, vec![Hit::MISS; 1024]);
        (wide[77].origin, wide[300].origin) = ([1e39; 3], [1e300, 0.0, 0.0]);
        (wide[500].direction[0], wide[501].direction[1]) = (1e30, f64::NAN);
        wide[502].direction = wide[502].direction.map(|x| x * 1e-30);
        scene.batch(&wide).nearest(&mut batch);
        let alone: Vec<_> = wide.iter().map(|ray| scene.nearest(ray).unwrap_or(Hit::MISS)).collect();
        assert_eq!(batch, alone);
    }
}
