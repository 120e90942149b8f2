//! Texture coordinates of glTF models: which set is kept, and how KHR_texture_transform changes it.

use super::gltf::Model;
use super::*;
use serde_json::{Value, json};

/// A triangle with two sets of texture coordinates, [`FIRST`] and [`SECOND`], and the material of
/// this number; there is one.
fn textured(material: Value, number: u32) -> Vec<u8> {
    let attributes = json!({"POSITION": 0, "TEXCOORD_0": 1, "TEXCOORD_1": 2});
    let document = json!({
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": attributes, "material": number}]}],
        "materials": [material],
    });
    let positions = [[0f32, 0., 0.], [1., 0., 0.], [0., 1., 0.]];
    Model::new(document).rows(&positions).rows(&FIRST).rows(&SECOND).glb()
}

#[track_caller]
fn uvs(material: Value) -> Vec<[f32; 2]> {
    let mesh = import_bytes("a.glb", &textured(material, 0), Keep::All).unwrap().0;
    mesh.attributes.map_or(Vec::new(), |a| a.uvs)
}

/// A material whose base colour texture has this transform.
fn transformed(transform: Value) -> Value {
    json!({"pbrMetallicRoughness": {"baseColorTexture":
        {"index": 0, "extensions": {"KHR_texture_transform": transform}}}})
}

const FIRST: [[f32; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
const SECOND: [[f32; 2]; 3] = [[0.0, 0.0], [0.5, 0.0], [0.0, 0.5]];

#[test]
fn the_base_colour_texture_chooses_the_set() {
    assert_eq!(uvs(json!({})), FIRST);
    let reference = |set: u32| json!({"index": 0, "texCoord": set});
    let base = json!({"baseColorTexture": reference(1), "metallicRoughnessTexture": reference(0)});
    assert_eq!(uvs(json!({"pbrMetallicRoughness": base, "normalTexture": reference(0)})), SECOND);
    // Without it the next texture of the material chooses.
    assert_eq!(uvs(json!({"normalTexture": reference(1)})), SECOND);
    // A set that the primitive does not have.
    assert_eq!(uvs(json!({"normalTexture": reference(7)})), [[0.0; 2]; 0]);
}

#[test]
fn a_transform_scales_then_rotates_then_offsets() {
    let transform = json!({"offset": [0.25, 0.5], "rotation": std::f64::consts::FRAC_PI_2, "scale": [2, 4]});
    // (1, 0) becomes (2, 0), turns counter-clockwise in the image to (0, -2); (0, 1) becomes (0,
    // 4), then (4, 0).
    assert_eq!(uvs(transformed(transform)), [[0.25, 0.5], [0.25, -1.5], [4.25, 0.5]]);
    assert_eq!(uvs(transformed(json!({"scale": [0.5, 0.25]}))), [[0.0, 0.0], [0.5, 0.0], [0.0, 0.25]]);
    assert_eq!(uvs(transformed(json!({}))), FIRST);
}

#[test]
fn a_transform_overrides_the_set() {
    assert_eq!(uvs(transformed(json!({"texCoord": 1}))), SECOND);
    let mut material = transformed(json!({"texCoord": 0, "offset": [1, 0]}));
    material["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = 1.into();
    assert_eq!(uvs(material), [[1.0, 0.0], [2.0, 0.0], [1.0, 1.0]]);
}

#[test]
fn refuses_a_malformed_transform_and_a_missing_material() {
    let bytes = textured(transformed(json!({"offset": [1]})), 0);
    assert_refused("a.glb", &bytes, "BTH-I002", "material 0", "expected a glTF material");
    assert_refused("a.glb", &textured(json!({}), 9), "BTH-I002", "material 9", "does not exist");
}
