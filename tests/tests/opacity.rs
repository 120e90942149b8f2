//! Rays through holes: all queries against the hits of a file without opacity, each judged by the
//! alpha of its texture.

use bth::rays::{Hit, Ray, StartRay};
use bth::{Accept, Isa, Opacity, Scene, TraceRay};
use bth_compile::Silent;
use bth_compile::pipeline::{CompileOptions, Structure, compile};
use bth_import::AlphaMode;
use bth_import::gltf::scene::{ImportOptions, import};
use bth_random::Rng;
use bth_tests::leaves;
use bth_tests::structures::{bits, options};
use std::fmt::Debug;
use std::path::Path;
use std::sync::{Mutex, MutexGuard};

const LEAVES: usize = 60;

/// The instruction set is a setting of the whole process, so tests that set it run one after the
/// other.
fn turn() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(|e| e.into_inner())
}

fn with_model<T>(work: impl FnOnce(&Path) -> T) -> T {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("leaves.glb");
    std::fs::write(&path, leaves::tree(LEAVES, 1)).unwrap();
    work(&path)
}

/// The model with an alpha mode as one object, verified.
fn flat(alpha: AlphaMode, options: CompileOptions) -> Scene {
    let (compiled, report) =
        with_model(|path| compile(path, &CompileOptions { alpha, ..options }, &Silent).unwrap());
    let file = bth_format::File::from_bytes(&compiled.bytes).unwrap();
    bth_format::verify::verify(&file).unwrap_or_else(|e| panic!("{}", e[0]));
    match report.mesh.opacity {
        None => assert!(alpha == AlphaMode::None),
        Some(opacity) => {
            assert_eq!(opacity.triangles, 4 * LEAVES as u64);
            assert_eq!(
                (opacity.subdivided, opacity.patterns),
                (opacity.triangles, 4),
                "two halves of leaves, and mirrored"
            );
            assert!(
                opacity.unknown < 0.2 && opacity.opaque > 0.3 && opacity.transparent > 0.2,
                "{opacity:?}"
            );
        }
    }
    bth::from_bytes(&compiled.bytes).unwrap()
}

/// The model with an alpha mode as a scene with an instance and a mirrored one.
fn placed(alpha: AlphaMode) -> Scene {
    with_model(|path| {
        let (manifest, _) = import(path, "leaves.glb", &ImportOptions::default(), &Silent).unwrap();
        let options = CompileOptions { alpha, ..options(Structure::Bvh) };
        let (compiled, _) =
            bth_compile::scene::compile(&manifest, path.parent().unwrap(), path, &options, &Silent).unwrap();
        bth::from_bytes(&compiled.bytes).unwrap()
    })
}

/// Rays through the crown in all directions; some end in it, some start in it.
fn rays(count: usize) -> Vec<Ray> {
    let mut random = Rng::new(9);
    (0..count)
        .map(|k| {
            let mut point = |size: f64| {
                let p = random.point_in_ball();
                [(size * p[0]) as f32, (1.6 + size * p[1]) as f32, (size * p[2]) as f32]
            };
            let (origin, target) = (point(if k % 3 == 0 { 1.0 } else { 5.0 }), point(1.2));
            let ray = Ray::new(origin, [0, 1, 2].map(|k| target[k] - origin[k]));
            match k % 5 {
                0 => Ray { tmax: 1.0, ..ray },
                1 => Ray { tmin: 0.5, ..ray },
                _ => ray,
            }
        })
        .collect()
}

/// Rays from leaves, also from holes in them, and from the hits of rays.
fn starts(scene: &Scene, rays: &[Ray], instances: u32) -> Vec<StartRay> {
    let corners: Vec<_> = (scene.object(0).triangles.iter())
        .map(|t| t.map(|v| scene.object(0).positions[v as usize]))
        .collect();
    let mut all = bth_tests::rays::starts(&corners, 1000, 4);
    for (ray, instance) in all.iter_mut().zip((0..instances).cycle()) {
        ray.start.primitive.instance = instance;
    }
    let hits = bth_tests::rays::alone(scene, rays);
    all.extend(hits.iter().zip(&rays[1..]).map(|(hit, ray)| StartRay::from_hit(hit, ray.direction)));
    all
}

/// Alpha of a leaf's texture at a hit, interpolated bilinearly in f64; `None` for the floor. Both
/// triangles of a leaf have the corner (0, 0) first: then (1, 0) and (1, 1), or (1, 1) and (0, 1).
/// In mirrored meshes the last two are exchanged.
fn alpha(texture: &[u8], hit: &Hit, mirrored: bool) -> Option<f64> {
    let in_mesh = hit.primitive.triangle as usize % (2 * LEAVES + 2);
    if in_mesh >= 2 * LEAVES {
        return None;
    }
    let (u, v) = (f64::from(hit.u), f64::from(hit.v));
    let (second, third) = if mirrored { (v, u) } else { (u, v) };
    let uv = if in_mesh.is_multiple_of(2) { [second + third, third] } else { [second, second + third] };
    let n = f64::from(leaves::TEXELS);
    let [x, y] = uv.map(|x| x * n - 0.5);
    let texel = |x: f64, y: f64| {
        let [x, y] = [x, y].map(|k| k.clamp(0.0, n - 1.0) as usize);
        f64::from(texture[y * leaves::TEXELS as usize + x]) / 255.0
    };
    let (i, j) = (x.floor(), y.floor());
    let (s, t) = (x - i, y - j);
    let row = |j: f64| (1.0 - s) * texel(i, j) + s * texel(i + 1.0, j);
    Some((1.0 - t) * row(j) + t * row(j + 1.0))
}

/// The hits of a ray that are not transparent, after each was compared with its alpha.
fn judged(scene: &Scene, all: &[Hit], flat: bool) -> Vec<Hit> {
    let texture = leaves::alpha();
    let keep = |hit: &&Hit| {
        let mirrored = flat && hit.primitive.triangle as usize >= 2 * LEAVES + 2;
        let state = scene.opacity(hit);
        match alpha(texture, hit, mirrored) {
            None => assert_eq!(state, Opacity::Opaque),
            Some(alpha) => match state {
                Opacity::Opaque => assert!(alpha >= leaves::CUTOFF, "{hit:?}: {alpha}"),
                Opacity::Transparent => assert!(alpha < leaves::CUTOFF, "{hit:?}: {alpha}"),
                Opacity::Unknown => {}
            },
        }
        state != Opacity::Transparent
    };
    all.iter().filter(keep).copied().collect()
}

/// Compares all queries of a scene with holes; `opaque` is the same without. Returns how many
/// transparent hits lay before the nearest that counts.
fn compare<R: TraceRay + Debug>(opaque: &Scene, scene: &Scene, rays: &[R], flat: bool) -> usize {
    let everything = Accept::default();
    let (mut passed, mut all, mut found) = (0, Vec::new(), Vec::new());
    let mut expected = Vec::new();
    for ray in rays {
        opaque.all_hits(ray, &everything, &mut all);
        let left = judged(scene, &all, flat);
        let first = left.first().copied().unwrap_or(Hit::MISS);
        passed += all.iter().take_while(|hit| bits(hit) != bits(&first)).count();
        assert_eq!(bits(&scene.nearest(ray).unwrap_or(Hit::MISS)), bits(&first), "{ray:?}");
        assert_eq!(bits(&scene.nearest_counted(ray).0), bits(&first), "{ray:?}");
        assert_eq!(scene.any(ray), !left.is_empty(), "{ray:?}");
        scene.all_hits(ray, &everything, &mut found);
        assert!(found.iter().map(bits).eq(left.iter().map(bits)), "{ray:?}: {found:?} {left:?}");
        assert_eq!(scene.count_hits(ray, &everything), left.len());
        scene.nearest_hits(ray, 2, &everything, &mut found);
        assert!(found.iter().map(bits).eq(left.iter().take(2).map(bits)), "{ray:?}");
        // A filter decides what is unknown.
        let certain = |_: &Ray, hit: &Hit| scene.opacity(hit) == Opacity::Opaque;
        let accept = Accept { filter: Some(&certain), ..everything };
        let opaque_first = left.iter().find(|hit| scene.opacity(hit) == Opacity::Opaque);
        let nearest = scene.nearest_accepted(ray, &accept).unwrap_or(Hit::MISS);
        assert_eq!(bits(&nearest), bits(opaque_first.unwrap_or(&Hit::MISS)), "{ray:?}");
        assert_eq!(scene.any_accepted(ray, &accept), opaque_first.is_some());
        expected.push(first);
    }
    let mut hits = vec![Hit::MISS; rays.len()];
    let mut blocked = vec![false; rays.len()];
    scene.batch(rays).nearest(&mut hits);
    scene.batch(rays).any(&mut blocked);
    assert!(hits.iter().map(bits).eq(expected.iter().map(bits)));
    assert!(blocked.iter().zip(&expected).all(|(blocked, hit)| *blocked == hit.is_hit()));
    scene.batch(rays).parallel().nearest(&mut hits);
    assert!(hits.iter().map(bits).eq(expected.iter().map(bits)));
    passed
}

#[test]
fn rays_pass_through_the_holes_of_leaves_in_every_structure_and_on_every_instruction_set() {
    let _turn = turn();
    let bvh = options(Structure::Bvh);
    let opaque = flat(AlphaMode::None, bvh.clone());
    let mut all = vec![("bvh", bvh)];
    if bth_tests::worker().is_some() {
        all.push(("tets", options(Structure::Bth)));
    }
    let rays = rays(1500);
    for (name, options) in all {
        let scene = flat(AlphaMode::Mask, options);
        for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
            isa.choose().unwrap();
            let passed = compare(&opaque, &scene, &rays, true);
            assert!(passed > rays.len() / 10, "{name}: {passed} transparent hits");
            let passed = compare(&opaque, &scene, &starts(&opaque, &rays, 1), true);
            assert!(passed > 100, "{name}: {passed} transparent hits from starts");
        }
        Isa::best().choose().unwrap();
    }
}

#[test]
fn rays_pass_through_the_holes_of_instances() {
    let _turn = turn();
    let (opaque, scene) = (placed(AlphaMode::None), placed(AlphaMode::Mask));
    assert_eq!((scene.object_count(), scene.instance_count()), (1, 2));
    let passed = compare(&opaque, &scene, &rays(1500), false);
    assert!(passed > 150, "{passed} transparent hits");
    let passed = compare(&opaque, &scene, &starts(&opaque, &rays(1500), 2), false);
    assert!(passed > 100, "{passed} transparent hits from starts");
}

#[test]
fn the_exact_oracle_sees_the_same_holes() {
    let _turn = turn();
    let scene = flat(AlphaMode::Mask, options(Structure::Bvh));
    let world = bth_oracle::World::new(&scene);
    for ray in rays(150) {
        let (truth, hit) = (world.hit(ray), scene.nearest(&ray).unwrap_or(Hit::MISS));
        assert_eq!((truth.primitive, truth.t.to_bits()), (hit.primitive, hit.t.to_bits()), "{ray:?}");
        assert_eq!(world.any(ray), scene.any(&ray));
    }
    for ray in starts(&scene, &rays(150), 1).iter().step_by(8) {
        let (truth, hit) = (world.hit(ray), scene.nearest(ray).unwrap_or(Hit::MISS));
        assert_eq!((truth.primitive, truth.t.to_bits()), (hit.primitive, hit.t.to_bits()), "{ray:?}");
    }
}

#[test]
fn crossings_look_at_no_opacity() {
    let _turn = turn();
    let bvh = options(Structure::Bvh);
    let (opaque, scene) = (flat(AlphaMode::None, bvh.clone()), flat(AlphaMode::Mask, bvh));
    for ray in rays(300) {
        assert_eq!(format!("{:?}", opaque.crossings(&ray)), format!("{:?}", scene.crossings(&ray)));
    }
}

#[test]
fn without_the_option_files_are_what_they_were() {
    let scene = flat(AlphaMode::None, options(Structure::Bvh));
    assert!(scene.object(0).opacity.is_empty());
    assert!(!scene.file().provenance().unwrap().contains("alpha"));
}
