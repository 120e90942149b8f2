//! KHR_mesh_quantization: integers instead of floats, normalized or not.

use super::gltf::glb;
use super::*;
use serde_json::json;

/// Corner 1 of a triangle whose positions, normals and texture coordinates have this type, each row
/// padded to four bytes.
fn corner(component_type: u32, normalized: bool, row: &[u8]) -> ([f32; 3], [f32; 3], [f32; 2]) {
    let size = row.len().next_multiple_of(4);
    let mut bytes = vec![0; 3 * size];
    bytes[size..size + row.len()].copy_from_slice(row);
    // Another corner that differs, so that the triangle has three.
    bytes[2 * size] = 1;
    let accessor = |shape: &str| json!({"bufferView": 0, "componentType": component_type, "normalized": normalized, "count": 3, "type": shape});
    let document = json!({
        "asset": {"version": "2.0"},
        "extensionsRequired": ["KHR_mesh_quantization"],
        "nodes": [{"mesh": 0, "scale": [2, 2, 2]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 0, "TEXCOORD_0": 1}}]}],
        "accessors": [accessor("VEC3"), accessor("VEC2")],
        "bufferViews": [{"buffer": 0, "byteLength": bytes.len(), "byteStride": size}],
        "buffers": [{"byteLength": bytes.len()}]
    });
    let mesh = import_bytes("a.glb", &glb(&document, &bytes), Keep::All).unwrap().0;
    let attributes = mesh.attributes.as_ref().unwrap();
    let row = attributes.corners[0][1] as usize;
    (mesh.corners(0)[1], attributes.normals[row], attributes.uvs[row])
}

#[test]
fn integers_stand_for_themselves_or_for_fractions() {
    let i16_row: Vec<u8> = [0i16, -32768, 16384].iter().flat_map(|x| x.to_le_bytes()).collect();
    let u16_row: Vec<u8> = [0u16, 65535, 13107].iter().flat_map(|x| x.to_le_bytes()).collect();
    for (component_type, normalized, row, expected) in [
        (5120, false, &[0, 0x80, 64][..], [0.0, -128.0, 64.0f32]),
        (5120, true, &[0, 0x80, 127], [0.0, -1.0, 1.0]),
        (5121, false, &[0, 200, 51], [0.0, 200.0, 51.0]),
        (5121, true, &[0, 255, 51], [0.0, 1.0, 0.2]),
        (5122, false, &i16_row, [0.0, -32768.0, 16384.0]),
        (5122, true, &i16_row, [0.0, -1.0, (16384.0f64 / 32767.0) as f32]),
        (5123, false, &u16_row, [0.0, 65535.0, 13107.0]),
        (5123, true, &u16_row, [0.0, 1.0, 0.2]),
    ] {
        let (position, normal, uv) = corner(component_type, normalized, row);
        assert_eq!(position, expected.map(|x| (2.0 * f64::from(x)) as f32), "{component_type} {normalized}");
        assert_eq!(uv, [expected[0], expected[1]]);
        // The scaled node brings normals to unit length.
        let length = expected.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>().sqrt();
        for (found, value) in normal.into_iter().zip(expected) {
            let unit = f64::from(value) / length;
            assert!((f64::from(found) - unit).abs() <= f64::from(f32::EPSILON) * unit.abs());
        }
    }
}
