//! A tree of leaves: rectangles whose texture has the outline of a leaf, and a floor without holes,
//! as GLB.

use bth_random::Rng;
use serde_json::json;
use std::sync::LazyLock;

/// Columns and rows of the texture.
pub const TEXELS: u32 = 96;

/// Alpha cutoff of the leaves.
pub const CUTOFF: f64 = 0.4;

/// Alpha of the texture: a leaf that points along v, with notches and a soft edge.
pub fn alpha() -> &'static [u8] {
    static TEXTURE: LazyLock<Vec<u8>> = LazyLock::new(|| (0..TEXELS * TEXELS).map(texel).collect());
    &TEXTURE
}

/// A texel of the texture, row by row.
fn texel(k: u32) -> u8 {
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(TEXELS);
    let (x, y) = (at(k % TEXELS) - 0.5, at(k / TEXELS));
    let outline = 0.46 * (std::f64::consts::PI * y.powf(0.75)).sin() * (0.85 + 0.15 * (50.0 * y).sin());
    let stem = if y > 0.8 { 0.025 } else { 0.0 };
    ((outline.max(stem) - x.abs()) * 20.0 * 255.0 + 128.0).clamp(0.0, 255.0) as u8
}

/// A tree with this number of leaves.
pub fn tree(leaves: usize, seed: u64) -> Vec<u8> {
    let mut random = Rng::new(seed);
    let (mut positions, mut uvs) = (Vec::new(), Vec::new());
    for _ in 0..leaves {
        let p = random.point_in_ball();
        let center = [1.1 * p[0], 1.6 + 0.9 * p[1], 1.1 * p[2]];
        let along = random.unit_vector();
        let other = random.unit_vector();
        let across = [1, 2, 0].map(|k| {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            along[i] * other[j] - along[j] * other[i]
        });
        for [u, v] in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
            let size = 0.32;
            positions.push([0, 1, 2].map(|k| {
                (center[k] + size * (u - 0.5) * across[[2, 0, 1][k]] + size * (v - 0.5) * along[k]) as f32
            }));
            uvs.push([u as f32, v as f32]);
        }
    }
    let floor = [[-4.0, 0.0, -4.0], [-4.0, 0.0, 4.0], [4.0, 0.0, 4.0], [4.0, 0.0, -4.0f32]];
    positions.extend(floor);
    uvs.extend([[0.0f32; 2]; 4]);
    let quads = |first: usize, count: usize| {
        (first..first + count).flat_map(|q| [0, 1, 2, 0, 2, 3].map(|k| 4 * q as u32 + k)).collect::<Vec<_>>()
    };
    glb(&positions, &uvs, [&quads(0, leaves), &quads(leaves, 1)])
}

/// The bytes of a GLB with two primitives: of a material with holes, and of none.
fn glb(positions: &[[f32; 3]], uvs: &[[f32; 2]], indices: [&[u32]; 2]) -> Vec<u8> {
    let mut binary = Vec::new();
    let mut views = Vec::new();
    let mut view = |bytes: Vec<u8>| {
        views.push(json!({"buffer": 0, "byteOffset": binary.len(), "byteLength": bytes.len()}));
        binary.extend(bytes);
        binary.resize(binary.len().next_multiple_of(4), 0);
    };
    view(positions.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect());
    view(uvs.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect());
    indices.iter().for_each(|i| view(i.iter().flat_map(|x| x.to_le_bytes()).collect()));
    view(image());
    let indices_of = |view: usize| json!({"bufferView": view, "componentType": 5125, "count": indices[view - 2].len(), "type": "SCALAR"});
    let rows = |view: usize, shape: &str| json!({"bufferView": view, "componentType": 5126, "count": positions.len(), "type": shape});
    let attributes = json!({"POSITION": 0, "TEXCOORD_0": 1});
    let document = json!({
        "asset": {"version": "2.0"},
        "nodes": [{"mesh": 0, "name": "tree"}, {"mesh": 0, "name": "mirrored", "translation": [3, 0, -1], "scale": [-1, 1, 1]}],
        "scenes": [{"nodes": [0, 1]}],
        "meshes": [{"primitives": [
            {"attributes": attributes, "indices": 2, "material": 0},
            {"attributes": attributes, "indices": 3, "material": 1}]}],
        "materials": [
            {"alphaMode": "MASK", "alphaCutoff": CUTOFF, "doubleSided": true,
                "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}},
            {"name": "floor"}],
        "textures": [{"source": 0, "sampler": 0}],
        "samplers": [{"wrapS": 33071, "wrapT": 33071}],
        "images": [{"bufferView": 4, "mimeType": "image/png"}],
        "accessors": [rows(0, "VEC3"), rows(1, "VEC2"), indices_of(2), indices_of(3)],
        "bufferViews": views,
        "buffers": [{"byteLength": binary.len()}]
    });
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((28 + text.len() as u32 + binary.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", text), (b"BIN\0", binary)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    bytes
}

/// The texture as PNG.
fn image() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, TEXELS, TEXELS);
    encoder.set_color(png::ColorType::GrayscaleAlpha);
    let data: Vec<u8> = alpha().iter().flat_map(|a| [90, *a]).collect();
    let mut writer = encoder.write_header().expect("a header in memory");
    writer.write_image_data(&data).expect("an image in memory");
    drop(writer);
    bytes
}
