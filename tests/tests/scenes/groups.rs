//! Groups of manifests: what their files show, at several times, and compiled files as a whole.

use crate::support::{compiled, manifest, models, options, varied};
use bth::rays::{Hit, Ray};
use bth_compile::pipeline::CompileOptions;
use bth_compile::{Silent, scene};
use bth_random::Rng;
use std::path::Path;

/// A grove of knots and quads in a forest, a group that moves inside, and plain objects.
const FOREST: &str = r#"
frames = { first = 0, last = 20, rate = 10 }
objects = [{ name = "knot", model = "knot.ply" }, { name = "quad", model = "quad.obj" }]
nodes = [
    { name = "second forest", group = "forest", translation = [0, 0, 40], scale = [1, -1.5, 1] },
    { name = "leaf", parent = "branch", object = "knot", translation = [0, 4, 0] },
    { name = "grove" },
    { name = "branch", parent = "grove", rotation = { axis = [0, 0, 1], degrees = 30 } },
    { name = "ground", parent = "grove", object = "quad", scale = [9, 1, 9] },
    { name = "forest", translation = [1, 0, 0] },
    { name = "west", parent = "forest", group = "grove", translation = [-10, 0, 0] },
    { name = "east", parent = "forest", group = "grove", translation = [10, 0, 0], rotation = { axis = [0, 1, 0], degrees = 50 } },
    { name = "rock", parent = "forest", object = "knot", scale = [0.5, 0.5, 2] },
    { name = "first forest", group = "forest" },
    { name = "alone", object = "quad", translation = [0, 20, 0] },
    { name = "hidden", group = "grove", visible = false },
]
[[tracks]]
node = "branch"
property = "rotation"
times = [0, 1, 2]
values = [{ axis = [0, 0, 1], degrees = 0 }, { axis = [0, 1, 1], degrees = 120 }, { axis = [0, 0, 1], degrees = 240 }]
[[tracks]]
node = "west"
property = "visible"
times = [0, 1]
values = [true, false]
[[tracks]]
node = "first forest"
property = "translation"
times = [0, 2]
values = [[0, 0, 0], [3, 1, -2]]
"#;

/// The scene as a scene builder shows it with all groups written out.
fn written_out(scene: &bth::Scene) -> bth::SceneBuilder {
    let mut builder = bth::SceneBuilder::new();
    builder.add(scene);
    for i in 0..scene.instance_count() {
        let of = scene.instance(i);
        let id =
            builder.instance(of.object, of.to_world.as_flattened().first_chunk::<12>().unwrap()).unwrap();
        builder.set_visible(id, of.visible).unwrap();
    }
    builder.commit().unwrap();
    builder
}

/// Random rays to the boxes of visible instances.
fn rays(scene: &bth::Scene, seed: u64) -> Vec<Ray> {
    let mut rng = Rng::new(seed);
    let boxes: Vec<bth::Bounds> =
        (0..scene.instance_count()).filter_map(|i| scene.instance_bounds(i)).collect();
    let mut point = || {
        let (lower, upper) = boxes[rng.below(boxes.len() as u64) as usize];
        [0, 1, 2].map(|k| lower[k] + (upper[k] - lower[k]) * rng.unit_f32())
    };
    let ray = |_| {
        let (from, to) = (point(), point());
        Ray::new(from, [0, 1, 2].map(|k| to[k] - from[k]))
    };
    (0..500).map(ray).collect()
}

/// The nearest hits of the rays.
fn hits(scene: &bth::Scene, rays: &[Ray]) -> Vec<Hit> {
    let mut hits = vec![Hit::MISS; rays.len()];
    scene.batch(rays).nearest(&mut hits);
    hits
}

#[test]
fn groups_of_a_manifest_are_shown_wherever_nodes_name_them() {
    let folder = models();
    let (mut scene, report) = compiled(&manifest(FOREST), folder.path());
    assert_eq!((report.instances, report.rows), (11, 8));
    assert_eq!((scene.instance_count(), scene.row_count(), scene.has_groups()), (11, 8, true));
    assert_eq!(report.instanced_triangles, 6 * report.objects[0].triangles + 5 * 2);
    let view = scene.description().unwrap();
    let names = |i: u32| -> Vec<&str> {
        let rows = scene.instance_path(i);
        rows.iter().map(|row| view.node_name(view.instances[*row as usize].node)).collect()
    };
    // Nodes are in the order of their depth.
    assert_eq!((names(0), names(1)[2]), (vec!["second forest", "west", "ground"], "leaf"));
    assert_eq!(names(4), ["second forest", "rock"]);
    assert_eq!((names(10), names(9)), (vec!["alone"], vec!["first forest", "rock"]));
    assert_eq!(scene.instance(4).to_world[1], [0.0, -0.75, 0.0, 0.0]);
    assert_eq!(scene.instance(4).to_world[2], [0.0, 0.0, 2.0, 40.0]);
    let mut rng = Rng::new(1);
    for frame in [0, 5, 10, 20, 3] {
        scene.set_frame(frame).unwrap();
        let flat = written_out(&scene);
        let rays = rays(&scene, rng.next());
        let found = hits(&scene, &rays);
        assert_eq!(scene.instance(0).visible, frame < 10);
        assert_eq!(found, hits(flat.scene(), &rays));
        let rays_hit = found.iter().filter(|hit| hit.is_hit()).count();
        assert!(rays_hit > 30, "{rays_hit}");
    }
}

#[test]
fn compiled_files_are_placed_as_a_whole() {
    let folder = models();
    for (name, inner) in [("forest.bth", manifest(FOREST)), ("varied.bth", varied())] {
        let path = Path::new("x");
        let (bytes, _) = scene::compile(&inner, folder.path(), path, &options(), &Silent).unwrap();
        std::fs::write(folder.path().join(name), &bytes.bytes).unwrap();
        let alone = bth::from_bytes(&bytes.bytes).unwrap();
        let text = format!(
            r#"objects = [{{ name = "quad", model = "quad.obj" }}, {{ name = "whole", file = "{name}" }}]
            nodes = [{{ name = "a", object = "whole" }}, {{ name = "q", object = "quad", translation = [0, -9, 0] }},
                {{ name = "b", object = "whole", translation = [0, 0, 90], scale = [2, 2, -2] }}]"#
        );
        let (mut scene, report) = compiled(&manifest(&text), folder.path());
        assert_eq!(report.unused, [""; 0]);
        let count = alone.instance_count();
        assert_eq!(scene.instance_count(), 2 * count + 1);
        let mut same = 0;
        for frame in [0u32, 7] {
            // The rate of this manifest is 24.
            scene.set_seconds(f64::from(frame) / 10.0).unwrap();
            let mut alone = bth::from_bytes(&bytes.bytes).unwrap();
            alone.set_seconds(f64::from(frame) / 10.0).unwrap();
            for i in 0..count {
                let (inside, by_itself) = (scene.instance(i), alone.instance(i));
                assert_eq!(inside.visible, by_itself.visible, "{i}");
                assert_eq!(scene.instance(count + 1 + i).visible, by_itself.visible);
                same += usize::from(inside.to_world == by_itself.to_world);
            }
            let flat = written_out(&scene);
            let rays = rays(&scene, u64::from(frame));
            let found = hits(&scene, &rays);
            assert_eq!(found, hits(flat.scene(), &rays));
            assert!(found.iter().filter(|hit| hit.is_hit()).count() > 30);
        }
        // The order of the nodes in the file may be another one.
        assert!(same > count as usize / 2, "{same} of {count}");
    }
}

#[test]
fn new_positions_show_in_all_groups() {
    let folder = models();
    let options = CompileOptions { deformable: true, ..options() };
    let compiled = scene::compile(&manifest(FOREST), folder.path(), Path::new("x"), &options, &Silent);
    let mut scene = bth::from_bytes(&compiled.unwrap().0.bytes).unwrap();
    let rays = rays(&scene, 3);
    let before = hits(&scene, &rays);
    let positions: Vec<[f32; 3]> =
        scene.positions(0).iter().map(|[x, y, z]| [3.0 * x, y + 9.0, z - 5.0]).collect();
    let update = scene.set_positions(0, &positions).unwrap();
    assert_eq!((update.placed, update.deformed), (2, 1));
    let mut flat = written_out(&scene);
    flat.set_positions(0, &positions).unwrap();
    flat.commit().unwrap();
    let found = hits(&scene, &rays);
    assert_eq!(found, hits(flat.scene(), &rays));
    assert!(found != before && found.iter().filter(|hit| hit.is_hit()).count() > 30);
}
