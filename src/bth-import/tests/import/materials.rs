//! Materials of glTF documents and colours of PLY files: what is read, what is skipped with a
//! warning, and the sets of texture coordinates.

use super::gltf::Model;
use super::*;
use bth_format::layout::*;
use bth_import::{Looks, Materials, import_images};
use serde_json::{Value, json};
use std::path::Path;

/// The smallest file that begins as a PNG image of one texel.
fn image(seed: u8) -> Vec<u8> {
    let mut bytes = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x01\0\0\0\x01\x08\x06\0\0\0".to_vec();
    bytes.extend([seed; 8]);
    bytes
}

/// A triangle with two sets of texture coordinates and two images.
fn document(material: Value) -> Model {
    let attributes = json!({"POSITION": 0, "TEXCOORD_0": 1, "TEXCOORD_1": 2});
    Model::new(json!({
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": attributes, "material": 0}]}],
        "materials": [material],
        "textures": [{"source": 0}, {"source": 1, "sampler": 0}, {"extensions": {"KHR_texture_basisu": {"source": 1}}}],
        "samplers": [{"magFilter": 9728, "wrapS": 33071, "wrapT": 33648}],
        "images": [{"bufferView": 3, "mimeType": "image/png"}, {"bufferView": 4, "mimeType": "image/png"}],
    }))
    .rows(&[[0f32, 0., 0.], [1., 0., 0.], [0., 1., 0.]])
    .rows(&[[0f32, 0.], [1., 0.], [0., 1.]])
    .rows(&[[0.5f32, 0.5], [0.25, 0.5], [0.5, 0.75]])
    .view(&image(1))
    .view(&image(2))
}

/// Writes a document with one material; its materials and what was warned of.
fn read(folder: &Path, material: Value) -> Result<(Mesh, Vec<String>)> {
    let path = folder.join("a.glb");
    std::fs::write(&path, document(material).glb()).unwrap();
    let (mesh, warnings) = told(&path, everything())?;
    for texture in &mesh.materials.as_ref().unwrap().textures {
        let images = import_images(&path, Looks::default(), &Silent)?;
        assert!(images.iter().any(|image| image.name == texture.image));
    }
    Ok((mesh, warnings))
}

fn materials(material: Value) -> (Materials, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let (mesh, warnings) = read(folder.path(), material).unwrap();
    (mesh.materials.unwrap(), warnings)
}

#[test]
fn factors_and_modes_are_those_of_the_document() {
    let (read, warnings) = materials(json!({"alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": true,
        "emissiveFactor": [1, 0.5, 0], "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 1, 0.75]},
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}, "KHR_materials_unlit": {}}}));
    let expected = MaterialParameters {
        base_color: [0.5, 0.25, 1.0, 0.75],
        emissive: [4.0, 2.0, 0.0],
        alpha_cutoff: 0.25,
        alpha_mode: ALPHA_MASK,
        flags: MATERIAL_DOUBLE_SIDED | MATERIAL_UNLIT,
        base_color_texture: NONE,
        emissive_texture: NONE,
        reserved: [0; 4],
    };
    assert_eq!(read.parameters, [expected]);
    assert!(read.textures.is_empty() && warnings.is_empty(), "{warnings:?}");
    let (plain, _) = materials(json!({}));
    let expected = MaterialParameters {
        base_color: [1.0; 4],
        emissive: [0.0; 3],
        alpha_cutoff: 0.5,
        alpha_mode: ALPHA_OPAQUE,
        flags: 0,
        ..expected
    };
    assert_eq!(plain.parameters, [expected]);
}

#[test]
fn textures_of_one_set_share_it_by_a_transform() {
    let transform = |offset: [f64; 2], scale: [f64; 2]| json!({"KHR_texture_transform": {"offset": offset, "scale": scale}});
    let (read, warnings) = materials(json!({"emissiveFactor": [1, 1, 1],
        "emissiveTexture": {"index": 0, "extensions": transform([0.5, 0.0], [4.0, 1.0])},
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 1, "extensions": transform([0.0, 0.25], [2.0, 2.0])}}}));
    assert!(warnings.is_empty(), "{warnings:?}");
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let base = &read.textures[read.parameters[0].base_color_texture as usize];
    let expected = (identity, [WRAP_CLAMP, WRAP_MIRROR], FILTER_NEAREST);
    assert_eq!((base.transform, base.wrap, base.filter), expected);
    // u of the image is 0.5 + 4 u, and 2 u is kept; v is v, and 0.25 + 2 v is kept.
    let emissive = &read.textures[read.parameters[0].emissive_texture as usize];
    assert_eq!(emissive.transform, [[2.0, 0.0, 0.5], [0.0, 0.5, -0.125]]);
    assert_eq!((emissive.wrap, emissive.filter), ([WRAP_REPEAT; 2], FILTER_LINEAR));
}

#[test]
fn gloss_is_kept_with_its_textures() {
    let (read, warnings) = materials(json!({"normalTexture": {"index": 0, "scale": 0.5},
        "occlusionTexture": {"index": 1, "strength": 0.25},
        "pbrMetallicRoughness": {"roughnessFactor": 0.5, "metallicRoughnessTexture": {"index": 1}}}));
    assert!(warnings.is_empty(), "{warnings:?}");
    let gloss = read.gloss[0];
    assert_eq!((gloss.metallic, gloss.roughness, gloss.normal_scale), (1.0, 0.5, 0.5));
    assert_eq!(gloss.occlusion_strength, 0.25);
    assert_eq!(gloss.metallic_roughness_texture, gloss.occlusion_texture);
    let images =
        [gloss.metallic_roughness_texture, gloss.normal_texture].map(|row| read.textures[row as usize].image);
    assert_ne!(images[0], images[1]);
    // Without light, and in the older model, there is no gloss; without its image nothing is metal.
    let has_no_gloss = |material: Value| materials(material).0.gloss.is_empty();
    assert!(has_no_gloss(json!({"extensions": {"KHR_materials_unlit": {}}, "normalTexture": {"index": 0}})));
    assert!(has_no_gloss(json!({"extensions": {"KHR_materials_pbrSpecularGlossiness": {}}})));
    let lost = json!({"pbrMetallicRoughness":
        {"roughnessFactor": 0.5, "metallicRoughnessTexture": {"index": 2}}});
    assert_eq!(materials(lost).0.gloss[0].metallic, 0.0);
}

#[test]
fn what_is_left_out_is_reported() {
    // The normal texture decides which set is kept for all purposes; the diffuse texture has the
    // second one.
    let (read, warnings) = materials(json!({"emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0},
        "normalTexture": {"index": 1, "texCoord": 2}, "extensions": {"KHR_materials_clearcoat": {},
        "KHR_materials_pbrSpecularGlossiness": {"diffuseTexture": {"index": 1, "texCoord": 1}}}}));
    assert_eq!((read.parameters[0].base_color_texture, read.parameters[0].emissive_texture), (0, NONE));
    assert_eq!(read.parameters[0].emissive, [0.0; 3], "all of the surface would glow");
    let all = warnings.join("\n");
    for part in
        ["material 0: its emissive texture is left out: its texture coordinates", "KHR_materials_clearcoat"]
    {
        assert!(all.contains(part), "{part} in {all}");
    }
    let (read, warnings) = materials(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 2}}}));
    assert_eq!(read.parameters[0].base_color_texture, NONE);
    assert!(warnings[0].contains("no image in PNG, JPEG or WebP"), "{warnings:?}");
    let (read, warnings) = materials(json!({"alphaMode": "mask"}));
    assert_eq!(read.parameters[0].alpha_mode, ALPHA_OPAQUE);
    assert_eq!(warnings, ["materials: not kept are alphaMode \"mask\""]);
}

/// The texture coordinates of the corners of the triangle for a texture, by the rows that the
/// materials keep.
fn coordinates(mesh: &Mesh, texture: u32) -> [[f32; 2]; 3] {
    let looks = mesh.materials.as_ref().unwrap();
    let Texture { uv_set, transform, .. } = looks.textures[texture as usize];
    let kept = match uv_set {
        UV_SET_FIRST => {
            let attributes = mesh.attributes.as_ref().unwrap();
            attributes.corners[0].map(|row| attributes.uvs[row as usize])
        }
        _ => looks.second_corners[0].map(|row| looks.second_uvs[row as usize]),
    };
    kept.map(|[u, v]| transform.map(|[a, b, c]| a * u + b * v + c))
}

#[test]
fn two_textures_have_sets_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let first = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
    let second = [[0.5, 0.5], [0.25, 0.5], [0.5, 0.75]];
    let moved = |uvs: [[f32; 2]; 3]| uvs.map(|[u, v]| [2.0 * u + 0.5, v]);
    // The extension's set takes the place of the texture's own (KHR_texture_transform).
    let transform = |set: Option<u32>| {
        let mut value = json!({"offset": [0.5, 0], "scale": [2, 1]});
        if let Some(set) = set {
            value["texCoord"] = json!(set);
        }
        json!({"KHR_texture_transform": value})
    };
    for (base, emissive, expected) in [
        (json!({"texCoord": 1}), json!({}), [second, first]),
        (json!({}), json!({"texCoord": 1}), [first, second]),
        (json!({"texCoord": 1}), json!({"texCoord": 1}), [second, second]),
        (
            json!({"texCoord": 1, "extensions": transform(None)}),
            json!({"extensions": transform(None)}),
            [moved(second), moved(first)],
        ),
        (
            json!({"texCoord": 1, "extensions": transform(Some(0))}),
            json!({"extensions": transform(Some(1))}),
            [moved(first), moved(second)],
        ),
        // Nothing can be had from coordinates that are all one point.
        (
            json!({"extensions": {"KHR_texture_transform": {"scale": [0, 0]}}}),
            json!({}),
            [[[0.0; 2]; 3], first],
        ),
    ] {
        let with = |mut texture: Value, index: u32| {
            texture["index"] = json!(index);
            texture
        };
        let material = json!({"emissiveFactor": [1, 1, 1], "emissiveTexture": with(emissive, 0),
            "pbrMetallicRoughness": {"baseColorTexture": with(base, 1)}});
        let (mesh, warnings) = read(folder.path(), material.clone()).unwrap();
        assert!(warnings.is_empty(), "{warnings:?}");
        let parameters = mesh.materials.as_ref().unwrap().parameters[0];
        let found =
            [parameters.base_color_texture, parameters.emissive_texture].map(|row| coordinates(&mesh, row));
        assert_eq!(found, expected, "{material}");
    }
    // Without emission there is no second texture, and no second set.
    let (mesh, _) = read(
        folder.path(),
        json!({"emissiveTexture": {"index": 0, "texCoord": 1},
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}}),
    )
    .unwrap();
    assert!(mesh.materials.unwrap().second_corners.is_empty());
    // A set that the mesh does not have.
    let (mesh, warnings) = read(
        folder.path(),
        json!({"emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0, "texCoord": 7},
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}}),
    )
    .unwrap();
    assert!(warnings[0].contains("TEXCOORD_7"), "{warnings:?}");
    assert!(mesh.materials.unwrap().second_uvs.is_empty());
}

#[test]
fn a_second_set_that_is_not_finite_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let mut model = document(json!({"emissiveFactor": [1, 1, 1],
        "emissiveTexture": {"index": 0, "texCoord": 1}, "pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}}));
    model.binary[60 + 8..60 + 12].copy_from_slice(&f32::NAN.to_le_bytes());
    let path = folder.path().join("a.glb");
    std::fs::write(&path, model.glb()).unwrap();
    let error = import(&path, everything(), &Listener::default()).unwrap_err().to_string();
    assert!(error.contains("BTH-I008") && error.contains("TEXCOORD_1 row 1"), "{error}");
}

#[test]
fn malformed_materials_are_errors_with_their_place() {
    let folder = tempfile::tempdir().unwrap();
    for (material, text) in [
        (json!({"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 2]}}), "material 0: BTH-I002"),
        (json!({"emissiveFactor": [-1, 0, 0]}), "material 0: BTH-I002"),
        (json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 9}}}), "texture 9: BTH-I002"),
        (json!({"alphaCutoff": "much"}), "material 0: BTH-I002"),
        (json!({"pbrMetallicRoughness": {"metallicFactor": 1.5}}), "expected a glTF metallicFactor"),
        (json!({"normalTexture": {"index": 0, "scale": "big"}}), "expected a glTF scale of normals"),
    ] {
        let error = read(folder.path(), material).unwrap_err().to_string();
        assert!(error.contains(text) && error.contains("--materials"), "{error}");
    }
}

#[test]
fn older_models_have_diffuse_colors() {
    let (read, _) = materials(json!({"extensions": {"KHR_materials_pbrSpecularGlossiness":
        {"diffuseFactor": [0.5, 0, 0, 1], "diffuseTexture": {"index": 0}}}}));
    assert_eq!(read.parameters[0].base_color, [0.5, 0.0, 0.0, 1.0]);
    assert_eq!(read.textures.len(), 1);
}

/// Colours of vertices in PLY and OBJ are sRGB; 188 of 255 is half the light. A vertex without a
/// colour is white.
#[test]
fn vertices_of_ply_and_obj_have_colors() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\nproperty list uchar int vertex_indices\n\
        end_header\n0 0 0 255 0 188\n1 0 0 0 0 0\n0 1 0 255 0 188\n3 0 1 2\n";
    let obj = "v 0 0 0 1 0 nan\nv 1 0 0 0 0 0\nv 0 1 0\nf 1 2 3\n";
    let folder = tempfile::tempdir().unwrap();
    let read = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        import(&path, everything(), &Silent).unwrap().0.materials.unwrap()
    };
    let of_ply = read("a.ply", ply);
    assert_eq!(of_ply.color_corners, [[0, 1, 0]]);
    assert_eq!(of_ply.colors[1], [0, 0, 0, 65535]);
    let [r, g, b, a] = of_ply.colors[0];
    assert_eq!([r, g, a], [65535, 0, 65535]);
    assert!(b.abs_diff(32957) < 5, "0.5029 of 65,535: {b}");
    let of_obj = read("a.obj", obj);
    let colors = of_obj.color_corners[0].map(|row| of_obj.colors[row as usize]);
    assert_eq!(colors, [[65535, 0, 65535, 65535], [0, 0, 0, 65535], [65535; 4]]);
    assert_eq!(read("b.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), Materials::default());
}

#[test]
fn colors_of_ply_that_are_not_kept_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    let colors = |kind: &str| format!("property {kind} red\nproperty {kind} green\nproperty {kind} blue\n");
    let told = |of_vertices: &str, of_faces: &str, wanted: Wanted| {
        let [vertex, face] = [of_vertices, of_faces].map(|text| " 255 0 0".repeat(text.len().div_ceil(60)));
        let text = format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n{of_vertices}element face 1\n\
             property list uchar int vertex_indices\n{of_faces}end_header\n0 0 0{vertex}\n1 0 0{vertex}\n0 1 0{vertex}\n3 0 1 2{face}\n"
        );
        std::fs::write(&path, text).unwrap();
        let heard = Listener::default();
        let (mesh, _) = import(&path, wanted, &heard).unwrap();
        assert_eq!(
            mesh.materials.is_some_and(|m| !m.colors.is_empty()),
            of_vertices.contains("uchar") && wanted.materials
        );
        heard.0.into_inner().unwrap()
    };
    let of_faces =
        "1 rows of element face: the colours red, green, blue are not kept; only vertices keep colours";
    assert_eq!(told("", &colors("uchar"), everything()), [of_faces]);
    assert_eq!(told(&colors("uchar"), &colors("uchar"), everything()), [of_faces]);
    assert_eq!(told(&colors("uchar"), "", everything()), [""; 0]);
    assert_eq!(
        told(&colors("uchar"), &colors("uchar"), Wanted { materials: false, ..everything() }),
        [""; 0]
    );
    let of_vertices = "3 rows of element vertex: the colours red, green, blue are not kept; a vertex keeps its first red, green and \
        blue of one type: uchar, ushort or float";
    assert_eq!(told(&colors("int"), "", everything()), [of_vertices]);
}

#[cfg(unix)]
#[test]
fn named_pipes_and_folders_in_place_of_files_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let pipe = at("pipe.mtl");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    std::fs::create_dir(at("folder.mtl")).unwrap();
    std::fs::write(at("real.mtl"), "newmtl red\nKd 1 0 0\n").unwrap();
    std::os::unix::fs::symlink(at("real.mtl"), at("link.mtl")).unwrap();
    let read = |library: &str| {
        let path = at("a.obj");
        let text = format!("mtllib {library}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n");
        std::fs::write(&path, text).unwrap();
        // Opening the pipe would wait for ever, so another thread does it.
        let (send, receive) = std::sync::mpsc::channel();
        std::thread::spawn(move || {
            let looks = bth_import::Looks { materials: true, ..Default::default() };
            let files = bth_import::source_files(&path, looks).unwrap();
            let _ = send.send((import(&path, everything(), &Silent), files.len()));
        });
        receive.recv_timeout(std::time::Duration::from_secs(60)).expect("this should not wait for a writer")
    };
    for (library, what) in [("pipe.mtl", "not a regular file"), ("folder.mtl", "a folder, not a file")] {
        let (found, files) = read(library);
        let error = found.unwrap_err();
        assert!(matches!(error, Error::Input { code: "BTH-I016", .. }), "{error}");
        assert!(error.to_string().contains(what), "{error}");
        assert_eq!(files, 1);
    }
    let (found, files) = read("link.mtl");
    assert_eq!(found.unwrap().0.materials.unwrap().parameters[0].base_color[0], 1.0);
    assert_eq!(files, 2);

    let buffer = json!({"asset": {"version": "2.0"}, "buffers": [{"uri": "pipe.mtl", "byteLength": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}], "nodes": [{"mesh": 0}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}]});
    let path = at("a.gltf");
    std::fs::write(&path, buffer.to_string()).unwrap();
    let (send, receive) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        let _ = send.send(import(&path, Keep::None, &Silent));
    });
    let found = receive.recv_timeout(std::time::Duration::from_secs(60)).expect("this should not wait");
    assert!(found.unwrap_err().to_string().contains("BTH-O001: cannot read: not a regular file"));
}
