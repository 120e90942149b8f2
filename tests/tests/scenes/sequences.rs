//! Objects whose vertices move by themselves have the answers of the same objects compiled at each
//! time.

use crate::built::compare;
use crate::support::{manifest, options};
use bth::Scene;
use bth_compile::Silent;
use bth_compile::pipeline::{CompileOptions, MotionOptions};
use bth_compile::scene::{self, SceneReport};
use bth_import::gltf::scene::{ImportOptions, import};
use bth_random::Rng;
use serde_json::json;
use std::path::Path;

pub(crate) type Positions = Vec<[f32; 3]>;

/// A knot that is twisted about the y axis, the more the later, by up to `turns` from end to end.
pub(crate) fn frames(count: usize, turns: f32) -> (Vec<Positions>, Vec<[u32; 3]>) {
    let knot = bth_scenes::knot::torus_knot(1200);
    let frame = |frame: usize| {
        let angle = std::f32::consts::TAU * turns * frame as f32 / (count - 1).max(1) as f32;
        let twist = |p: &[f32; 3]| {
            let (sin, cos) = (angle * p[1] / 6.0).sin_cos();
            [p[0] * cos - p[2] * sin, p[1] + 0.0, p[0] * sin + p[2] * cos]
        };
        knot.positions.iter().map(twist).collect()
    };
    ((0..count).map(frame).collect(), knot.triangles)
}

/// Small squares on a grid of `side` times `side` places, which exchange their places between the
/// second and the third of four frames.
pub(crate) fn exchanging(side: usize) -> (Vec<Positions>, Vec<[u32; 3]>) {
    let count = side * side;
    let place = |number: usize| [(number % side) as f32, 0.0, (number / side) as f32];
    let frame = |stride: usize| -> Positions {
        (0..count)
            .flat_map(|square| {
                let [x, y, z] = place(square * stride % count);
                [[x, y, z], [x + 0.8, y + 0.3, z], [x, y + 0.1, z + 0.8], [x + 0.8, y, z + 0.8]]
            })
            .collect()
    };
    let triangles =
        (0..count as u32).flat_map(|s| [[4 * s, 4 * s + 1, 4 * s + 2], [4 * s + 1, 4 * s + 3, 4 * s + 2]]);
    // The stride has no factor in common with the number of squares.
    (vec![frame(1), frame(1), frame(211), frame(211)], triangles.collect())
}

fn obj(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> String {
    let mut text = String::new();
    for [x, y, z] in positions {
        text += &format!("v {x:?} {y:?} {z:?}\n");
    }
    for [a, b, c] in triangles {
        text += &format!("f {} {} {}\n", a + 1, b + 1, c + 1);
    }
    text
}

/// A PC2 file whose sample i is at frame i / 2.
fn pc2(frames: &[Positions]) -> Vec<u8> {
    let mut bytes = b"POINTCACHE2\0".to_vec();
    for word in [1i32, frames[0].len() as i32] {
        bytes.extend(word.to_le_bytes());
    }
    [0.0f32, 0.5].iter().for_each(|x| bytes.extend(x.to_le_bytes()));
    bytes.extend((frames.len() as i32).to_le_bytes());
    frames.iter().flatten().flatten().for_each(|x| bytes.extend(x.to_le_bytes()));
    bytes
}

/// A folder with the frames as numbered OBJ files and as a PC2 file of the first one, and of
/// mesh 1 of a glTF file.
pub(crate) fn folder(frames: &[Positions], triangles: &[[u32; 3]]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (number, frame) in frames.iter().enumerate() {
        std::fs::write(folder.path().join(format!("knot_{number:03}.obj")), obj(frame, triangles)).unwrap();
    }
    std::fs::write(folder.path().join("knot.pc2"), pc2(frames)).unwrap();
    // The positions are zeros, since the cache gives others.
    let (rows, size) = (triangles.as_flattened(), 12 * frames[0].len());
    let mut bytes = vec![0; size];
    bytes.extend(rows.iter().flat_map(|row| row.to_le_bytes()));
    let gltf = json!({
        "asset": {"version": "2.0"},
        "meshes": [{"primitives": []}, {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"componentType": 5126, "type": "VEC3", "count": frames[0].len(), "bufferView": 0},
            {"componentType": 5125, "type": "SCALAR", "count": rows.len(), "bufferView": 1}
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": size},
            {"buffer": 0, "byteOffset": size, "byteLength": bytes.len() - size}
        ],
        "buffers": [{"uri": "knot.bin", "byteLength": bytes.len()}]
    });
    std::fs::write(folder.path().join("knot.gltf"), gltf.to_string()).unwrap();
    std::fs::write(folder.path().join("knot.bin"), bytes).unwrap();
    folder
}

pub(crate) fn built(text: &str, folder: &Path, options: &CompileOptions) -> (bth_format::File, SceneReport) {
    let (compiled, report) = scene::compile(&manifest(text), folder, Path::new("x"), options, &Silent)
        .unwrap_or_else(|e| panic!("{e}"));
    let file = bth_format::File::from_bytes(&compiled.bytes).unwrap();
    bth_format::verify::verify(&file).unwrap_or_else(|e| panic!("{}", e[0]));
    (file, report)
}

/// The positions at a share of the way from one frame to the next, from the definition.
pub(crate) fn between(frames: &[Positions], at: f64) -> Positions {
    let at = at.clamp(0.0, (frames.len() - 1) as f64);
    let (frame, share) = (at.floor() as usize, at.fract());
    let next = &frames[(frame + 1).min(frames.len() - 1)];
    let mix = |a: f32, b: f32| (f64::from(a) + (f64::from(b) - f64::from(a)) * share) as f32;
    let rows = frames[frame].iter().zip(next);
    rows.map(|(p, q)| std::array::from_fn(|k| mix(p[k], q[k]))).collect()
}

fn check_at(scene: &Scene, positions: &[[f32; 3]], triangles: &[[u32; 3]], rng: &mut Rng) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("knot.obj"), obj(positions, triangles)).unwrap();
    let text = format!("objects = [{{ name = \"knot\", model = \"knot.obj\" }}]\n{NODE}");
    let (file, _) = built(&text, folder.path(), &options());
    let fresh = bth::from_file(file).unwrap();
    assert!(compare(&fresh, scene, 0, rng) > 100);
}

pub(crate) const NODE: &str = "nodes = [{ name = \"n\", object = \"knot\" }]\n";

#[test]
fn sequences_have_the_answers_of_their_frames_and_of_what_lies_between() {
    let (frames, triangles) = frames(5, 0.4);
    let folder = folder(&frames, &triangles);
    let texts = [
        "objects = [{ name = \"knot\", sequence = \"knot_###.obj\", start = 1.0 }]",
        "objects = [{ name = \"knot\", model = \"knot_000.obj\", vertex_cache = \"knot.pc2\", rate = 4, start = 1 }]",
        "objects = [{ name = \"knot\", model = \"knot.gltf\", mesh = 1, vertex_cache = \"knot.pc2\", rate = 4, start = 1 }]",
    ];
    let rng = &mut Rng::new(5);
    for text in texts {
        let text = format!("frames = {{ first = 0, last = 30, rate = 8 }}\n{text}\n{NODE}");
        let (file, report) = built(&text, folder.path(), &options());
        let motion = report.objects[0].motion.as_ref().unwrap();
        assert_eq!((motion.frames, motion.poses), (5, 8));
        let sequence = file.sequence(0);
        assert_eq!(sequence.times, [1.0, 1.125, 1.25, 1.375, 1.5]);
        let mut scene = bth::from_file(file).unwrap();
        for seconds in [0.0, 1.0, 1.06, 1.125, 1.3, 1.49, 1.5, 9.0, -3.0, 1.2] {
            let update = scene.set_seconds(seconds).unwrap();
            assert_eq!(update.visible, 1);
            check_at(&scene, &between(&frames, (seconds - 1.0) * 8.0), &triangles, rng);
        }
        assert_eq!(scene.set_seconds(1.2).unwrap().deformed, 0, "nothing moved");
        assert_eq!(scene.set_frame(10).unwrap().deformed, 1);
        check_at(&scene, &frames[2], &triangles, rng);
    }
}

#[test]
fn an_object_with_frames_is_copied_from_a_compiled_file() {
    let (frames, triangles) = exchanging(24);
    let folder = folder(&frames, &triangles);
    let text = format!(
        "frames = {{ first = 0, last = 8, rate = 2 }}\nobjects = [{{ name = \"knot\", sequence = \"knot_###.obj\", rate = 1 }}]\n{NODE}"
    );
    let (file, _) = built(&text, folder.path(), &options());
    std::fs::write(folder.path().join("done.bth"), file.bytes()).unwrap();
    let copy = format!(
        "objects = [{{ name = \"quad\", file = \"done.bth\", object = 0 }}, {{ name = \"knot\", file = \"done.bth\", object = 0 }}]\n{NODE}"
    );
    let (copied, report) = built(&copy, folder.path(), &options());
    assert_eq!((report.triangles, report.objects.len()), (triangles.len() as u64, 1));
    let (mut scene, rng) = (bth::from_file(copied).unwrap(), &mut Rng::new(6));
    for seconds in [0.0, 3.0, 1.4, 2.5] {
        scene.set_seconds(seconds).unwrap();
        check_at(&scene, &between(&frames, seconds), &triangles, rng);
    }
}

#[test]
fn a_time_that_cannot_be_shown_leaves_the_scene_as_it_was() {
    let (mut frames, triangles) = frames(3, 0.2);
    // Moved so far that the instance, which is scaled, leaves the range of numbers.
    frames[2].iter_mut().for_each(|p| p[0] += 3e38);
    let folder = folder(&frames, &triangles);
    let text = "frames = { first = 0, last = 2, rate = 1 }\n\
        objects = [{ name = \"knot\", sequence = \"knot_###.obj\" }]\n\
        nodes = [{ name = \"n\", object = \"knot\", scale = [2, 1, 1] }]\n";
    let (file, _) = built(text, folder.path(), &options());
    let mut scene = bth::from_file(file).unwrap();
    scene.set_frame(1).unwrap();
    let before = (scene.instance_bounds(0), scene.positions(0).to_vec());
    assert_eq!(scene.set_frame(2).unwrap_err().code(), bth::Code::NotFinite);
    assert_eq!(
        (scene.instance_bounds(0), scene.positions(0).to_vec(), scene.seconds()),
        (before.0, before.1, 1.0)
    );
    assert_eq!(scene.set_seconds(1.0).unwrap().deformed, 0);
    assert_eq!(scene.set_seconds(0.5).unwrap().deformed, 1);
}

#[test]
fn subscenes_move_vertices_as_their_file_does() {
    let (frames, triangles) = exchanging(24);
    let folder = folder(&frames, &triangles);
    let text = format!(
        "frames = {{ first = 0, last = 8, rate = 2 }}\nobjects = [{{ name = \"knot\", sequence = \"knot_###.obj\", rate = 1 }}]\n{NODE}"
    );
    let (file, _) = built(&text, folder.path(), &options());
    let mut alone = bth::from_file(file).unwrap();
    let identity = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let mut builder = bth::SceneBuilder::new();
    let first = builder.add(&alone);
    let whole = builder.subscene(first, &identity).unwrap();
    let rng = &mut Rng::new(8);
    for seconds in [0.0, 2.5, 1.4, 3.0] {
        builder.set_subscene_seconds(whole, seconds).unwrap();
        builder.commit().unwrap();
        alone.set_seconds(seconds).unwrap();
        assert_eq!(builder.scene().positions(first), alone.positions(0), "{seconds}");
        assert!(compare(&alone, builder.scene(), 0, rng) > 100);
        assert_eq!(builder.commit().unwrap().deformed, 0, "nothing moved");
    }
    // A commit that fails leaves positions as they were.
    builder.set_subscene_seconds(whole, 0.0).unwrap();
    builder.set_subscene_transform(whole, &[0.0; 12]).unwrap();
    assert_eq!(builder.commit().unwrap_err().code(), bth::Code::Singular);
    assert!(compare(&alone, builder.scene(), 0, rng) > 100);
    builder.set_subscene_transform(whole, &identity).unwrap();
    assert_eq!(builder.commit().unwrap().deformed, 1);
    alone.set_seconds(0.0).unwrap();
    assert!(compare(&alone, builder.scene(), 0, rng) > 100);
    // What the caller gives counts until the time changes.
    let given: Vec<_> = alone.positions(0).iter().map(|[x, y, z]| [*x, *y + 5.0, *z]).collect();
    builder.set_positions(first, &given).unwrap();
    builder.commit().unwrap();
    assert_eq!(builder.scene().positions(first), given);
    builder.set_subscene_seconds(whole, 2.5).unwrap();
    builder.commit().unwrap();
    alone.set_seconds(2.5).unwrap();
    assert!(compare(&alone, builder.scene(), 0, rng) > 100);
}

/// A folder with a glTF file whose one morph target makes squares exchange their places between 1.4
/// and 1.6 s.
fn morphing(side: usize) -> tempfile::TempDir {
    let (frames, triangles) = exchanging(side);
    let (base, other) = (&frames[0], &frames[2]);
    let deltas: Vec<_> = base.iter().zip(other).map(|(a, b)| [0, 1, 2].map(|k| b[k] - a[k])).collect();
    let mut bytes: Vec<u8> = Vec::new();
    let mut views = Vec::new();
    let mut add = |part: Vec<u8>| {
        views.push(json!({"buffer": 0, "byteOffset": bytes.len(), "byteLength": part.len()}));
        bytes.extend(part);
    };
    let floats = |rows: &[f32]| rows.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    add(floats(base.as_flattened()));
    add(floats(deltas.as_flattened()));
    add(triangles.iter().flatten().flat_map(|row| row.to_le_bytes()).collect());
    add(floats(&[0.0, 1.4, 1.6, 3.0]));
    add(floats(&[0.0, 0.0, 1.0, 1.0]));
    let bound = |greatest: bool, rows: &[[f32; 3]]| {
        [0, 1, 2].map(|k| {
            let values = rows.iter().map(|p| p[k]);
            if greatest { values.fold(f32::MIN, f32::max) } else { values.fold(f32::MAX, f32::min) }
        })
    };
    let accessor = |view: u32, component: u32, count: usize, shape: &str| json!({"bufferView": view, "componentType": component, "count": count, "type": shape});
    let mut accessors = [
        accessor(0, 5126, base.len(), "VEC3"),
        accessor(1, 5126, base.len(), "VEC3"),
        accessor(2, 5125, 3 * triangles.len(), "SCALAR"),
        accessor(3, 5126, 4, "SCALAR"),
        accessor(4, 5126, 4, "SCALAR"),
    ];
    for (accessor, rows) in accessors.iter_mut().zip([&base[..], &deltas[..]]) {
        accessor["min"] = json!(bound(false, rows));
        accessor["max"] = json!(bound(true, rows));
    }
    let primitive = json!({"attributes": {"POSITION": 0}, "indices": 2, "targets": [{"POSITION": 1}]});
    let text = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive]}], "accessors": accessors, "bufferViews": views,
        "buffers": [{"uri": "data.bin", "byteLength": bytes.len()}],
        "animations": [{
            "samplers": [{"input": 3, "output": 4}],
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}]
        }]
    });
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.gltf"), text.to_string()).unwrap();
    std::fs::write(folder.path().join("data.bin"), bytes).unwrap();
    folder
}

#[test]
fn objects_that_a_file_deforms_get_a_tree_for_their_poses_and_answer_the_same() {
    let folder = morphing(24);
    let (manifest, _) =
        import(&folder.path().join("a.gltf"), "a.gltf", &ImportOptions::default(), &Silent).unwrap();
    let compiled = |poses: u32| {
        let options = CompileOptions { motion: MotionOptions { poses }, ..options() };
        let (compiled, report) =
            scene::compile(&manifest, folder.path(), Path::new("x"), &options, &Silent).unwrap();
        let file = bth_format::File::from_bytes(&compiled.bytes).unwrap();
        bth_format::verify::verify(&file).unwrap_or_else(|e| panic!("{}", e[0]));
        (file, report)
    };
    let (still, report) = compiled(1);
    assert!(report.objects[0].motion.is_none(), "the tree is for the positions at rest");
    let (file, report) = compiled(4);
    assert_eq!(report.objects[0].motion.as_ref().map(|motion| motion.poses), Some(4));
    assert_ne!(file.content_id(), still.content_id());
    let triangles = file.object(0).unwrap().triangles.to_vec();
    let mut scene = bth::from_file(file).unwrap();
    let rng = &mut Rng::new(9);
    for seconds in [0.0, 2.5, 1.45, 1.55, 3.0, 0.5, 2.9] {
        scene.set_seconds(seconds).unwrap();
        let positions = scene.positions(0).to_vec();
        check_at(&scene, &positions, &triangles, rng);
    }
    let positions = scene.positions(0).to_vec();
    scene.set_seconds(f64::from(2.8f32)).unwrap();
    assert_eq!(scene.positions(0), positions, "the weights are the same from 1.6 s on");
}
