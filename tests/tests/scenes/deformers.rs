//! Skins and morph targets of glTF files, rule by rule (glTF 2.0 specification, §3.7.2.2 and §3.7.3), from small files whose
//! vertices are computed by hand.

use crate::support::{compiled, options};
use bth::rays::Ray;
use bth_compile::{Error, Silent};
use bth_import::gltf::Chosen;
use bth_import::gltf::scene::{ImportOptions, ImportReport, import};
use bth_import::{Deformation, Keep};
use bth_scene::{Manifest, Property, Source};
use serde_json::{Value, json};
use std::path::Path;

/// A glTF document in the making, with its binary data.
pub(crate) struct Document {
    pub(crate) json: Value,
    bytes: Vec<u8>,
}

/// A square of two triangles, and what moves its vertices.
const SQUARE: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

impl Document {
    /// A mesh of the square at node 0, whose transform must not count for a skin, and two joints below a moved node.
    pub(crate) fn new() -> Document {
        let mut document = Document { json: json!({}), bytes: Vec::new() };
        document.json = json!({
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0, 1]}],
            "nodes": [
                {"name": "mesh", "mesh": 0, "translation": [100, 0, 0], "scale": [3, 3, 3]},
                {"name": "root", "children": [2], "translation": [0, 10, 0]},
                {"name": "a", "children": [3], "translation": [0, 0, 5]},
                {"name": "b", "scale": [2, 2, 2]}
            ],
            "meshes": [{"name": "square", "primitives": [{"attributes": {}, "indices": 0}]}],
            "accessors": [], "bufferViews": [], "animations": []
        });
        let indices = document.integers(&[0, 1, 2, 0, 2, 3], "SCALAR", 1);
        let positions = document.floats(&SQUARE);
        document.json["meshes"][0]["primitives"][0]["indices"] = indices.into();
        document.attribute("POSITION", positions);
        document
    }

    fn attribute(&mut self, name: &str, accessor: usize) {
        self.json["meshes"][0]["primitives"][0]["attributes"][name] = accessor.into();
    }

    fn view(&mut self, bytes: &[u8]) -> usize {
        while !self.bytes.len().is_multiple_of(4) {
            self.bytes.push(0);
        }
        let view = json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()});
        self.bytes.extend(bytes);
        push(&mut self.json["bufferViews"], view)
    }

    pub(crate) fn floats<const N: usize>(&mut self, rows: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = rows.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
        let view = self.view(&bytes);
        let shape = match N {
            1 => "SCALAR",
            2..=4 => ["VEC2", "VEC3", "VEC4"][N - 2],
            _ => "MAT4",
        };
        let accessor = json!({"bufferView": view, "componentType": 5126, "count": rows.len(), "type": shape});
        push(&mut self.json["accessors"], accessor)
    }

    pub(crate) fn integers(&mut self, numbers: &[u8], shape: &str, width: usize) -> usize {
        let view = self.view(numbers);
        let count = numbers.len() / width;
        let accessor = json!({"bufferView": view, "componentType": 5121, "count": count, "type": shape});
        push(&mut self.json["accessors"], accessor)
    }

    /// A skin of nodes `a` and `b` for node 0, with a joint and weights for each vertex.
    fn skinned(mut self, joints: [[u8; 4]; 4], weights: [[f32; 4]; 4]) -> Document {
        let joints = self.integers(joints.as_flattened(), "VEC4", 4);
        let weights = self.floats(&weights);
        self.attribute("JOINTS_0", joints);
        self.attribute("WEIGHTS_0", weights);
        self.json["skins"] = json!([{"joints": [2, 3], "skeleton": 0}]);
        self.json["nodes"][0]["skin"] = 0.into();
        self
    }

    /// A channel of the first animation.
    pub(crate) fn animate<const N: usize>(
        mut self,
        (node, path, interpolation): (usize, &str, &str),
        times: &[f32],
        values: &[[f32; N]],
    ) -> Document {
        let times: Vec<[f32; 1]> = times.iter().map(|t| [*t]).collect();
        let (input, output) = (self.floats(&times), self.floats(values));
        if self.json["animations"][0].is_null() {
            push(&mut self.json["animations"], json!({"name": "first", "channels": [], "samplers": []}));
        }
        let animation = &mut self.json["animations"][0];
        let sampler = json!({"input": input, "output": output, "interpolation": interpolation});
        let sampler = push(&mut animation["samplers"], sampler);
        let target = json!({"node": node, "path": path});
        push(&mut animation["channels"], json!({"sampler": sampler, "target": target}));
        self
    }

    /// Joint `b` moves by (t, 0, 0) at t seconds.
    fn moving(self) -> Document {
        self.animate((3, "translation", "LINEAR"), &[0.0, 8.0], &[[0.0; 3], [8.0, 0.0, 0.0]])
    }

    pub(crate) fn edit(mut self, edit: impl FnOnce(&mut Value)) -> Document {
        edit(&mut self.json);
        self
    }

    pub(crate) fn written(&self) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let mut json = self.json.clone();
        json["buffers"] = json!([{"uri": "data.bin", "byteLength": self.bytes.len()}]);
        std::fs::write(folder.path().join("a.gltf"), json.to_string()).unwrap();
        std::fs::write(folder.path().join("data.bin"), &self.bytes).unwrap();
        folder
    }

    pub(crate) fn imported(&self, options: &ImportOptions) -> Result<(Manifest, ImportReport), Error> {
        let folder = self.written();
        import(&folder.path().join("a.gltf"), "a.gltf", options, &Silent)
    }

    fn scene_with(&self, options: &ImportOptions) -> bth::Scene {
        let folder = self.written();
        let (manifest, _) = import(&folder.path().join("a.gltf"), "a.gltf", options, &Silent).unwrap();
        // The manifest's text says the same.
        let read = bth_scene::parse(&manifest.to_toml(), Path::new("x")).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(read, manifest);
        compiled(&manifest, folder.path()).0
    }

    fn scene(&self) -> bth::Scene {
        self.scene_with(&ImportOptions::default())
    }

    /// Positions in world space of the vertices of the first instance at a time, in the order of the square.
    fn world(&self, seconds: f64) -> Vec<[f64; 3]> {
        let mut scene = self.scene();
        scene.set_seconds(seconds).unwrap();
        world(&scene, 0)
    }

    /// The error of importing and compiling.
    fn error(&self) -> String {
        let folder = self.written();
        let manifest = import(&folder.path().join("a.gltf"), "a.gltf", &ImportOptions::default(), &Silent);
        let manifest = match manifest {
            Ok((manifest, _)) => manifest,
            Err(error) => return error.to_string(),
        };
        let compiled =
            bth_compile::scene::compile(&manifest, folder.path(), Path::new("x"), &options(), &Silent);
        compiled.expect_err("a file that is refused").to_string()
    }
}

pub(crate) fn push(array: &mut Value, value: Value) -> usize {
    let array = array.as_array_mut().unwrap();
    array.push(value);
    array.len() - 1
}

/// Positions in world space of the vertices of an instance, as its triangles use them: those of the square in its order.
fn world(scene: &bth::Scene, instance: u32) -> Vec<[f64; 3]> {
    let view = scene.instance(instance);
    let (positions, triangles) = (scene.positions(view.object), scene.object(view.object).triangles);
    let rows = [triangles[0][0], triangles[0][1], triangles[0][2], triangles[1][2]];
    let place =
        |p: [f32; 3]| view.to_world.map(|row| (0..3).map(|k| row[k] * f64::from(p[k])).sum::<f64>() + row[3]);
    rows.iter().map(|row| place(positions[*row as usize])).collect()
}

fn assert_near(found: &[[f64; 3]], expected: &[[f64; 3]]) {
    for (found, expected) in found.as_flattened().iter().zip(expected.as_flattened()) {
        assert!((found - expected).abs() <= 4e-6 * (1.0 + expected.abs()), "{found} is not {expected}");
    }
    assert_eq!(found.len(), expected.len());
}

/// Each vertex follows joint `a`, `b`, `b` and both.
fn one_skin() -> Document {
    let weights = [[1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.5, 0.5, 0.0, 0.0]];
    Document::new().skinned([[0; 4], [1, 0, 0, 0], [0, 1, 0, 0], [0, 1, 0, 0]], weights).moving()
}

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
    // Tilted, so that they are not those of the triangles.
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
    // The subscene of least id decides about the vertices.
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

/// The square with two targets: one lifts its vertices, a sparse one moves the last.
fn morphed() -> Document {
    let mut document = Document::new();
    let lift = document.floats(&[[0.0f32, 0.0, 1.0], [0.0, 0.0, 2.0], [0.0, 0.0, 3.0], [0.0, 0.0, 4.0]]);
    let (places, news) = (document.view(&[3]), document.view(&(-7.0f32).to_le_bytes().repeat(3)));
    let sparse = json!({"componentType": 5126, "count": 4, "type": "VEC3", "sparse": {"count": 1,
        "indices": {"bufferView": places, "componentType": 5121}, "values": {"bufferView": news}}});
    let sparse = push(&mut document.json["accessors"], sparse);
    document.edit(|d| {
        d["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": lift}, {"POSITION": sparse}]);
        d["nodes"][0]["scale"] = json!([1, 1, 1]);
    })
}

#[test]
fn morph_targets_of_weights_that_are_animated_in_every_way() {
    let at = |a: f64, b: f64| {
        [
            [100.0, 0.0, a],
            [101.0, 0.0, 2.0 * a],
            [101.0, 1.0, 3.0 * a],
            [100.0 - 7.0 * b, 1.0 - 7.0 * b, 4.0 * a - 7.0 * b],
        ]
    };
    let keys: [[f32; 1]; 6] = [[0.0], [0.0], [1.0], [0.5], [0.5], [1.0]];
    // Keys at 1, 2 and 4 seconds; before and behind them the weights are constant.
    for (interpolation, times) in [("LINEAR", [0.0, 1.25, 3.0, 9.0]), ("STEP", [0.5, 1.75, 3.9, 4.0])] {
        let document = morphed().animate((0, "weights", interpolation), &[1.0, 2.0, 4.0], &keys);
        let expected = match interpolation {
            "LINEAR" => [at(0.0, 0.0), at(0.25, 0.125), at(0.75, 0.75), at(0.5, 1.0)],
            _ => [at(0.0, 0.0), at(0.0, 0.0), at(1.0, 0.5), at(0.5, 1.0)],
        };
        let mut scene = document.scene();
        for (seconds, expected) in times.into_iter().zip(expected) {
            scene.set_seconds(seconds).unwrap();
            assert_near(&world(&scene, 0), &expected);
        }
    }
    // In-tangents, values and out-tangents of both targets at each key.
    let cubic: [[f32; 2]; 6] = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [3.0, 0.0], [1.0, 0.0], [0.0, 0.0]];
    let cubic: Vec<[f32; 1]> = cubic.as_flattened().iter().map(|x| [*x]).collect();
    let document = morphed().animate((0, "weights", "CUBICSPLINE"), &[0.0, 2.0], &cubic);
    // At the middle, by halves of the values and an eighth of the duration times the difference of the tangents.
    assert_near(&document.world(1.0), &at(0.5 + 2.0 / 8.0 * (1.0 - 3.0), 0.5));
    assert_near(&document.world(2.0), &at(1.0, 0.0));
}

#[test]
fn default_weights_are_those_of_the_node_or_else_of_the_mesh_and_come_before_the_skin() {
    let of_mesh = |document: Document| document.edit(|d| d["meshes"][0]["weights"] = json!([0.5, 0.0]));
    let still = of_mesh(morphed()).scene();
    assert!(still.vertex_count(0).is_none(), "what nothing moves does not deform");
    assert_near(&world(&still, 0)[2..3], &[[101.0, 1.0, 1.5]]);
    let of_node = of_mesh(morphed()).edit(|d| d["nodes"][0]["weights"] = json!([2.0, 0.0])).scene();
    assert_near(&world(&of_node, 0)[2..3], &[[101.0, 1.0, 6.0]]);
    // With a skin all is doubled by joint b, and moved by it.
    let mut both = of_mesh(morphed());
    let joints = both.integers(&[1; 16], "VEC4", 4);
    let weights = both.floats(&[[1.0f32, 0.0, 0.0, 0.0]; 4]);
    both.attribute("JOINTS_0", joints);
    both.attribute("WEIGHTS_0", weights);
    let both = both.edit(|d| {
        d["skins"] = json!([{"joints": [2, 3]}]);
        d["nodes"][0]["skin"] = 0.into();
    });
    assert_near(&both.moving().world(1.0)[2..3], &[[3.0, 12.0, 8.0]]);
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
    assert_eq!(
        manifest.nodes.iter().map(|n| n.name.as_str()).collect::<Vec<_>>(),
        ["mesh", "root", "a", "b"]
    );
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

#[test]
fn tracks_of_weights_need_a_deformer_with_weights() {
    let text = "version = 1\nnodes = [{ name = \"a\" }]\n[[tracks]]\nnode = \"a\"\nproperty = \"weights\"\ntimes = [0]\nvalues = [[1]]";
    let error = bth_scene::parse(text, Path::new("x")).unwrap_err().to_string();
    assert!(error.contains("BTH-M013") && error.contains("deformer"), "{error}");
    assert_eq!(Property::Weights.width(), None);
}
