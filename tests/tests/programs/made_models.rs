//! Small made models with materials, and pictures of them.

use crate::support::{bthc, folder, run};
use serde_json::{Value, json};
use std::path::Path;

/// What the player adds to every picture here: 40 by 40 pixels that show x and y from 0 to 2, from
/// the front.
pub(crate) const VIEW: [&str; 8] =
    ["--size", "40x40", "--spp", "4", "--camera", "1,1,5,1,1,0", "--fov", "22.61986494804043"];

pub(crate) fn base64(bytes: &[u8]) -> String {
    let digits = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let group = |g: &[u8]| {
        let bits = g.iter().fold(0u32, |bits, b| bits << 8 | u32::from(*b)) << (8 * (3 - g.len()));
        let mut text: String =
            (0..=g.len()).map(|k| digits[(bits >> (18 - 6 * k)) as usize & 63] as char).collect();
        text.extend(std::iter::repeat_n('=', 3 - g.len()));
        text
    };
    bytes.chunks(3).map(group).collect()
}

pub(crate) fn uri(bytes: &[u8]) -> String {
    format!("data:application/octet-stream;base64,{}", base64(bytes))
}

pub(crate) fn png(width: u32, rgba: &[[u8; 4]]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, rgba.len() as u32 / width);
    encoder.set_color(png::ColorType::Rgba);
    encoder.write_header().unwrap().write_image_data(rgba.as_flattened()).unwrap();
    bytes
}

/// A square from (0, 0, 0) to (2, 2, 0) of two triangles that faces +z. Its material takes its
/// textures from `images`. Its vertices have the linear colours, if there are some.
pub(crate) fn square(material: &Value, images: &[Value], colors: Option<[[f32; 4]; 4]>) -> String {
    let mut floats: Vec<f32> = vec![0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 2.0, 2.0, 0.0, 0.0, 2.0, 0.0];
    floats.extend([0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
    floats.extend(colors.unwrap_or([[1.0; 4]; 4]).as_flattened());
    let mut bytes: Vec<u8> = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend([0u8, 1, 2, 0, 2, 3]);
    let mut attributes = json!({"POSITION": 0, "TEXCOORD_0": 1});
    if colors.is_some() {
        attributes["COLOR_0"] = json!(2);
    }
    let accessor =
        |view: u32, kind: &str| json!({"bufferView": view, "componentType": 5126, "count": 4, "type": kind});
    let view =
        |offset: usize, length: usize| json!({"buffer": 0, "byteOffset": offset, "byteLength": length});
    json!({
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_materials_unlit"],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 3, "material": 0}]}],
        "materials": [material],
        "textures": images.iter().enumerate().map(|(k, _)| json!({"source": k, "sampler": 0})).collect::<Vec<_>>(),
        "samplers": [{"magFilter": 9728}],
        "images": images,
        "accessors": [accessor(0, "VEC3"), accessor(1, "VEC2"), accessor(2, "VEC4"),
            {"bufferView": 3, "componentType": 5121, "count": 6, "type": "SCALAR"}],
        "bufferViews": [view(0, 48), view(48, 32), view(80, 64), view(144, 6)],
        "buffers": [{"byteLength": bytes.len(), "uri": uri(&bytes)}]
    })
    .to_string()
}

/// A material that is shown as it is, without light.
pub(crate) fn unlit(mut material: Value) -> Value {
    material["extensions"] = json!({"KHR_materials_unlit": {}});
    material
}

/// The picture of a model: a colour for each pixel, rows from the top.
pub(crate) fn picture(model: &str, args: &[&str]) -> Vec<[u8; 3]> {
    let folder = folder(&[("a.gltf", model)]);
    bthc(folder.path(), &["compile", "a.gltf", "--materials", "--flatten", "-o", "a.bth"]).expect(0);
    bthc(folder.path(), &["verify", "a.bth"]).expect(0);
    shown(folder.path(), args)
}

pub(crate) fn shown(folder: &Path, args: &[&str]) -> Vec<[u8; 3]> {
    let mut all = vec!["a.bth", "-o", "a.png", "--no-ground"];
    all.extend(VIEW.chunks(2).filter(|pair| !args.contains(&pair[0])).flatten());
    all.extend(args);
    run("bth-play", folder, &all).expect(0);
    decoded(&folder.join("a.png"))
}

/// The pixels of a PNG file, rows from the top.
pub(crate) fn decoded(file: &Path) -> Vec<[u8; 3]> {
    let mut reader =
        png::Decoder::new(std::io::Cursor::new(std::fs::read(file).unwrap())).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut bytes).unwrap();
    bytes.as_chunks::<3>().0.to_vec()
}

/// The pixel at x and y of the square, each from 0 to 2.
pub(crate) fn at(picture: &[[u8; 3]], x: f64, y: f64) -> [u8; 3] {
    picture[((2.0 - y) * 20.0) as usize * 40 + (x * 20.0) as usize]
}

/// What is seen where there is nothing: a square with a hole everywhere.
pub(crate) fn nothing(args: &[&str]) -> Vec<[u8; 3]> {
    let hole = json!({"alphaMode": "MASK", "doubleSided": true, "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0]}});
    picture(&square(&hole, &[], None), args)
}
