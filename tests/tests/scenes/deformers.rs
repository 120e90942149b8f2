//! Skins and morph targets of glTF files, rule by rule (glTF 2.0 specification, §3.7.2.2 and
//! §3.7.3), from small files whose vertices are computed by hand.

use crate::made_gltf::{Document, SQUARE, assert_near, one_skin, world};
use crate::morphs::morphed;
use crate::support::options;
use bth::rays::Ray;
use bth_compile::Silent;
use bth_import::gltf::Chosen;
use bth_import::gltf::scene::{ImportOptions, import};
use bth_import::{Deformation, Keep};
use bth_scene::Source;
use serde_json::{Value, json};
use std::path::Path;

#[test]
fn joints_take_all_their_ancestors_and_the_transform_of_the_skinned_node_has_no_effect() {
    // Joint a is at (0, 10, 5); b, twice as large, at (t, 10, 5).
    let at = |t: f64| [[0.0, 10.0, 5.0], [t + 2.0, 10.0, 5.0], [t + 2.0, 12.0, 5.0], [t / 2.0, 11.5, 5.0]];
    for seconds in [0.0, 0.5, 3.0, 8.0, 100.0] {
        assert_near(&one_skin().world(seconds), &at(seconds.min(8.0)));
    }
    // A scale of zero of the skinned node does not hide it either; its visibility does.
    let flat = one_skin().edit(|d| d["nodes"][0]["scale"] = json!([0, 0, 0]));
    assert_near(&flat.world(1.0), &at(1.0));
    assert!(flat.scene().instance(0).visible);
    let hidden = |d: &mut Value| {
        d["nodes"][0]["extensions"] = json!({"KHR_node_visibility": {"visible": false}});
        d["extensionsUsed"] = json!(["KHR_node_visibility"]);
    };
    assert_eq!(one_skin().edit(hidden).scene().instance_count(), 0);
}

#[test]
fn rays_hit_the_vertices_of_the_time_and_normals_turn_with_them() {
    // Tilted, so that they differ from the normals of the triangles.
    let normals = [[0.0f32, 0.6, 0.8]; 4];
    let quarter = 0.5f32.sqrt();
    let mut document = Document::new().skinned([[1, 0, 0, 0]; 4], [[1.0, 0.0, 0.0, 0.0]; 4]).animate(
        (3, "rotation", "LINEAR"),
        &[0.0, 2.0],
        &[[0.0, 0.0, 0.0, 1.0], [0.0, quarter, 0.0, quarter]],
    );
    let accessor = document.floats(&normals);
    document.attribute("NORMAL", accessor);
    let folder = document.written();
    let (manifest, _) =
        import(&folder.path().join("a.gltf"), "a.gltf", &ImportOptions::default(), &Silent).unwrap();
    let options = bth_compile::pipeline::CompileOptions { attributes: Keep::Normals, ..options() };
    let bytes = bth_compile::scene::compile(&manifest, folder.path(), Path::new("x"), &options, &Silent);
    let mut scene = bth::from_bytes(&bytes.unwrap().0.bytes).unwrap();
    let ray = Ray::new([0.5, 11.0, 20.0], [0.0, 0.0, -1.0]);
    let (hit, surface) = hit(&scene, &ray);
    assert!((hit - 15.0).abs() < 1e-5 && (surface.normal[2] - 0.8).abs() < 1e-6, "{surface:?}");
    // Half of a quarter turn about y: the square leans back.
    let update = scene.set_seconds(1.0).unwrap();
    assert_eq!((update.deformed, update.placed, scene.instance_count()), (1, 1, 1));
    let (distance, surface) = self::hit(&scene, &ray);
    assert!((distance - 15.5).abs() < 1e-5, "{distance}");
    let is_turned = |normal: [f64; 3], angle: f64| {
        let expected = [0.8 * angle.sin(), 0.6, 0.8 * angle.cos()];
        normal.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-6)
    };
    assert!(is_turned(surface.normal, std::f64::consts::FRAC_PI_4), "{surface:?}");
    assert_eq!(scene.set_seconds(1.0).unwrap().deformed, 0, "nothing has moved since");
    for seconds in [0.5, 0.25, 1.25, 0.0, 0.75] {
        scene.set_seconds(seconds).unwrap();
        let (_, surface) = self::hit(&scene, &ray);
        assert!(is_turned(surface.normal, seconds * std::f64::consts::FRAC_PI_4), "{seconds}: {surface:?}");
    }
    // Positions that a program gives have the normals of the triangles.
    let positions = scene.positions(0).to_vec();
    scene.set_positions(0, &positions).unwrap();
    let (_, surface) = self::hit(&scene, &ray);
    assert_eq!(surface.normal, surface.geometric_normal);
}

fn hit(scene: &bth::Scene, ray: &Ray) -> (f64, bth::SurfacePoint) {
    let hit = scene.nearest(ray).expect("the square is hit");
    (f64::from(hit.t), scene.surface(&hit).unwrap())
}

#[test]
fn subscenes_deform_and_are_placed_as_a_whole() {
    let file = one_skin().scene();
    let mut builder = bth::SceneBuilder::new();
    let first = builder.add(&file);
    let shifted = [1.0, 0.0, 0.0, 1000.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let one = builder.subscene(first, &shifted).unwrap();
    let two = builder.subscene(first, &[1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]).unwrap();
    // The subscene with the smallest id decides about the vertices.
    builder.set_subscene_seconds(one, 3.0).unwrap();
    let update = builder.commit().unwrap();
    assert_eq!((update.deformed, update.visible), (1, 2));
    let mut alone = one_skin().scene();
    alone.set_seconds(3.0).unwrap();
    let expected = world(&alone, 0);
    let moved: Vec<_> = expected.iter().map(|[x, y, z]| [x + 1000.0, *y, *z]).collect();
    assert_near(&world(builder.scene(), 0), &moved);
    assert_near(&world(builder.scene(), 1), &expected);
    assert_eq!(builder.commit().unwrap().deformed, 0);
    builder.remove_subscene(one).unwrap();
    assert_eq!(builder.commit().unwrap().deformed, 1);
    assert_near(&world(builder.scene(), 1), &world(&file, 0));
    // What the caller gives counts until the pose changes.
    let positions = vec![[7.0; 3]; file.vertex_count(0).unwrap()];
    builder.set_positions(first, &positions).unwrap();
    builder.commit().unwrap();
    assert_eq!(builder.scene().positions(first)[0], [7.0; 3]);
    builder.set_subscene_seconds(two, 1.0).unwrap();
    builder.commit().unwrap();
    alone.set_seconds(1.0).unwrap();
    assert_near(&world(builder.scene(), 1), &world(&alone, 0));
}

#[test]
fn inverse_binds_come_first_and_are_the_identity_where_they_are_missing() {
    let mut columns = [[0.0f32; 16]; 2];
    for matrix in &mut columns {
        (0..4).for_each(|i| matrix[5 * i] = 1.0);
    }
    (columns[0][12], columns[1][13]) = (-1.0, 4.0);
    let mut document = one_skin();
    let binds = document.floats(&columns);
    document.json["skins"][0]["inverseBindMatrices"] = binds.into();
    let expected = [[-1.0, 10.0, 5.0], [3.0, 18.0, 5.0], [3.0, 20.0, 5.0], [0.0, 15.5, 5.0]];
    assert_near(&document.world(1.0), &expected);
}

#[test]
fn eight_joints_count_and_weights_are_divided_by_their_sum() {
    let mut document = Document::new().skinned([[0, 1, 0, 1]; 4], [[1.0, 1.0, 0.0, 0.0]; 4]).moving();
    assert_near(&document.world(2.0)[1..2], &[[2.5, 10.0, 5.0]]);
    let joints = document.integers(&[1; 16], "VEC4", 4);
    let weights = document.floats(&[[1.0f32, 0.5, 0.25, 0.25]; 4]);
    document.attribute("JOINTS_1", joints);
    document.attribute("WEIGHTS_1", weights);
    // A quarter of a, three quarters of b.
    let expected = [[1.5, 10.0, 5.0], [3.25, 10.0, 5.0], [3.25, 11.75, 5.0], [1.5, 11.75, 5.0]];
    assert_near(&document.world(2.0), &expected);
    let third = document.json["meshes"][0]["primitives"][0]["attributes"]["JOINTS_1"].clone();
    let error = document
        .edit(|d| {
            let attributes = &mut d["meshes"][0]["primitives"][0]["attributes"];
            attributes["JOINTS_2"] = third;
            attributes["WEIGHTS_2"] = attributes["WEIGHTS_1"].clone();
        })
        .error();
    assert!(error.contains("BTH-I006") && error.contains("up to 8 joints"), "{error}");
}

#[test]
fn weights_of_bytes_are_fractions_and_a_vertex_without_weights_follows_its_first_joint() {
    let mut document = one_skin();
    let weights = document.integers(&[255, 0, 0, 0, 0, 0, 0, 0, 0, 255, 0, 0, 51, 204, 0, 0], "VEC4", 4);
    document.json["accessors"][weights]["normalized"] = true.into();
    document.attribute("WEIGHTS_0", weights);
    let expected = [[0.0, 10.0, 5.0], [3.0, 10.0, 5.0], [3.0, 12.0, 5.0], [0.8, 11.8, 5.0]];
    assert_near(&document.world(1.0), &expected);
}

#[test]
fn several_skins_on_one_mesh_are_objects_of_their_own() {
    let document = one_skin().edit(|d| {
        d["nodes"].as_array_mut().unwrap().push(json!({"mesh": 0, "skin": 1}));
        d["nodes"].as_array_mut().unwrap().push(json!({"mesh": 0, "translation": [0, 0, 50]}));
        d["scenes"][0]["nodes"] = json!([0, 1, 4, 5]);
        d["skins"].as_array_mut().unwrap().push(json!({"joints": [3, 2]}));
    });
    let (manifest, report) = document.imported(&ImportOptions::default()).unwrap();
    let sources: Vec<_> = manifest.objects.iter().map(|object| &object.source).collect();
    let deforming = Source::Deforming { path: "a.gltf".into(), mesh: 0, without: Default::default() };
    let still = Source::Model { path: "a.gltf".into(), mesh: Some(0) };
    assert_eq!(sources, [&deforming, &deforming, &still]);
    assert_eq!((report.deformers, manifest.skins.len()), (2, 2));
    let mut scene = document.scene();
    scene.set_seconds(1.0).unwrap();
    assert_near(&world(&scene, 0), &[[0.0, 10.0, 5.0], [3.0, 10.0, 5.0], [3.0, 12.0, 5.0], [0.5, 11.5, 5.0]]);
    assert_near(&world(&scene, 1), &[[1.0, 10.0, 5.0], [1.0, 10.0, 5.0], [1.0, 11.0, 5.0], [0.5, 11.5, 5.0]]);
    assert_near(&world(&scene, 2)[2..3], &[[1.0, 1.0, 50.0]]);
}

#[test]
fn what_no_chosen_animation_moves_is_at_rest_in_world_space() {
    let rest = [[0.0, 10.0, 5.0], [2.0, 10.0, 5.0], [2.0, 12.0, 5.0], [0.0, 11.5, 5.0]];
    for options in [
        ImportOptions { animation: Chosen::None, ..ImportOptions::default() },
        ImportOptions { deform: false, ..ImportOptions::default() },
    ] {
        let scene = one_skin().scene_with(&options);
        assert_eq!((scene.instance_count(), scene.vertex_count(0)), (1, None));
        assert_near(&world(&scene, 0), &rest);
    }
    let options = ImportOptions { deform: false, strict: true, ..ImportOptions::default() };
    assert!(one_skin().imported(&options).unwrap_err().to_string().contains("BTH-I015"));
    let strict = ImportOptions { strict: true, ..ImportOptions::default() };
    assert!(one_skin().imported(&strict).is_ok(), "nothing is left out");
}

#[test]
fn joints_outside_of_the_scene_get_nodes() {
    let document = one_skin().edit(|d| d["scenes"][0]["nodes"] = json!([0]));
    let (manifest, _) = document.imported(&ImportOptions::default()).unwrap();
    assert_eq!(manifest.nodes.iter().map(|n| n.name).collect::<Vec<_>>(), ["mesh", "root", "a", "b"]);
    assert_near(&document.world(2.0)[1..2], &[[4.0, 10.0, 5.0]]);
}

#[test]
fn the_first_animation_is_chosen_and_the_others_are_listed() {
    let document = one_skin().edit(|d| {
        let second = json!({"name": "second", "channels": [], "samplers": []});
        d["animations"].as_array_mut().unwrap().push(second);
    });
    let (_, report) = document.imported(&ImportOptions::default()).unwrap();
    assert_eq!(
        (report.animations, report.animations_left_out),
        (vec!["first".to_owned()], vec!["second".into()])
    );
    let second = ImportOptions { animation: Chosen::One("second".into()), ..ImportOptions::default() };
    let (manifest, report) = document.imported(&second).unwrap();
    assert_eq!(report.animations_left_out, ["first"]);
    assert!(manifest.tracks.is_empty() && manifest.deformers.is_empty());
    let all = ImportOptions { animation: Chosen::All, ..ImportOptions::default() };
    assert!(document.imported(&all).unwrap().1.animations_left_out.is_empty());
}

#[test]
fn equal_positions_are_one_vertex_only_where_they_move_alike() {
    let mut document = Document::new();
    let twice = [SQUARE[0], SQUARE[1], SQUARE[2], SQUARE[0], SQUARE[2], SQUARE[3]];
    let (positions, indices) = (document.floats(&twice), document.integers(&[0, 1, 2, 3, 4, 5], "SCALAR", 1));
    document.attribute("POSITION", positions);
    document.json["meshes"][0]["primitives"][0]["indices"] = indices.into();
    let joints = document.integers(&[0, 0, 0, 0].repeat(6), "VEC4", 4);
    let mut weights = [[1.0f32, 0.0, 0.0, 0.0]; 6];
    // The third vertex and its copy have other weights.
    weights[4] = [0.5, 0.5, 0.0, 0.0];
    let weights = document.floats(&weights);
    document.attribute("JOINTS_0", joints);
    document.attribute("WEIGHTS_0", weights);
    let folder = document.written();
    let parts = [bth_import::GltfPart::Deforming { mesh: 0, without: Default::default() }];
    let meshes = bth_import::import_gltf_parts(&folder.path().join("a.gltf"), &parts, Keep::None, &Silent);
    let (mesh, report) = &meshes.unwrap()[0];
    assert_eq!((mesh.positions.len(), report.positions_read), (5, 6));
    let Some(Deformation { counts, joints, weights, morphs, .. }) = &mesh.deformation else { panic!() };
    assert_eq!((counts.joints, counts.influence_sets, counts.targets), (1, 1, 0));
    assert_eq!((joints.len(), weights.len(), morphs.len()), (5, 5, 0));
}

#[test]
fn refuses_what_means_nothing() {
    let case = |document: Document, words: &[&str]| {
        let error = document.error();
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
    };
    case(one_skin().edit(|d| d["skins"][0]["joints"] = json!([3])), &["BTH-I052", "refer to 2", "it has 1"]);
    case(one_skin().edit(|d| d["skins"][0]["joints"] = json!([2, 99])), &["BTH-I012", "node 99"]);
    case(one_skin().edit(|d| d["skins"][0]["joints"] = json!([])), &["BTH-I005"]);
    case(one_skin().edit(|d| d["nodes"][0]["skin"] = 7.into()), &["BTH-I012", "skin 7"]);
    let lacking = |d: &mut Value| {
        d["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("WEIGHTS_0");
    };
    case(one_skin().edit(lacking), &["BTH-I005", "WEIGHTS_0"]);
    let mut negative = one_skin();
    let weights = negative.floats(&[[1.0f32, -0.5, 0.0, 0.0]; 4]);
    negative.attribute("WEIGHTS_0", weights);
    case(negative, &["BTH-I017", "-0.5"]);
    let mut not_a_number = one_skin();
    let weights = not_a_number.floats(&[[f32::NAN, 0.0, 0.0, 0.0]; 4]);
    not_a_number.attribute("WEIGHTS_0", weights);
    case(not_a_number, &["BTH-I017", "NaN"]);
    let mut short = one_skin();
    let weights = short.floats(&[[1.0f32, 0.0, 0.0, 0.0]; 3]);
    short.attribute("WEIGHTS_0", weights);
    case(short, &["BTH-I005", "expected 4 rows"]);
    let animated = || morphed().animate((0, "weights", "LINEAR"), &[0.0], &[[0.0f32], [1.0]]);
    case(
        animated().edit(|d| d["meshes"][0]["weights"] = json!([1.0])),
        &["BTH-I017", "2 morph targets", "found 1"],
    );
    let mut infinite = morphed();
    let deltas = infinite.floats(&[[f32::INFINITY, 0.0, 0.0]; 4]);
    infinite.json["meshes"][0]["primitives"][0]["targets"][0]["POSITION"] = deltas.into();
    case(infinite.animate((0, "weights", "LINEAR"), &[0.0], &[[0.0f32], [1.0]]), &["BTH-I017", "finite"]);
    case(
        morphed().animate((0, "weights", "LINEAR"), &[0.0, 1.0], &[[0.0f32], [1.0], [0.0]]),
        &["BTH-I012", "rows of values"],
    );
}

#[test]
fn poses_that_are_not_finite_are_an_error_that_changes_nothing() {
    let huge = [[0.0f32; 3], [3e38, 0.0, 0.0], [0.0; 3]];
    let document = one_skin().edit(|d| d["animations"] = json!([]));
    let document = document.animate((3, "translation", "LINEAR"), &[0.0, 1.0, 2.0], &huge);
    let document = document.edit(|d| d["nodes"][2]["scale"] = json!([100, 1, 1]));
    let mut scene = document.scene();
    let before = world(&scene, 0);
    let error = scene.set_seconds(1.0).unwrap_err();
    assert_eq!(error.code(), bth::Code::NotFinite);
    assert!(error.to_string().contains("\"mesh\""), "{error}");
    assert_eq!((world(&scene, 0), scene.seconds()), (before, 0.0));
    scene.set_seconds(2.0).unwrap();
}
