//! Cut-out materials of glTF models: which triangles have them, from which images, and what is
//! refused.

use super::gltf::Model;
use super::*;
use bth_import::{AlphaMode, Cutouts, Wrap, import_cutouts, source_files};
use serde_json::{Value, json};
use std::path::Path;

/// An image of 2 by 1 texels; the left one is transparent.
fn image() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
    encoder.set_color(png::ColorType::Rgba);
    encoder.write_header().unwrap().write_image_data(&[1, 2, 3, 0, 1, 2, 3, 255]).unwrap();
    bytes
}

fn base64(bytes: &[u8]) -> String {
    let digits = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let group = |g: &[u8]| {
        let bits = g.iter().fold(0u32, |bits, b| bits << 8 | u32::from(*b)) << (8 * (3 - g.len()));
        (0..=g.len()).map(move |k| digits[(bits >> (18 - 6 * k)) as usize & 63] as char)
    };
    bytes.chunks(3).flat_map(group).collect()
}

/// A triangle of an opaque material, then one of the given material, the second in a mirrored node
/// too.
fn document(material: Value) -> Model {
    let primitive = |material: u32, color: bool| {
        let mut attributes = json!({"POSITION": 0, "TEXCOORD_0": 1});
        if color {
            attributes["COLOR_0"] = json!(2);
        }
        json!({"attributes": attributes, "material": material})
    };
    let mut model = Model::new(json!({
        "nodes": [{"mesh": 0}, {"mesh": 1, "scale": [-1, 1, 1]}],
        "meshes": [{"primitives": [primitive(0, false), primitive(1, false)]}, {"primitives": [primitive(1, true)]}],
        "materials": [{}, material],
        "textures": [{"source": 0, "sampler": 0}],
        "samplers": [{"magFilter": 9728, "wrapS": 33071, "wrapT": 33648}],
        "images": [{"bufferView": 3, "mimeType": "image/png"}],
    }))
    .rows(&[[0f32, 0., 0.], [1., 0., 0.], [0., 1., 0.]])
    .rows(&[[0f32, 0.], [1., 0.], [0., 1.]])
    .rows(&[[255u8, 255, 255, 0], [255, 255, 255, 51], [255; 4]])
    .view(&image());
    model.document["accessors"][2]["normalized"] = true.into();
    model
}

fn masked() -> Value {
    json!({"alphaMode": "MASK", "alphaCutoff": 0.25, "pbrMetallicRoughness":
        {"baseColorFactor": [1, 1, 1, 0.5], "baseColorTexture": {"index": 0}}})
}

/// Writes the document and reads its cut-outs.
fn read(folder: &Path, model: &Model, mode: AlphaMode) -> Result<Cutouts> {
    let path = folder.join("a.glb");
    std::fs::write(&path, model.glb()).unwrap();
    let mesh = import(&path, Keep::None, &Silent)?.0;
    let cutouts = import_cutouts(&path, mode, &Silent)?;
    if mode != AlphaMode::None {
        assert_eq!(cutouts.mesh_triangles, mesh.triangles.len());
    }
    Ok(cutouts)
}

fn cutouts(model: &Model, mode: AlphaMode) -> Result<Cutouts> {
    read(tempfile::tempdir().unwrap().path(), model, mode)
}

#[test]
fn materials_of_the_mode_are_read_with_their_corners() {
    let found = cutouts(&document(masked()), AlphaMode::Mask).unwrap();
    let material = &found.materials[0];
    assert_eq!((material.factor, material.cutoff, material.nearest), (0.5, 0.25, true));
    assert_eq!(material.wrap, [Wrap::Clamp, Wrap::Mirror]);
    assert_eq!(found.images[material.image.unwrap()].alpha, [0, 255]);
    assert_eq!(found.triangles.iter().map(|t| t.triangle).collect::<Vec<_>>(), [1, 2]);
    assert_eq!(found.triangles[0].corners.map(|c| c.uv), [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    assert_eq!(found.triangles[0].corners.map(|c| c.alpha), [1.0; 3]);
    // The import exchanges the last two corners of mirrored meshes. Alpha of vertex colours counts.
    assert_eq!(found.triangles[1].corners.map(|c| c.uv), [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]]);
    assert_eq!(found.triangles[1].corners.map(|c| c.alpha), [0.0, 1.0, 0.2]);
    assert_eq!(cutouts(&document(masked()), AlphaMode::None).unwrap(), Cutouts::default());
}

/// An older model of materials takes alpha from its diffuse colour, at the coordinates of its
/// texture, whichever set is kept.
#[test]
fn older_models_have_holes_by_the_alpha_of_their_diffuse_colors() {
    let expected = cutouts(&document(masked()), AlphaMode::Mask).unwrap();
    let older = json!({"diffuseFactor": [1, 1, 1, 0.5], "diffuseTexture": {"index": 0}});
    let older = json!({"alphaMode": "MASK", "alphaCutoff": 0.25, "normalTexture": {"index": 0, "texCoord": 1},
        "extensions": {"KHR_materials_pbrSpecularGlossiness": older}});
    assert_eq!(cutouts(&document(older.clone()), AlphaMode::Mask).unwrap(), expected);
    let mut model = document(older);
    model.document["images"][0] = json!({"uri": "a leaf.png"});
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a leaf.png"), image()).unwrap();
    assert_eq!(read(folder.path(), &model, AlphaMode::Mask).unwrap(), expected);
    let path = folder.path().join("a.glb");
    assert!(source_files(&path, AlphaMode::Mask).unwrap().contains(&folder.path().join("a leaf.png")));
}

#[test]
fn blended_materials_count_where_they_are_asked_for() {
    let blend = json!({"alphaMode": "BLEND", "alphaCutoff": 0.1, "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}});
    assert!(cutouts(&document(blend.clone()), AlphaMode::Mask).unwrap().triangles.is_empty());
    let found = cutouts(&document(blend), AlphaMode::Blend).unwrap();
    assert_eq!((found.triangles.len(), found.materials[0].cutoff), (2, 0.5));
    let opaque = json!({"alphaMode": "OPAQUE", "pbrMetallicRoughness": {"baseColorTexture": {"index": 9}}});
    assert!(cutouts(&document(opaque), AlphaMode::Blend).unwrap().triangles.is_empty());
}

#[test]
fn texture_coordinates_are_transformed_and_may_be_missing() {
    let mut material = masked();
    material["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] =
        json!({"KHR_texture_transform": {"offset": [2, 3], "scale": [10, 100]}});
    let found = cutouts(&document(material.clone()), AlphaMode::Mask).unwrap();
    assert_eq!(found.triangles[0].corners.map(|c| c.uv), [[2.0, 3.0], [12.0, 3.0], [2.0, 103.0]]);
    // A set that the primitives do not have: they are opaque.
    material["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = json!(3);
    assert!(cutouts(&document(material), AlphaMode::Mask).unwrap().triangles.is_empty());
    // Without a texture the factor alone decides.
    let plain = json!({"alphaMode": "MASK", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.25]}});
    let found = cutouts(&document(plain), AlphaMode::Mask).unwrap();
    assert_eq!((found.materials[0].image, found.materials[0].factor, found.triangles.len()), (None, 0.25, 2));
}

#[test]
fn images_come_from_files_and_data_uris_too() {
    let folder = tempfile::tempdir().unwrap();
    let mut model = document(masked());
    model.document["images"][0] = json!({"uri": format!("data:image/png;base64,{}", base64(&image()))});
    let expected = cutouts(&document(masked()), AlphaMode::Mask).unwrap();
    assert_eq!(read(folder.path(), &model, AlphaMode::Mask).unwrap(), expected);
    model.document["images"][0] = json!({"uri": "a%20leaf.png"});
    let missing = read(folder.path(), &model, AlphaMode::Mask).unwrap_err();
    assert!(matches!(missing, Error::Input { code: "BTH-I016", .. }), "{missing}");
    std::fs::write(folder.path().join("a leaf.png"), image()).unwrap();
    assert_eq!(read(folder.path(), &model, AlphaMode::Mask).unwrap(), expected);
    let path = folder.path().join("a.glb");
    assert_eq!(source_files(&path, AlphaMode::None).unwrap(), [path.as_path()]);
    assert_eq!(source_files(&path, AlphaMode::Mask).unwrap(), [path, folder.path().join("a leaf.png")]);
}

/// An image of 2^28 bytes and one more, without its end, would look like one that is damaged.
#[test]
fn an_image_file_that_is_too_large_is_refused_and_not_cut_off() {
    let folder = tempfile::tempdir().unwrap();
    let mut model = document(masked());
    model.document["images"][0] = json!({"uri": "large.png"});
    let path = folder.path().join("large.png");
    std::fs::write(&path, image()).unwrap();
    std::fs::File::options().write(true).open(&path).unwrap().set_len((1 << 28) + 1).unwrap();
    let error = read(folder.path(), &model, AlphaMode::Mask).unwrap_err();
    assert!(matches!(error, Error::Limit { code: "BTH-L003", .. }), "{error}");
    assert!(error.to_string().contains("large.png has 268435457 bytes"), "{error}");
}

#[test]
fn an_uri_that_is_no_file_is_not_shown_whole() {
    let mut model = document(masked());
    model.document["images"][0] = json!({"uri": format!("blob:\u{1b}{}", "A".repeat(1 << 20))});
    let text = cutouts(&model, AlphaMode::Mask).unwrap_err().to_string();
    assert!(
        text.len() < 400 && !text.contains('\u{1b}') && text.contains("beside the model"),
        "{} bytes",
        text.len()
    );
}

#[test]
fn what_cannot_be_read_is_an_error_with_a_code_only_where_it_is_asked_for() {
    type Change = (&'static str, fn(&mut Value));
    let changes: [Change; 11] = [
        ("BTH-I016", |d| d["images"][0] = json!({"bufferView": 0})),
        ("BTH-I016", |d| d["images"][0] = json!({})),
        ("BTH-I016", |d| d["images"][0] = json!({"uri": "data:image/png;base64,!"})),
        ("BTH-I016", |d| d["images"][0] = json!({"uri": "https://example.org/a.png"})),
        ("BTH-I016", |d| d["textures"][0] = json!({"extensions": {"KHR_texture_basisu": {"source": 0}}})),
        ("BTH-I014", |d| d["images"][0]["bufferView"] = json!(77)),
        ("BTH-I002", |d| d["textures"] = json!([])),
        ("BTH-I002", |d| d["samplers"][0]["wrapS"] = json!(1)),
        ("BTH-I002", |d| d["textures"][0]["sampler"] = json!(5)),
        ("BTH-I002", |d| d["materials"][1]["alphaCutoff"] = json!(-1)),
        ("BTH-I002", |d| d["materials"][1]["pbrMetallicRoughness"]["baseColorFactor"] = json!([1, 1, 1, 7])),
    ];
    for (code, change) in changes {
        let mut model = document(masked());
        change(&mut model.document);
        let error = cutouts(&model, AlphaMode::Mask).expect_err(code);
        assert!(matches!(&error, Error::Input { code: found, .. } if *found == code), "{code}: {error}");
        cutouts(&model, AlphaMode::None).unwrap();
    }
}

#[test]
fn jpeg_images_have_no_alpha() {
    let mut model = document(masked());
    model.document["images"][0] =
        json!({"uri": format!("data:image/jpeg;base64,{}", base64(b"\xff\xd8\xff\xe0"))});
    let found = cutouts(&model, AlphaMode::Mask).unwrap();
    assert_eq!((found.materials[0].image, found.images.len()), (None, 0));
}

#[test]
fn hidden_nodes_have_no_cutouts_and_unknown_alpha_modes_are_told() {
    let mut model = document(masked());
    let visible = cutouts(&model, AlphaMode::Mask).unwrap();
    model.document["nodes"][0]["extensions"] = json!({"KHR_node_visibility": {"visible": false}});
    let hidden = cutouts(&model, AlphaMode::Mask).unwrap();
    // The mesh of the second node has one triangle.
    assert_eq!((visible.triangles.len(), hidden.triangles.len()), (2, 1));
    assert_eq!((hidden.mesh_triangles, hidden.triangles[0].triangle), (1, 0));

    let mut material = masked();
    material["alphaMode"] = "mask".into();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    std::fs::write(&path, document(material).glb()).unwrap();
    let listener = Listener::default();
    assert!(import_cutouts(&path, AlphaMode::Mask, &listener).unwrap().triangles.is_empty());
    assert!(listener.heard("expected an alphaMode of OPAQUE, MASK, BLEND, found \"mask\"; it has no holes"));
}
