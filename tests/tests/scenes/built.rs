//! Scenes that a builder makes at run time have the bits of the same scenes compiled from a
//! manifest, on every instruction set and with any number of threads.

use crate::support::{compiled, manifest, models, options, varied};
use bth::rays::{Hit, Ray};
use bth::{Accept, Isa, Scene, SceneBuilder};
use bth_compile::Silent;
use bth_compile::pipeline::CompileOptions;
use bth_random::Rng;
use std::fmt::Write;
use std::path::Path;
use std::sync::Mutex;

/// Held by tests that choose the process's instruction set.
pub(crate) static CHOICE: Mutex<()> = Mutex::new(());

pub(crate) const IDENTITY: [f32; 12] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];

/// A random transform, sheared and in half of the cases mirrored, of any of several sizes.
pub(crate) fn transform(rng: &mut Rng) -> [f32; 12] {
    let size = [1.0, 0.1, 3.0, 1e-3][rng.below(4) as usize];
    let mut m = [0.0; 12];
    for (i, x) in m.iter_mut().enumerate() {
        let unit = rng.unit_f32() * 2.0 - 1.0;
        *x = match (i % 4 == 3, i / 4 == i % 4) {
            (true, _) => unit * 12.0,
            (false, true) => (unit + unit.signum()) * size,
            (false, false) => unit * size * 0.6,
        };
    }
    m
}

pub(crate) fn rays(scene: &Scene, rng: &mut Rng, count: usize) -> Vec<Ray> {
    let boxes: Vec<_> = (0..scene.instance_count()).filter_map(|i| scene.instance_bounds(i)).collect();
    (0..count)
        .map(|i| {
            let (lower, upper) = boxes[rng.below(boxes.len() as u64) as usize];
            let target = [0, 1, 2].map(|k| lower[k] + rng.unit_f32() * (upper[k] - lower[k]));
            let mut distance = if i % 3 == 0 { 0.5 } else { 30.0 };
            // From afar all points of a tiny box are one in f32, and all triangles need exact
            // arithmetic: one ray in ten starts there.
            let size = (0..3).fold(0.0f32, |size, k| size.max(upper[k] - lower[k]));
            if size < 1e-6 && i % 10 > 0 {
                distance *= size;
            }
            let origin = target.map(|x| x + distance * (rng.unit_f32() - 0.5));
            Ray::new(origin, [0, 1, 2].map(|k| target[k] - origin[k]))
        })
        .collect()
}

/// Compares all queries of two scenes. The second has the object indices of the first plus
/// `objects`, and the same instance ids. Returns how many rays hit.
pub(crate) fn compare(a: &Scene, b: &Scene, objects: u32, rng: &mut Rng) -> usize {
    let rays = rays(a, rng, 1500);
    let (mut hits, mut found) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
    a.batch(&rays).nearest(&mut hits);
    a.batch(&rays).any(&mut found);
    // All other queries, of fewer rays; `hit` is the nearest one in both scenes.
    let answers = |scene: &Scene, (ray, hit): (&Ray, &Hit)| {
        let (mut all, mut triangles) = (vec![], vec![]);
        scene.all_hits(ray, &Accept::default(), &mut all);
        scene.triangles_in_sphere(ray.origin, 1.5, &mut triangles);
        let closest = scene.closest(ray.origin, f32::INFINITY);
        let around = (scene.crossings(ray), scene.winding(ray.origin), closest, triangles);
        (all, around, scene.surface(hit))
    };
    let some: Vec<(&Ray, &Hit)> = rays.iter().zip(&hits).step_by(25).collect();
    let expected: Vec<_> = some
        .iter()
        .map(|query| {
            let mut expected = answers(a, *query);
            expected.2.iter_mut().for_each(|point| point.object += objects);
            expected
        })
        .collect();
    let _choice = CHOICE.lock();
    let chosen = Isa::chosen();
    for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
        isa.choose().unwrap();
        for threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let (mut ours, mut any) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
            pool.install(|| b.batch(&rays).parallel().nearest(&mut ours));
            pool.install(|| b.batch(&rays).parallel().any(&mut any));
            assert!(ours == hits && any == found, "{isa}, {threads} threads");
        }
        for (query, expected) in some.iter().zip(&expected) {
            assert_eq!(&answers(b, *query), expected, "{isa}");
        }
    }
    chosen.choose().unwrap();
    found.iter().filter(|found| **found).count()
}

#[test]
fn instances_placed_at_run_time_have_the_bits_of_a_manifest() {
    let folder = models();
    let object = |name: &str| {
        let path = folder.path().join(name);
        let (compiled, _) = bth_compile::pipeline::compile(&path, &options(), &Silent).unwrap();
        bth::from_bytes(&compiled.bytes).unwrap()
    };
    let mut builder = SceneBuilder::new();
    let [knot, quad] = [object("knot.ply"), object("quad.obj")].map(|scene| builder.add(&scene));
    let rng = &mut Rng::new(3);
    let mut hits = 0;
    let mut places: Vec<[f32; 12]> = (0..120).map(|_| transform(rng)).collect();
    for (i, place) in places.iter().enumerate() {
        builder.instance(if i % 3 == 0 { quad } else { knot }, place).unwrap();
    }
    for step in 0..4 {
        let mut text = "objects = [{ name = \"knot\", model = \"knot.ply\" }, { name = \"quad\", model = \"quad.obj\" }]\n\
                        nodes = [\n"
            .to_owned();
        for (i, m) in places.iter().enumerate() {
            let name = if i % 3 == 0 { "quad" } else { "knot" };
            let row = |k: usize| format!("{:?}", [0, 1, 2, 3].map(|j| f64::from(m[4 * k + j])));
            let (a, b, c) = (row(0), row(1), row(2));
            writeln!(text, "  {{ name = \"n{i}\", object = \"{name}\", matrix = [{a}, {b}, {c}] }},")
                .unwrap();
        }
        text += "]\n";
        let (scene, _) = compiled(&manifest(&text), folder.path());
        let ids: Vec<u32> = (0..places.len() as u32).collect();
        builder.set_transforms(&ids, &places).unwrap();
        let update = builder.commit().unwrap();
        assert_eq!((update.visible, update.placed), (120, 120));
        for id in ids {
            assert_eq!(scene.instance(id).to_world, builder.scene().instance(id).to_world);
            assert_eq!(scene.instance_bounds(id), builder.scene().instance_bounds(id));
        }
        hits += compare(&scene, builder.scene(), 0, rng);
        // Some move a little, so that the top level is refitted, and in the end all.
        let moved = [7, 1, 1, 1][step];
        places.iter_mut().step_by(moved).for_each(|m| m[3 + 4 * (step % 3)] += rng.unit_f32() * 0.25);
    }
    assert!(hits > 1500, "{hits}");
}

#[test]
fn a_file_placed_as_a_whole_moves_as_it_does_alone() {
    let folder = models();
    let (mut alone, _) = compiled(&varied(), folder.path());
    let mut builder = SceneBuilder::new();
    let first = builder.add(&alone);
    let subscene = builder.subscene(first, &IDENTITY).unwrap();
    let rng = &mut Rng::new(9);
    let mut hits = 0;
    for frame in [0, 3, 12, 13, 30, 40, 7] {
        let expected = alone.set_frame(frame).unwrap();
        builder.set_subscene_seconds(subscene, f64::from(frame) / 10.0).unwrap();
        let update = builder.commit().unwrap();
        assert_eq!(update.visible, expected.visible, "frame {frame}");
        for id in 0..alone.instance_count() {
            assert_eq!(alone.instance(id), builder.scene().instance(id), "frame {frame}");
        }
        hits += compare(&alone, builder.scene(), 0, rng);
    }
    assert!(hits > 3000, "{hits}");
    // A second one at another time and place, next to an instance.
    let mut other = Vec::new();
    builder.instance(first, &[1.0, 0.0, 0.0, 50.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]).unwrap();
    let moved = [1.0, 0.0, 0.0, 256.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let second = builder.subscene(first, &moved).unwrap();
    builder.set_subscene_seconds(second, 2.5).unwrap();
    builder.commit().unwrap();
    alone.set_frame(25).unwrap();
    other.extend_from_slice(builder.subscene_instances(second).unwrap());
    for (row, id) in (0..).zip(other) {
        let (view, expected) = (builder.scene().instance(id), alone.instance(row));
        let mut to_world = expected.to_world;
        to_world[0][3] += 256.0;
        assert_eq!((view.to_world, view.visible, view.node), (to_world, expected.visible, expected.node));
    }
}

#[test]
fn names_and_groups_lead_back_to_the_file_of_each_object() {
    let folder = models();
    let text = r#"objects = [{ name = "trunk", model = "knot.ply" }, { name = "leaf", model = "quad.obj" }]
nodes = [{ name = "a", object = "trunk" }, { name = "b", object = "leaf", translation = [9, 0, 0] }]
"#;
    let named = CompileOptions { names: true, ..options() };
    let path = Path::new("tree.manifest");
    let (tree, _) =
        bth_compile::scene::compile(&manifest(text), folder.path(), path, &named, &Silent).unwrap();
    let tree = bth::from_bytes(&tree.bytes).unwrap();
    let (compiled, _) =
        bth_compile::pipeline::compile(Path::new(&folder.path().join("quad.obj")), &options(), &Silent)
            .unwrap();
    let mut builder = SceneBuilder::new();
    let plain = builder.add(&bth::from_bytes(&compiled.bytes).unwrap());
    let first = builder.add(&tree);
    let leaf = (0..tree.object_count()).find(|i| tree.object_name(*i) == "leaf").unwrap();
    let id = builder.instance(first + leaf, &IDENTITY).unwrap();
    let other =
        builder.instance(plain, &[1.0, 0.0, 0.0, 5.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]).unwrap();
    builder.commit().unwrap();
    let scene = builder.scene();
    for (x, instance, name) in [(0.3, id, "leaf"), (5.3, other, "")] {
        let hit = scene.nearest(&Ray::new([x, 4.0, 0.2], [0.0, -1.0, 0.0])).expect("a quad");
        assert_eq!(hit.primitive.instance, instance);
        let object = scene.surface(&hit).unwrap().object;
        assert_eq!(scene.object_name(object), name);
        let (file, row) = scene.file_of(object);
        assert_eq!(file.object_name(row), name);
    }
}
