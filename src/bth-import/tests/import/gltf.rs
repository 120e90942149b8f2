use super::*;
use serde_json::{Value, json};

/// A GLB of a document and its binary chunk.
pub(super) fn glb(document: &Value, binary: &[u8]) -> Vec<u8> {
    let mut json = document.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut binary = binary.to_vec();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((28 + json.len() as u32 + binary.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", json), (b"BIN\0", binary)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    bytes
}

/// A document and its binary chunk.
pub(super) struct Model {
    pub(super) document: Value,
    pub(super) binary: Vec<u8>,
}

/// A type of components.
pub(super) trait Component: Copy {
    const CODE: u32;
    fn bytes(self) -> Vec<u8>;
}

impl Component for f32 {
    const CODE: u32 = 5126;
    fn bytes(self) -> Vec<u8> {
        self.to_le_bytes().to_vec()
    }
}

impl Component for u16 {
    const CODE: u32 = 5123;
    fn bytes(self) -> Vec<u8> {
        self.to_le_bytes().to_vec()
    }
}

impl Component for u8 {
    const CODE: u32 = 5121;
    fn bytes(self) -> Vec<u8> {
        vec![self]
    }
}

impl Model {
    /// A document of version 2.0 without accessors.
    pub(super) fn new(mut document: Value) -> Self {
        document["asset"] = json!({"version": "2.0"});
        for key in ["accessors", "bufferViews"] {
            document[key] = json!([]);
        }
        Model { document, binary: Vec::new() }
    }

    /// Adds a buffer view of these bytes.
    pub(super) fn view(mut self, bytes: &[u8]) -> Self {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let view = json!({"buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len()});
        self.document["bufferViews"].as_array_mut().unwrap().push(view);
        self.binary.extend(bytes);
        self.document["buffers"] = json!([{"byteLength": self.binary.len()}]);
        self
    }

    /// Adds an accessor of these rows with a separate view.
    pub(super) fn rows<T: Component, const N: usize>(mut self, rows: &[[T; N]]) -> Self {
        let shape = match N {
            1 => "SCALAR".to_owned(),
            16 => "MAT4".to_owned(),
            _ => format!("VEC{N}"),
        };
        let view = self.document["bufferViews"].as_array().unwrap().len();
        let accessor =
            json!({"bufferView": view, "componentType": T::CODE, "count": rows.len(), "type": shape});
        self.document["accessors"].as_array_mut().unwrap().push(accessor);
        self.view(&rows.as_flattened().iter().flat_map(|x| x.bytes()).collect::<Vec<u8>>())
    }

    /// The file.
    pub(super) fn glb(&self) -> Vec<u8> {
        glb(&self.document, &self.binary)
    }
}

/// The square as 48 bytes of positions, 6 u16 indices, and 48 bytes of normals along z.
pub(super) fn binary() -> Vec<u8> {
    let mut bytes: Vec<u8> = SQUARE.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    for _ in 0..4 {
        bytes.extend([0.0f32, 0.0, 1.0].iter().flat_map(|x| x.to_le_bytes()));
    }
    bytes
}

fn document() -> Value {
    json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 2}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"},
            {"bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC3"}
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 12},
            {"buffer": 0, "byteOffset": 60, "byteLength": 48}
        ],
        "buffers": [{"byteLength": 108}]
    })
}

pub(super) fn edited(edit: impl FnOnce(&mut Value)) -> Value {
    let mut document = document();
    edit(&mut document);
    document
}

#[track_caller]
pub(super) fn read(document: &Value) -> (Mesh, Report) {
    import_bytes("a.glb", &glb(document, &binary()), Keep::None).unwrap()
}

#[track_caller]
pub(super) fn assert_bad(edit: impl FnOnce(&mut Value), code: &str, place: &str, message: &str) {
    assert_refused("a.glb", &glb(&edited(edit), &binary()), code, place, message);
}

#[test]
fn a_glb_is_read_with_its_normals() {
    let (mesh, report) = import_bytes("a.glb", &glb(&document(), &binary()), Keep::All).unwrap();
    assert_eq!(mesh.positions, SQUARE);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    let attributes = mesh.attributes.unwrap();
    assert_eq!((attributes.normals.len(), attributes.uvs.len()), (4, 0));
    assert_eq!((report.format.as_str(), report.positions_read), ("gltf", 4));
}

#[test]
fn json_that_is_padded_with_zeros_is_read_with_a_warning() {
    for length in 0..4 {
        let document = edited(|d| d["asset"]["generator"] = "x".repeat(length).into());
        let mut bytes = glb(&document, &binary());
        let end = 20 + u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        let blanks = bytes[..end].iter().rev().take_while(|byte| **byte == b' ').count();
        bytes[end - blanks..end].fill(0);
        let listener = Listener::default();
        let (mesh, _) = import_with("a.glb", &bytes, Keep::None, &listener).unwrap();
        assert_eq!(mesh.triangles.len(), 2);
        assert_eq!(listener.heard("padded with zeros"), blanks > 0, "{length}");
    }
}

#[test]
fn buffers_may_be_external_or_embedded() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    std::fs::write(folder.path().join("a b.bin"), [binary(), vec![0; 9]].concat()).unwrap();
    let base64 = "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAgD8AAAAAAAAAAAAAgD8AAAAA";
    for (uri, indexed) in [("a%20b.bin", true), (base64, false)] {
        let document = edited(|d| {
            d["buffers"][0] = json!({"uri": uri, "byteLength": if indexed { 108 } else { 48 }});
            if !indexed {
                d["meshes"][0]["primitives"][0] = json!({"attributes": {"POSITION": 0}, "mode": 5});
            }
        });
        std::fs::write(&path, document.to_string()).unwrap();
        assert_eq!(import(&path, Keep::None, &Silent).unwrap().0.triangles.len(), 2);
        let external = indexed.then(|| folder.path().join("a b.bin"));
        let files: Vec<_> = std::iter::once(path.clone()).chain(external).collect();
        assert_eq!(bth_import::source_files(&path, bth_import::AlphaMode::None).unwrap(), files);
    }
    let long = format!("DATA:,\u{1b}{}", "A".repeat(1 << 20));
    for uri in ["/etc/hostname", "http://x/y.bin", "data:,abc", "", &long] {
        std::fs::write(&path, edited(|d| d["buffers"][0]["uri"] = uri.into()).to_string()).unwrap();
        let error = import(&path, Keep::None, &Silent).unwrap_err();
        assert!(matches!(error, Error::Input { code: "BTH-I014", .. }), "{error}");
        let text = error.to_string();
        assert!(text.len() < 400 && !text.contains('\u{1b}'), "{} bytes", text.len());
    }
    for uri in ["100%.bin", "a%2", "a%zz.bin", "%ff.bin"] {
        std::fs::write(&path, edited(|d| d["buffers"][0]["uri"] = uri.into()).to_string()).unwrap();
        let error = import(&path, Keep::None, &Silent).unwrap_err().to_string();
        assert!(error.contains("BTH-I014") && error.contains(uri) && error.contains("as %25"), "{error}");
    }
    std::fs::write(&path, edited(|d| d["buffers"][0]["uri"] = "absent.bin".into()).to_string()).unwrap();
    let error = import(&path, Keep::None, &Silent).unwrap_err();
    assert!(error.to_string().contains("absent.bin: BTH-O001"), "{error}");
}

#[test]
fn nodes_place_meshes_in_depth_first_order() {
    let document = edited(|d| {
        d["scenes"][0]["nodes"] = json!([3, 0]);
        d["nodes"] = json!([
            {"mesh": 0},
            {"mesh": 0, "translation": [0, 0, 1]},
            {"mesh": 0, "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,2,1]},
            {"children": [1, 2], "scale": [2, 2, 2], "translation": [0, 0, 10]}
        ]);
    });
    let (mesh, report) = read(&document);
    let heights: Vec<_> = (0..6).map(|t| mesh.corners(t)[0][2]).collect();
    assert_eq!(heights, [12.0, 12.0, 14.0, 14.0, 0.0, 0.0]);
    assert_eq!(mesh.corners(0)[1], [2.0, 0.0, 12.0]);
    assert_eq!((report.triangles, report.components), (6, 3));
}

#[test]
fn mirrored_instances_keep_their_front_sides() {
    let document = edited(|d| d["nodes"][0]["scale"] = json!([-1, 1, 1]));
    let bytes = glb(&document, &binary());
    let mesh = import_bytes("a.glb", &bytes, Keep::Normals).unwrap().0;
    for t in 0..2 {
        let [a, b, c] = mesh.corners(t);
        assert!((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0);
    }
    assert!(mesh.attributes.unwrap().normals.iter().all(|n| *n == [0.0, 0.0, 1.0]));
}

#[test]
fn the_default_scene_is_the_first_and_without_scenes_all_roots() {
    let two = |scene: Value| {
        edited(|d| {
            d["scene"] = scene;
            d["scenes"] = json!([{"nodes": [0]}, {"nodes": [0, 1]}]);
            d["nodes"] = json!([{"mesh": 0}, {"mesh": 0, "translation": [0, 0, 1]}]);
        })
    };
    assert_eq!(read(&two(Value::Null)).0.triangles.len(), 2);
    assert_eq!(read(&two(1.into())).0.triangles.len(), 4);
    let none = edited(|d| {
        d.as_object_mut().unwrap().retain(|key, _| !key.starts_with("scene"));
        d["nodes"] = json!([{"mesh": 0}, {"children": [0]}]);
    });
    assert_eq!(read(&none).0.triangles.len(), 2);
}

#[test]
fn strips_fans_points_and_lines_follow_the_specification() {
    let mode = |mode: u32| {
        read(&edited(|d| {
            d["meshes"][0]["primitives"][0] = json!({"attributes": {"POSITION": 0}, "mode": mode})
        }))
    };
    let corners = |mesh: &Mesh| (0..2).map(|t| mesh.corners(t)).collect::<Vec<_>>();
    assert_eq!(corners(&mode(5).0), [[0, 1, 2], [1, 3, 2]].map(|t| t.map(|v: usize| SQUARE[v])));
    assert_eq!(corners(&mode(6).0), [[1, 2, 0], [2, 3, 0]].map(|t| t.map(|v: usize| SQUARE[v])));
    for (kind, skipped) in [(0, 4), (1, 2), (2, 4), (3, 3)] {
        let (mesh, report) = mode(kind);
        assert_eq!((mesh.triangles.len(), report.skipped), (0, skipped));
    }
}

#[test]
fn quantized_and_sparse_positions_are_read() {
    let document = edited(|d| {
        d["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        d["accessors"][0] = json!({"bufferView": 1, "componentType": 5121, "normalized": true, "count": 3,
            "type": "VEC3", "sparse": {"count": 1, "indices": {"bufferView": 1, "byteOffset": 2, "componentType": 5123},
            "values": {"bufferView": 1, "byteOffset": 4}}});
        d["meshes"][0]["primitives"][0] = json!({"attributes": {"POSITION": 0}});
    });
    // The bytes of the indices: 0 0 1 0 2 0 0 0 2 0 3 0; row 1 becomes 2 0 0.
    let mesh = read(&document).0;
    let byte = |x: u8| (f64::from(x) / 255.0) as f32;
    let expected = [[0, 0, 1], [2, 0, 0], [0, 0, 2]].map(|p| p.map(byte));
    assert_eq!(mesh.corners(0), expected);
}

#[test]
fn refuses_required_extensions_by_name() {
    for name in ["ACME_mesh_compression", "ACME_secret_geometry"] {
        assert_bad(|d| d["extensionsRequired"] = json!([name]), "BTH-I011", name, name);
    }
    let used = |d: &mut Value| {
        d["accessors"][0].as_object_mut().unwrap().remove("bufferView");
        d["meshes"][0]["primitives"][0]["extensions"] = json!({"ACME_mesh_compression": {}});
    };
    assert_bad(used, "BTH-I011", "ACME_mesh_compression", "ACME_mesh_compression");
    let fine = edited(|d| d["extensionsRequired"] = json!(["KHR_materials_unlit", "KHR_texture_transform"]));
    assert_eq!(read(&fine).0.triangles.len(), 2);
}

#[test]
fn refuses_graphs_that_are_not_trees_and_what_does_not_exist_or_fit() {
    let sparse = json!({"count": 1, "indices": {"bufferView": 1, "byteOffset": 10, "componentType": 5123},
        "values": {"bufferView": 2}});
    let zeros = json!({"componentType": 5126, "count": 4_000_000_000u32, "type": "VEC3", "sparse": sparse});
    let two = json!([{"mesh": 0, "children": [1]}, {"children": [0]}]);
    let (view, primitive) = ("/bufferViews/0", "/meshes/0/primitives/0");
    let max = u64::MAX;
    for (at, key, value, code, place, message) in [
        ("", "nodes", two, "BTH-I012", "node 0", "one parent"),
        ("/scenes/0", "nodes", json!([0, 0]), "BTH-I012", "node 0", "one parent"),
        ("/scenes/0", "nodes", json!([7]), "BTH-I012", "node 7", "does not exist"),
        ("", "scene", json!(4), "BTH-I012", "scene 4", "does not exist"),
        ("/nodes/0", "mesh", json!(4), "BTH-I012", "node 0", "expected a mesh below 1, found 4"),
        ("/accessors/0", "count", json!(5), "BTH-I013", "accessor 0", "5 rows do not fit into buffer view 0"),
        ("/accessors/0", "count", json!(4_000_000_000u64), "BTH-I013", "accessor 0", "do not fit"),
        ("/accessors/0", "byteOffset", json!(max), "BTH-I013", "accessor 0", "do not fit"),
        ("/accessors/0", "componentType", json!(1), "BTH-I013", "accessor 0", "component type"),
        ("/accessors/0", "type", json!("VEC4"), "BTH-I013", "accessor 0", "expected VEC3"),
        ("/accessors/0", "bufferView", json!(9), "BTH-I014", "buffer view 9", "does not exist"),
        ("/accessors", "0", zeros, "BTH-I013", "accessor 0", "without data"),
        (view, "byteStride", json!(4), "BTH-I013", "accessor 0", "stride of 4"),
        (view, "byteLength", json!(max), "BTH-I014", "buffer view 0", "of buffer 0"),
        (view, "buffer", json!(3), "BTH-I014", "buffer 3", "does not exist"),
        ("/buffers/0", "byteLength", json!(200), "BTH-I003", "buffer 0", "expected 200 bytes"),
        (primitive, "indices", json!(9), "BTH-I013", "accessor 9", "not exist"),
        (primitive, "mode", json!(9), "BTH-I002", "mesh 0 primitive 0", "mode"),
        ("/accessors/0", "count", json!(3), "BTH-I005", "mesh 0 primitive 0 accessor 1 row 5", "below 3"),
        ("/accessors/2", "count", json!(3), "BTH-I005", "mesh 0 primitive 0 accessor 2", "expected 4"),
        ("/asset", "version", json!("1.0"), "BTH-I006", "asset", "found version \"1.0\""),
        ("", "meshes", json!({"m": {}}), "BTH-I006", "asset", "expected glTF 2, found glTF 1"),
    ] {
        let edit = |d: &mut Value| match d.pointer_mut(at).unwrap() {
            Value::Array(rows) => rows[key.parse::<usize>().unwrap()] = value,
            object => object[key] = value,
        };
        assert_bad(edit, code, place, message);
    }
}

#[test]
fn an_accessor_without_a_buffer_view_is_zeros() {
    let without_view = |accessor: usize| {
        let document = edited(|d| {
            d["accessors"][accessor].as_object_mut().unwrap().remove("bufferView");
        });
        import_bytes("a.glb", &glb(&document, &binary()), Keep::All).unwrap().0
    };
    let flat = without_view(0);
    assert_eq!((flat.positions.as_slice(), flat.triangles.len()), (&[[0.0; 3]][..], 2));
    assert!(without_view(1).triangles.iter().all(|t| *t == [0; 3]));
    let normals = without_view(2).attributes.unwrap().normals;
    assert!(normals.iter().all(|n| *n == [0.0; 3]) && normals.len() == 4);
}

#[test]
fn refuses_more_zeros_than_bytes_were_read() {
    for (accessor, count) in [(0, 1u64 << 30), (1, 1 << 30), (1, u64::MAX)] {
        let zeros = |d: &mut Value| {
            d["accessors"][accessor].as_object_mut().unwrap().remove("bufferView");
            d["accessors"][accessor]["count"] = count.into();
        };
        assert_bad(zeros, "BTH-I013", &format!("accessor {accessor}"), "rows without data are too many");
    }
}

#[test]
fn zeros_may_be_as_many_as_the_rows_of_an_external_buffer() {
    let folder = tempfile::tempdir().unwrap();
    let rows = 5000;
    let points: Vec<u8> = (0..3 * rows).flat_map(|i| (i as f32).to_le_bytes()).collect();
    std::fs::write(folder.path().join("points.bin"), &points).unwrap();
    let document = edited(|d| {
        d["buffers"][0] = json!({"uri": "points.bin", "byteLength": points.len()});
        d["bufferViews"] = json!([{"buffer": 0, "byteLength": points.len()}]);
        d["accessors"][0]["count"] = rows.into();
        d["accessors"][2] = json!({"componentType": 5126, "count": rows, "type": "VEC3"});
        d["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("indices");
    });
    let path = folder.path().join("a.gltf");
    std::fs::write(&path, document.to_string()).unwrap();
    assert!(document.to_string().len() < rows);
    assert_eq!(import(&path, Keep::All, &Silent).unwrap().0.attributes.unwrap().normals.len(), 4998);
}

#[test]
fn node_transforms_are_read_in_double_precision() {
    // In f32, 16777217 is 16777216.
    let document = edited(|d| {
        d["nodes"] = json!([{"translation": [16777217, 0, 0], "children": [1]},
            {"translation": [-16777216, 0, 0], "mesh": 0}]);
    });
    assert_eq!(read(&document).0.corners(0)[0], [1.0, 0.0, 0.0]);
}

#[test]
fn malformed_animations_cameras_and_materials_do_not_fail_mesh_import() {
    let document = edited(|d| {
        d["animations"] = json!([{"channels": 7}, "nothing"]);
        d["cameras"] = json!([{"perspective": "wide"}]);
        d["materials"] = json!([{"pbrMetallicRoughness": 3}]);
        d["meshes"][0]["primitives"][0]["material"] = 0.into();
    });
    let bytes = glb(&document, &binary());
    assert_eq!(import_bytes("a.glb", &bytes, Keep::Normals).unwrap().0.triangles.len(), 2);
    // Texture coordinates depend on the material.
    assert_refused("a.glb", &bytes, "BTH-I002", "material 0", "expected a glTF material");
}

#[test]
fn refuses_coordinates_that_are_not_finite_with_node_and_accessor() {
    let mut bytes = binary();
    bytes[12..16].copy_from_slice(&f32::NAN.to_le_bytes());
    let place = "node 0 mesh 0 primitive 0 accessor 0 row 1";
    assert_refused("a.glb", &glb(&document(), &bytes), "BTH-I004", place, "NaN");
    let large = |d: &mut Value| d["nodes"][0]["translation"] = json!([1e300, 0, 0]);
    assert_bad(large, "BTH-I004", "node 0 mesh 0 primitive 0 accessor 0 row 0", "inf");
}

#[test]
fn every_cut_of_a_glb_is_refused() {
    let bytes = glb(&document(), &binary());
    for end in 0..bytes.len() {
        let found = import_bytes("a.glb", &bytes[..end], Keep::None);
        assert!(matches!(found, Err(Error::Input { .. })), "cut at {end}: {found:?}");
    }
}

#[test]
fn refuses_what_is_not_gltf_2() {
    assert_refused("a.glb", b"glTF\x01\0\0\0\x0c\0\0\0", "BTH-I006", "byte 4", "found 1");
    assert_refused("a.gltf", b"{\"asset\":", "BTH-I002", "JSON", "EOF");
    assert_refused("a.gltf", &[b'['; 100_000], "BTH-I002", "JSON", "expected a glTF document");
}
