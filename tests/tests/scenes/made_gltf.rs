//! Small glTF documents of skins and morph targets.

use crate::support::{compiled, options};
use bth_compile::{Error, Silent};
use bth_import::gltf::scene::{ImportOptions, ImportReport, import};
use bth_scene::Manifest;
use serde_json::{Value, json};
use std::path::Path;

/// A glTF document in the making, with its binary data.
pub(crate) struct Document {
    pub(crate) json: Value,
    pub(crate) bytes: Vec<u8>,
}

/// A square of two triangles, and what moves its vertices.
pub(crate) const SQUARE: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

impl Document {
    /// A mesh of the square at node 0, whose transform must not count for a skin, and two joints
    /// below a moved node.
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

    pub(crate) fn attribute(&mut self, name: &str, accessor: usize) {
        self.json["meshes"][0]["primitives"][0]["attributes"][name] = accessor.into();
    }

    pub(crate) fn view(&mut self, bytes: &[u8]) -> usize {
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
    pub(crate) fn skinned(mut self, joints: [[u8; 4]; 4], weights: [[f32; 4]; 4]) -> Document {
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
    pub(crate) fn moving(self) -> Document {
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

    pub(crate) fn scene_with(&self, options: &ImportOptions) -> bth::Scene {
        let folder = self.written();
        let (manifest, _) = import(&folder.path().join("a.gltf"), "a.gltf", options, &Silent).unwrap();
        // The manifest's text says the same.
        let read = bth_scene::parse(&manifest.to_toml(), Path::new("x")).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(read, manifest);
        compiled(&manifest, folder.path()).0
    }

    pub(crate) fn scene(&self) -> bth::Scene {
        self.scene_with(&ImportOptions::default())
    }

    /// Positions in world space of the vertices of the first instance at a time, in the order of
    /// the square.
    pub(crate) fn world(&self, seconds: f64) -> Vec<[f64; 3]> {
        let mut scene = self.scene();
        scene.set_seconds(seconds).unwrap();
        world(&scene, 0)
    }

    /// The error of importing and compiling.
    pub(crate) fn error(&self) -> String {
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

/// Positions in world space of the vertices of an instance, as its triangles use them: the corners
/// of the square in its order.
pub(crate) fn world(scene: &bth::Scene, instance: u32) -> Vec<[f64; 3]> {
    let view = scene.instance(instance);
    let (positions, triangles) = (scene.positions(view.object), scene.object(view.object).triangles);
    let rows = [triangles[0][0], triangles[0][1], triangles[0][2], triangles[1][2]];
    let place =
        |p: [f32; 3]| view.to_world.map(|row| (0..3).map(|k| row[k] * f64::from(p[k])).sum::<f64>() + row[3]);
    rows.iter().map(|row| place(positions[*row as usize])).collect()
}

pub(crate) fn assert_near(found: &[[f64; 3]], expected: &[[f64; 3]]) {
    for (found, expected) in found.as_flattened().iter().zip(expected.as_flattened()) {
        assert!((found - expected).abs() <= 4e-6 * (1.0 + expected.abs()), "{found} is not {expected}");
    }
    assert_eq!(found.len(), expected.len());
}

/// Each vertex follows joint `a`, `b`, `b` and both.
pub(crate) fn one_skin() -> Document {
    let weights = [[1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.5, 0.5, 0.0, 0.0]];
    Document::new().skinned([[0; 4], [1, 0, 0, 0], [0, 1, 0, 0], [0, 1, 0, 0]], weights).moving()
}
