//! Which parts of a glTF scene become a manifest, and which are refused.

use crate::support::{animated, compiled};
use bth_compile::{Error, Silent};
use bth_import::gltf::Chosen;
use bth_import::gltf::scene::{self, ImportOptions, ImportReport};
use bth_scene::{Interpolation, Lens, LightKind, Manifest, Property, Source, Transform};
use serde_json::{Value, json};
use std::path::Path;

/// Numbers of the binary chunk: a triangle, three times, three vectors, three quaternions, nine
/// vectors.
fn binary() -> Vec<f32> {
    let mut numbers = vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    numbers.extend([0.0, 0.5, 2.0]);
    numbers.extend([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]);
    numbers.extend([0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.6, 0.0, 0.8, 0.0]);
    numbers.extend((0..27).map(|i| i as f32 / 8.0));
    numbers
}

fn document() -> Value {
    let accessor = |view: u32, count: u32, shape: &str| json!({"bufferView": view, "componentType": 5126, "count": count, "type": shape});
    json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 3, 4]}, {"name": "other", "nodes": [5]}],
        "nodes": [
            {"name": "arm", "children": [1, 2], "translation": [1, 2, 3]},
            {"name": "arm", "mesh": 0, "matrix": [1,0,0,0, 0,0,1,0, 0,-2,0,0, 5,6,7,1]},
            {"camera": 0, "mesh": 0, "extensions": {"KHR_node_visibility": {"visible": false}}},
            {"name": "many", "mesh": 1, "extensions": {"EXT_mesh_gpu_instancing":
                {"attributes": {"TRANSLATION": 2, "ROTATION": 3}}}},
            {"camera": 1, "extensions": {"KHR_lights_punctual": {"light": 1}}},
            {"name": "elsewhere", "mesh": 0}
        ],
        "meshes": [
            {"name": "tri\nangle", "primitives": [{"attributes": {"POSITION": 0}}]},
            {"primitives": [{"attributes": {"POSITION": 0}}]}
        ],
        "cameras": [
            {"type": "perspective", "name": "eye", "perspective": {"yfov": 1.0, "znear": 0.5, "aspectRatio": 1.5}},
            {"type": "orthographic", "orthographic": {"xmag": 3, "ymag": 2, "znear": 0, "zfar": 9}}
        ],
        "extensionsUsed": ["KHR_lights_punctual", "EXT_mesh_gpu_instancing", "KHR_node_visibility"],
        "extensionsRequired": ["EXT_mesh_gpu_instancing"],
        "extensions": {"KHR_lights_punctual": {"lights": [
            {"type": "point"},
            {"type": "spot", "color": [1, 0.5, 0], "intensity": 7, "range": 9, "spot": {"innerConeAngle": 0.1}}
        ]}},
        "animations": [
            {"name": "wave", "samplers": [{"input": 1, "output": 2}, {"input": 1, "output": 3, "interpolation": "STEP"}],
             "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}},
                          {"sampler": 1, "target": {"node": 3, "path": "rotation"}},
                          {"sampler": 0, "target": {"node": 5, "path": "scale"}}]},
            {"samplers": [{"input": 1, "output": 4, "interpolation": "CUBICSPLINE"}],
             "channels": [{"sampler": 0, "target": {"node": 0, "path": "scale"}},
                          {"sampler": 0, "target": {"node": 0, "path": "translation"}}]}
        ],
        "accessors": [accessor(0, 3, "VEC3"), accessor(1, 3, "SCALAR"), accessor(2, 3, "VEC3"),
            accessor(3, 3, "VEC4"), accessor(4, 9, "VEC3")],
        "bufferViews": [
            {"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 12},
            {"buffer": 0, "byteOffset": 48, "byteLength": 36}, {"buffer": 0, "byteOffset": 84, "byteLength": 48},
            {"buffer": 0, "byteOffset": 132, "byteLength": 108}
        ],
        "buffers": [{"uri": "data.bin", "byteLength": 240}]
    })
}

fn written(document: &Value) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.gltf"), document.to_string()).unwrap();
    let bytes: Vec<u8> = binary().iter().flat_map(|x| x.to_le_bytes()).collect();
    std::fs::write(folder.path().join("data.bin"), bytes).unwrap();
    folder
}

fn import(document: &Value, options: &ImportOptions) -> Result<(Manifest, ImportReport), Error> {
    let folder = written(document);
    scene::import(&folder.path().join("a.gltf"), "sub/a.gltf", options, &Silent)
}

fn edited(edit: impl FnOnce(&mut Value)) -> Value {
    let mut document = document();
    edit(&mut document);
    document
}

#[test]
fn nodes_keep_their_hierarchy_transforms_names_and_visibility() {
    let all = ImportOptions { animation: Chosen::All, ..ImportOptions::default() };
    let (manifest, report) = import(&document(), &all).unwrap();
    let nodes: Vec<_> = manifest.nodes.iter().map(|n| (n.name, n.parent, n.object, n.visible)).collect();
    let expected = [
        ("arm", None, None, true),
        ("arm 2", Some(0), Some(0), true),
        ("node 2", Some(0), Some(0), false),
        ("many", None, None, true),
        ("many/0", Some(3), Some(1), true),
        ("many/1", Some(3), Some(1), true),
        ("many/2", Some(3), Some(1), true),
        ("node 4", None, None, true),
    ];
    assert_eq!(nodes, expected);
    let Transform::Matrix(rows) = manifest.nodes.get(1).transform else {
        panic!("{:?}", manifest.nodes.get(1))
    };
    assert_eq!(rows, [[1.0, 0.0, 0.0, 5.0], [0.0, 0.0, -2.0, 6.0], [0.0, 1.0, 0.0, 7.0]]);
    let Transform::Parts { translation, rotation, .. } = manifest.nodes.get(5).transform else { panic!() };
    assert_eq!((translation, rotation), ([4.0, 5.0, 6.0], [0.0, 1.0, 0.0, 0.0]));
    assert_eq!(manifest.objects[0].name, "tri angle");
    assert_eq!(manifest.objects[1].source, Source::Model { path: "sub/a.gltf".into(), mesh: Some(1) });
    assert_eq!(report.node_rows, [Some(0), Some(1), Some(2), Some(3), Some(7), None]);
    assert_eq!((report.instances, report.objects, report.tracks), (5, 2, 3));
}

#[test]
fn the_last_frame_is_that_of_the_last_key_whatever_its_rounding_to_f32() {
    let last = |time: f64, rate: f64| {
        let mut numbers = binary();
        (numbers[10], numbers[11]) = (time as f32 * 0.5, time as f32);
        let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        let folder = written(&document());
        std::fs::write(folder.path().join("data.bin"), bytes).unwrap();
        let options = ImportOptions { rate, ..ImportOptions::default() };
        let (manifest, _) =
            scene::import(&folder.path().join("a.gltf"), "a.gltf", &options, &Silent).unwrap();
        manifest.frames.last
    };
    for rate in [24.0, 25.0, 29.97, 30.0, 60.0] {
        for frame in [1, 49, 61, 239, 1001] {
            assert_eq!(last(f64::from(frame) / rate, rate), frame, "at {rate} frames a second");
            assert_eq!(last((f64::from(frame) + 0.01) / rate, rate), frame + 1, "at {rate} frames a second");
        }
    }
}

#[test]
fn spots_may_have_a_sharp_edge_and_an_angle_that_was_rounded_to_f32() {
    let right_angle = f64::from(std::f32::consts::FRAC_PI_2);
    let cone = |spot: Value| -> Result<[f64; 2], String> {
        let mut document = document();
        document["extensions"]["KHR_lights_punctual"]["lights"][1]["spot"] = spot;
        let (manifest, _) = import(&document, &ImportOptions::default()).map_err(|e| e.to_string())?;
        // The manifest is read back as it is written.
        assert_eq!(bth_scene::parse(&manifest.to_toml(), Path::new("a.manifest")).unwrap(), manifest);
        match manifest.lights[0].kind {
            LightKind::Spot { inner, outer } => Ok([inner, outer]),
            _ => panic!("a spot"),
        }
    };
    let [inner, outer] = cone(json!({"innerConeAngle": 0.5, "outerConeAngle": 0.5})).unwrap();
    assert_eq!(outer, 0.5f64.to_degrees());
    assert!(inner < outer && (inner / outer) as f32 == 1.0 - f32::EPSILON / 2.0, "{inner} {outer}");
    let wide = cone(json!({"innerConeAngle": 0.5, "outerConeAngle": right_angle}));
    assert_eq!(wide, Ok([0.5f64.to_degrees(), 90.0]));
    let [inner, outer] = cone(json!({"innerConeAngle": right_angle, "outerConeAngle": right_angle})).unwrap();
    assert!(outer == 90.0 && (89.9999..90.0).contains(&inner), "{inner} {outer}");
    for bad in [[0.6, 0.5], [0.0, 0.0], [0.5, 1.571], [0.5, 1.5707966]] {
        let refused = cone(json!({"innerConeAngle": bad[0], "outerConeAngle": bad[1]})).unwrap_err();
        assert!(
            refused.contains("expected a color, intensity, range and cone that glTF allows"),
            "{refused}"
        );
    }
}

#[test]
fn cameras_and_lights_stand_at_their_nodes() {
    let (manifest, _) = import(&document(), &ImportOptions::default()).unwrap();
    let [eye, flat] = manifest.cameras.as_slice() else { panic!("two cameras") };
    assert_eq!((eye.name.as_str(), eye.node, eye.lens), ("eye", 2, Lens::Perspective(1f64.to_degrees())));
    assert_eq!((eye.aspect, eye.near, eye.far), (Some(1.5), Some(0.5), None));
    assert_eq!((flat.name.as_str(), flat.lens, flat.far), ("node 4", Lens::Orthographic(4.0), Some(9.0)));
    let [light] = manifest.lights.as_slice() else { panic!("one light") };
    let LightKind::Spot { inner, outer } = light.kind else { panic!("{light:?}") };
    assert!((inner - 0.1f64.to_degrees()).abs() < 1e-12 && (outer - 45.0).abs() < 1e-12);
    assert_eq!((light.node, light.intensity, light.range), (7, 7.0, Some(9.0)));
}

#[test]
fn animations_are_chosen_by_name_or_number() {
    let tracks = |animation: Chosen| {
        let options = ImportOptions { animation, ..ImportOptions::default() };
        import(&document(), &options).map(|(m, r)| (m.tracks, m.frames.last, r))
    };
    let (all, last, report) = tracks(Chosen::All).unwrap();
    let kinds: Vec<_> = all.iter().map(|t| (t.node, t.property, t.interpolation)).collect();
    let expected = [
        (0, Property::Translation, Interpolation::Linear),
        (0, Property::Scale, Interpolation::Cubic),
        (3, Property::Rotation, Interpolation::Step),
    ];
    assert_eq!(kinds, expected);
    assert_eq!((all[0].times.as_slice(), &all[0].values[3..6]), (&[0.0, 0.5, 2.0][..], &[4.0, 5.0, 6.0][..]));
    assert_eq!((all[1].values.len(), last), (27, 48));
    assert_eq!(report.ignored.len(), 1, "the second translation: {:?}", report.ignored);
    assert!(report.ignored[0].contains("animation 1 channel 1") && report.ignored[0].contains("\"arm\""));
    assert_eq!(tracks(Chosen::One("wave".into())).unwrap().0.len(), 2);
    let (first, _, report) = tracks(Chosen::First).unwrap();
    assert_eq!(
        (first.len(), report.animations, report.animations_left_out),
        (2, vec!["wave".into()], vec!["1".into()])
    );
    let second = tracks(Chosen::One("1".into())).unwrap().0;
    assert_eq!(
        second.iter().map(|t| t.property).collect::<Vec<_>>(),
        [Property::Translation, Property::Scale]
    );
    assert_eq!((tracks(Chosen::None).unwrap().0.len(), tracks(Chosen::None).unwrap().1), (0, 0));
    let error = tracks(Chosen::One("walk".into())).unwrap_err().to_string();
    assert!(error.contains("0 \"wave\", 1 \"\"") && error.contains("walk"), "{error}");
}

#[test]
fn scenes_are_chosen_by_name_or_number() {
    for wanted in ["other", "1"] {
        let options = ImportOptions { scene: Some(wanted.into()), ..ImportOptions::default() };
        let (manifest, report) = import(&document(), &options).unwrap();
        assert_eq!((manifest.nodes.len(), report.scene.as_str()), (1, "other"));
        assert_eq!(manifest.tracks.iter().map(|t| t.property).collect::<Vec<_>>(), [Property::Scale]);
    }
    let options = ImportOptions { scene: Some("2".into()), ..ImportOptions::default() };
    assert!(import(&document(), &options).unwrap_err().to_string().contains("1 \"other\""));
}

#[test]
fn what_is_ignored_is_said_and_refused_when_strict() {
    let pointed = edited(|d| d["animations"][0]["channels"][0]["target"]["path"] = "pointer".into());
    let without_targets =
        edited(|d| d["animations"][0]["channels"][0]["target"] = json!({"node": 3, "path": "weights"}));
    let without_rows =
        edited(|d| d["nodes"][3]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = json!({}));
    for (document, words) in [
        (pointed, "animations of pointer"),
        (without_targets, "no morph targets"),
        (without_rows, "has no instances"),
    ] {
        let (_, report) = import(&document, &ImportOptions::default()).unwrap();
        assert!(report.ignored.len() == 1 && report.ignored[0].contains(words), "{:?}", report.ignored);
        let strict = ImportOptions { strict: true, ..ImportOptions::default() };
        let error = import(&document, &strict).unwrap_err().to_string();
        assert!(error.contains("BTH-I015") && error.contains(words), "{error}");
    }
}

#[test]
fn required_extensions_that_are_not_read_are_refused_by_name() {
    for name in ["ACME_mesh_compression", "KHR_animation_pointer", "ACME_rig"] {
        let error = import(&edited(|d| d["extensionsRequired"] = json!([name])), &ImportOptions::default());
        let error = error.unwrap_err().to_string();
        assert!(error.contains("BTH-I011") && error.contains(name), "{error}");
    }
}

#[test]
fn an_animation_that_is_not_chosen_may_be_malformed() {
    let document = edited(|d| d["animations"][0] = json!({"channels": 1}));
    for animation in [Chosen::None, Chosen::One("1".to_owned())] {
        let options = ImportOptions { animation, ..ImportOptions::default() };
        let (_, report) = import(&document, &options).unwrap();
        assert_eq!(report.animations_left_out[0], "0");
    }
}

#[track_caller]
fn bad(edit: impl FnOnce(&mut Value), place: &str, words: &str) {
    let error = import(&edited(edit), &ImportOptions::default()).unwrap_err().to_string();
    assert!(error.contains("BTH-I") && error.contains(place) && error.contains(words), "{error}");
}

#[test]
fn documents_that_cannot_be_used_are_refused_with_the_place() {
    bad(|d| d["nodes"][1]["children"] = json!([0]), "node 0", "twice");
    bad(|d| d["nodes"][0]["children"] = json!([9]), "node 9", "does not exist");
    bad(|d| d["nodes"][1]["mesh"] = 7.into(), "node 1", "below 2, found 7");
    bad(|d| d["nodes"][2]["camera"] = 7.into(), "node 2", "camera 7");
    bad(|d| d["nodes"][0]["rotation"] = json!([0, 0, 0, 0]), "node 0", "not zero");
    bad(|d| d["cameras"][0]["perspective"]["yfov"] = json!(4), "camera 0", "field of view");
    bad(|d| d["cameras"][0] = json!({"type": "perspective"}), "camera 0", "no projection");
    bad(
        |d| d["extensions"]["KHR_lights_punctual"]["lights"][1]["intensity"] = json!(-1),
        "light 1",
        "allows",
    );
    bad(|d| d["nodes"][4]["extensions"]["KHR_lights_punctual"]["light"] = 5.into(), "node 4", "light 5");
    bad(
        |d| d["nodes"][3]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["SCALE"] = 4.into(),
        "node 3",
        "equally many",
    );
    bad(|d| d["animations"][0]["channels"][0]["sampler"] = 9.into(), "animation 0 channel 0", "sampler 9");
    bad(
        |d| d["animations"][0]["channels"][0]["target"]["node"] = 1.into(),
        "animation 0 channel 0",
        "matrix",
    );
    bad(
        |d| d["animations"][0]["channels"][0]["target"]["node"] = 99.into(),
        "animation 0 channel 0",
        "node 99",
    );
    bad(|d| d["animations"][0]["samplers"][0]["interpolation"] = "SPLINE".into(), "channel 0", "SPLINE");
    bad(|d| d["animations"][0]["samplers"][0]["input"] = 0.into(), "accessor 0", "SCALAR");
    bad(|d| d["animations"][0]["samplers"][0]["output"] = 4.into(), "channel 0", "3 rows of values");
    bad(|d| d["animations"][0] = json!({"channels": 1}), "animation 0", "expected");
    bad(
        |d| d["extensionsRequired"] = json!(["KHR_new"]),
        "KHR_new",
        "known, found KHR_new, which may change",
    );
    // Times 1, 2, 3 are fine; turned around they are not.
    bad(|d| d["bufferViews"][1]["byteOffset"] = 40.into(), "channel 0", "ascend");
}

#[test]
fn manifests_of_imported_scenes_compile_to_the_same_as_the_scene_itself() {
    for path in animated() {
        let folder = tempfile::tempdir().unwrap();
        let name = path.file_name().unwrap().to_str().unwrap();
        std::fs::copy(&path, folder.path().join(name)).unwrap();
        let (manifest, _) = scene::import(&path, name, &ImportOptions::default(), &Silent).unwrap();
        let text = manifest.to_toml();
        let read = bth_scene::parse(&text, Path::new("x")).unwrap();
        assert_eq!(read, manifest, "{name}");
        let (direct, _) = compiled(&manifest, path.parent().unwrap());
        let (by_text, _) = compiled(&read, folder.path());
        assert!(direct.file().bytes() == by_text.file().bytes(), "{name}");
    }
}
