//! Images and material libraries that are missing, broken or too large, where they are skipped.

use super::gltf::Model;
use super::*;
use bth_format::layout::NONE;
use bth_import::{AlphaMode, Looks, Unreadable, import_cutouts, import_images};
use serde_json::json;
use std::path::Path;

fn lenient_wanted() -> Wanted {
    Wanted { unreadable: Unreadable::LeftOut, ..everything() }
}

const LOOKS: Looks = Looks {
    alpha: AlphaMode::Mask,
    materials: true,
    unreadable: Unreadable::LeftOut,
    polygons: bth_import::Polygons::Fans,
};

/// A PNG image of one texel, as far as its header tells.
fn image(width: u32) -> Vec<u8> {
    let width = width.to_be_bytes();
    [b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".as_slice(), &width, &width, b"\x08\x06\0\0\0\0\0\0\0"].concat()
}

/// Checks that a model is refused unless images are skipped. Returns its mesh, and the warnings
/// without the folder's name.
fn lenient(folder: &Path, name: &str) -> (Mesh, Vec<String>) {
    let path = folder.join(name);
    let refused = import(&path, everything(), &Silent).unwrap_err();
    assert!(matches!(refused, Error::Input { code: "BTH-I016", .. }), "{refused}");
    assert!(refused.hint().contains("--lenient-materials"), "{refused}");
    let heard = Listener::default();
    let (mesh, _) = import(&path, lenient_wanted(), &heard).unwrap();
    let warnings = heard.0.into_inner().unwrap();
    let prefix = format!("{}/", folder.display());
    (mesh, warnings.iter().map(|warning| warning.replace(&prefix, "")).collect())
}

#[test]
fn obj_materials_keep_what_can_be_read() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let names = ["lost", "lost too", "elsewhere", "huge", "text", "good"];
    let mut text =
        "mtllib \"a b.mtl\"\nmtllib lost.mtl\nmtllib C:\\x.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n".to_owned();
    text.extend(names.map(|name| format!("usemtl {name}\nf 1 2 3\n")));
    std::fs::write(at("a.obj"), text).unwrap();
    let maps = ["lost.png", "lost.png", "C:\\x.png", "huge.png", "text.png", "\"good one.png\""];
    let library: String = (0..names.len())
        .map(|i| {
            format!("newmtl {}\nKd 0.{} 0 0\nmap_Kd {map}\nmap_Ke {map}\n", names[i], i + 1, map = maps[i])
        })
        .collect();
    std::fs::write(at("a b.mtl"), library).unwrap();
    std::fs::write(at("huge.png"), image(1 << 20)).unwrap();
    std::fs::write(at("text.png"), "no image").unwrap();
    std::fs::write(at("good one.png"), image(1)).unwrap();
    let (mesh, warnings) = lenient(folder.path(), "a.obj");
    let materials = mesh.materials.unwrap();
    let red: Vec<_> = materials.parameters.iter().map(|material| material.base_color[0]).collect();
    assert_eq!(red, [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]);
    let textures: Vec<_> = materials.parameters.iter().map(|material| material.base_color_texture).collect();
    assert_eq!(textures, [NONE, NONE, NONE, NONE, NONE, 0]);
    let emitted: Vec<_> = materials.parameters.iter().map(|material| material.emissive[0]).collect();
    assert_eq!(emitted, [0.0, 0.0, 0.0, 0.0, 0.0, 1.0], "all of the surface would glow");
    let expected = [
        ("a.obj:2: expected the material library lost.mtl: ", true),
        ("a.obj:3: expected a relative name of a material library, found \"C:\\\\x.mtl\"", false),
        ("a b.mtl:3: expected the image lost.png: ", true),
        ("a b.mtl:11: expected a relative file name, found \"C:\\\\x.png\"", false),
        ("a b.mtl:12: expected a relative file name, found \"C:\\\\x.png\"", false),
        ("huge.png has 1099511627776 texels; up to 67108864 are kept", false),
        ("a b.mtl:19: text.png: expected a PNG, JPEG or WebP image, found something else", false),
    ];
    assert_eq!(warnings.len(), expected.len(), "{warnings:#?}");
    for (warning, (start, more)) in warnings.iter().zip(expected) {
        let rest = warning.strip_prefix(start).and_then(|rest| rest.strip_suffix("; it is left out"));
        assert!(rest.is_some_and(|rest| rest.is_empty() != more), "{warning}");
    }
    let images = import_images(&at("a.obj"), LOOKS, &Silent).unwrap();
    assert!(images.iter().any(|image| image.name == materials.textures[0].image));
    // What is malformed is an error still.
    std::fs::write(at("a b.mtl"), "newmtl lost\nKd 1 x 0\n").unwrap();
    let refused = import(&at("a.obj"), lenient_wanted(), &Silent).unwrap_err();
    assert!(matches!(refused, Error::Input { code: "BTH-I002", .. }), "{refused}");
}

#[test]
fn gltf_materials_and_holes_do_without_images_that_cannot_be_read() {
    let folder = tempfile::tempdir().unwrap();
    let material = json!({"alphaMode": "MASK", "emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 1},
        "pbrMetallicRoughness": {"baseColorFactor": [0.25, 0, 0, 0.75], "baseColorTexture": {"index": 0}}});
    let model = Model::new(json!({"nodes": [{"mesh": 0}], "materials": [material],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}],
        "textures": [{"source": 0}, {"source": 1}], "images": [{"uri": "lost.png"}, {"bufferView": 2}]}))
    .rows(&[[0f32, 0., 0.], [1., 0., 0.], [0., 1., 0.]])
    .rows(&[[0f32, 0.], [1., 0.], [0., 1.]])
    .view(&image(1));
    std::fs::write(folder.path().join("a.glb"), model.glb()).unwrap();
    let (mesh, warnings) = lenient(folder.path(), "a.glb");
    let materials = mesh.materials.unwrap();
    let parameters = &materials.parameters[0];
    assert_eq!((parameters.base_color_texture, parameters.emissive_texture), (NONE, 0));
    assert_eq!((parameters.base_color, materials.textures.len()), ([0.25, 0.0, 0.0, 0.75], 1));
    assert_eq!(parameters.emissive, [1.0; 3]);
    let told = "a.glb: image 0: expected the image lost.png: ";
    assert!(warnings.len() == 1 && warnings[0].starts_with(told), "{warnings:?}");

    let path = folder.path().join("a.glb");
    let refused = import_cutouts(&path, AlphaMode::Mask, &Silent).unwrap_err();
    assert!(matches!(refused, Error::Input { code: "BTH-I016", .. }), "{refused}");
    let heard = Listener::default();
    let cutouts = import_cutouts(&path, LOOKS, &heard).unwrap();
    assert_eq!((cutouts.materials.len(), cutouts.images.len()), (1, 0));
    // A texture without its image counts as white, so that the factor alone decides.
    assert_eq!((cutouts.materials[0].image, cutouts.materials[0].factor), (None, 0.75));
    assert_eq!(heard.0.into_inner().unwrap().len(), 1);
}
