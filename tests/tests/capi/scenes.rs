//! Scenes that move and scenes that are built, from C.

use crate::{c_program, run};
use bth::rays::{Hit, Ray};
use bth_compile::Silent;
use bth_compile::pipeline::{CompileOptions, compile};
use std::path::Path;

/// A wheel that turns, and is on its edge without any depth in frame 3.
pub(crate) const SCENE: &str = r#"version = 1
frames = { first = -1, last = 4, rate = 2 }
objects = [{ name = "quad", model = "quad.obj" }]
nodes = [{ name = "hub", translation = [0, 1, 0] }, { name = "spoke", parent = "hub", object = "quad", translation = [1, 0, 0] }, { name = "floor", object = "quad", scale = [3, 1, 3] }]
tracks = [
    { node = "hub", property = "rotation", times = [0, 2], values = [{ axis = [0, 1, 0], degrees = 0 }, { axis = [0, 1, 0], degrees = 170 }] },
    { node = "spoke", property = "scale", interpolation = "step", times = [0, 1.5, 2], values = [[1, 1, 1], [1, 1e-30, 1], [1, 0, 1]] },
]
"#;

#[test]
fn a_c_program_moves_a_scene_and_sees_what_rust_sees() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(program) = c_program(folder.path(), "motion") else { return };
    let quad = "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nf 4 3 2 1\n";
    std::fs::write(folder.path().join("quad.obj"), quad).expect("a model");
    let manifest = bth_scene::parse(SCENE, Path::new("wheel.manifest")).expect("a manifest");
    let options = CompileOptions::default();
    let (compiled, _) =
        bth_compile::scene::compile(&manifest, folder.path(), Path::new("wheel"), &options, &Silent)
            .expect("the wheel compiles");
    let file = folder.path().join("wheel.bth");
    std::fs::write(&file, &compiled.bytes).expect("a file");

    let points = [[0.0f32, 0.0], [1.5, 0.2], [-0.4, -1.3], [9.0, 9.0]];
    let input: String = points.iter().map(|[x, z]| format!("{x} {z}\n")).collect();
    let output = run(&program, &[file.to_str().expect("UTF-8")], &input);
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).expect("text");
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("frames -1 4 2"));

    let mut scene = bth::open(&file).expect("the wheel opens");
    let mut seen = [0; 2];
    for frame in (-1..=4).map(Some).chain([None]) {
        let moved = match frame {
            Some(frame) => scene.set_frame(frame),
            None => scene.set_seconds(0.3),
        };
        if let Err(error) = moved {
            let line = lines.next().expect("an error");
            assert!(
                line.starts_with("error -6 ") && line.contains("node \"spoke\" at 1.5 s"),
                "{line}: {error}"
            );
            seen[0] += 1;
        }
        let time = lines.next().and_then(|line| line.strip_prefix("time ")?.parse::<f64>().ok());
        assert_eq!(time, Some(scene.seconds()));
        for i in 0..scene.instance_count() {
            let view = scene.instance(i);
            let line = lines.next().expect("an instance");
            let fields: Vec<&str> = line.split(' ').collect();
            let numbers = [view.object, view.node, view.visible.into()].map(|n| n.to_string());
            assert_eq!(fields[1..4], numbers, "{frame:?}");
            let rows: Vec<f64> = fields[4..].iter().map(|f| f.parse().expect("a number")).collect();
            assert_eq!(rows, view.to_world.as_flattened(), "{frame:?}");
            seen[1] += usize::from(!view.visible);
        }
        for [x, z] in points {
            let ray = Ray::new([x, 9.0, z], [0.0, -1.0, 0.0]);
            let hit = scene.nearest(&ray).unwrap_or(Hit::MISS);
            let line = lines.next().expect("a hit");
            let fields: Vec<&str> = line.split(' ').collect();
            assert_eq!(fields[1].parse::<f32>().expect("a number").to_bits(), hit.t.to_bits(), "{frame:?}");
            let surface = [hit.primitive.instance, hit.primitive.triangle].map(|n| n.to_string());
            assert_eq!(fields[2..], surface, "{frame:?}");
        }
    }
    assert_eq!((lines.next(), seen), (None, [1, 1]), "an error at frame 3, nothing to see at frame 4");
}

#[test]
fn a_c_program_builds_a_scene_of_two_files_as_rust_does() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(program) = c_program(folder.path(), "builder") else { return };
    let quad = "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nf 4 3 2 1\n";
    let model = folder.path().join("quad.obj");
    std::fs::write(&model, quad).expect("a model");
    let manifest = bth_scene::parse(SCENE, Path::new("wheel.manifest")).expect("a manifest");
    let options = CompileOptions::default();
    let (moving, _) =
        bth_compile::scene::compile(&manifest, folder.path(), Path::new("wheel"), &options, &Silent)
            .expect("the wheel compiles");
    let (still, _) = compile(&model, &options, &Silent).expect("the quad compiles");
    let files = [("still", &still.bytes), ("moving", &moving.bytes)].map(|(name, bytes)| {
        let file = folder.path().join(name);
        std::fs::write(&file, bytes).expect("a file");
        file.to_str().expect("UTF-8").to_owned()
    });
    let points: Vec<[f32; 2]> =
        (0..60).map(|i| [0.8 * i as f32 - 20.0, 0.3 * (i % 5) as f32 - 0.7]).collect();
    let input: String = points.iter().map(|[x, z]| format!("{x} {z}\n")).collect();
    let output = run(&program, &files.each_ref().map(String::as_str), &input);
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).expect("text");

    let mut expected = String::new();
    let mut builder = bth::SceneBuilder::new();
    let [quad, wheel] =
        [&still.bytes, &moving.bytes].map(|b| builder.add(&bth::from_bytes(b).expect("a file")));
    let at = |x: f32, y: f32, z: f32, s: f32| [s, 0.0, 0.0, x, 0.0, s, 0.0, y, 0.0, 0.0, s, z];
    let line = |i: u32, step: f32, z: f32| at(2.5 * i as f32 - 20.0, step * i as f32, z, 1.0);
    let ids: Vec<u32> =
        (0..20).map(|i| builder.instance(quad, &line(i, 0.1, 0.0)).expect("an object")).collect();
    let subscene = builder.subscene(wheel, &at(0.0, 3.0, 0.0, 0.5)).expect("a scene");
    let rays: Vec<Ray> = points.iter().map(|[x, z]| Ray::new([*x, 9.0, *z], [0.0, -1.0, 0.0])).collect();
    let mut commit = |builder: &mut bth::SceneBuilder| {
        expected += &match builder.commit() {
            Ok(u) => format!(
                "update {} {} {} {} {}\n",
                u.nodes,
                u.placed,
                u.visible,
                u32::from(u.rebuilt),
                u.cost_ratio
            ),
            Err(error) => format!("error -6 bth_builder_commit: {error}\n"),
        };
        let mut hits = vec![Hit::MISS; rays.len()];
        builder.scene().batch(&rays).nearest(&mut hits);
        for hit in &hits {
            expected += &format!("hit {} {} {}\n", hit.t, hit.primitive.instance, hit.primitive.triangle);
        }
        hits.iter().filter(|hit| hit.is_hit()).count()
    };
    assert!(commit(&mut builder) > 30);
    let many: Vec<_> = (0..20).map(|i| line(i, 0.2, 0.5)).collect();
    builder.set_transforms(&ids, &many).expect("instances");
    builder.set_subscene_seconds(subscene, 0.8).expect("a subscene");
    commit(&mut builder);
    builder.set_visible(ids[8], false).expect("an instance");
    builder.remove(ids[9]).expect("an instance");
    commit(&mut builder);
    builder.set_transform(ids[3], &at(0.0, 0.0, 0.0, 0.0)).expect("an instance");
    commit(&mut builder);
    builder.set_transform(ids[3], &at(-1.0, 1.0, 0.25, -2.0)).expect("an instance");
    commit(&mut builder);
    builder.set_subscene_transform(subscene, &at(4.0, 3.0, 0.0, 1.0)).expect("a subscene");
    commit(&mut builder);
    builder.set_subscene_visible(subscene, false).expect("a subscene");
    commit(&mut builder);
    builder.remove_subscene(subscene).expect("a subscene");
    commit(&mut builder);
    // C prints numbers in another way.
    let fields = |text: &str| -> Vec<Vec<String>> {
        let number = |field: &str| field.parse::<f32>().map_or(field.to_owned(), |x| x.to_string());
        text.lines().map(|line| line.split(' ').map(number).collect()).collect()
    };
    assert_eq!(fields(&text), fields(&expected));
}
