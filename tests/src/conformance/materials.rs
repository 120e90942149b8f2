//! Files with materials, textures, images and vertex colors, and their faults.

use super::valid::{CORNERS, indexed, lines, one_triangle};
use super::{Case, Editor, Seal, valid};
use bth_compile::write::{FileBuilder, GroupParts, ObjectParts, Source, images, object};
use bth_format::file::hash128;
use bth_format::layout::*;
use bth_import::Materials;
use std::mem::offset_of;
use zerocopy::IntoBytes;

/// A PNG file of one texel.
const RED: &[u8] = b"\x89\x50\x4e\x47\x0d\x0a\x1a\x0a\x00\x00\x00\x0d\x49\x48\x44\x52\x00\x00\x00\x01\x00\x00\x00\x01\x08\x06\x00\x00\
    \x00\x1f\x15\xc4\x89\x00\x00\x00\x10\x49\x44\x41\x54\x78\x01\x01\x05\x00\xfa\xff\x00\xbc\x00\x00\xff\x03\xf4\x01\
    \xbc\x25\x3d\xd9\x25\x00\x00\x00\x00\x49\x45\x4e\x44\xae\x42\x60\x82";
/// A PNG file of two texels; the second is transparent in part.
const GREEN_AND_BLUE: &[u8] = b"\x89\x50\x4e\x47\x0d\x0a\x1a\x0a\x00\x00\x00\x0d\x49\x48\x44\x52\x00\x00\x00\x02\x00\x00\x00\x01\x08\x06\x00\x00\
    \x00\xf4\x22\x7f\x8a\x00\x00\x00\x14\x49\x44\x41\x54\x78\x01\x01\x09\x00\xf6\xff\x00\x00\xff\x00\xff\x00\x00\xff\
    \x40\x0e\x3b\x03\x3e\x30\x61\xbb\x1a\x00\x00\x00\x00\x49\x45\x4e\x44\xae\x42\x60\x82";

/// The names of the images, ascending.
fn image_names() -> [[u8; 16]; 2] {
    let mut names = [RED, GREEN_AND_BLUE].map(hash128);
    names.sort_unstable();
    names
}

fn texture(image: &[u8], wrap: [u32; 2], filter: u32) -> Texture {
    let transform = [[1.0, 0.0, 0.25], [0.0, -1.0, 1.0]];
    Texture { image: hash128(image), wrap, filter, transform, uv_set: UV_SET_FIRST, reserved: [0; 2] }
}

/// Two materials with three textures of two images, and vertex colors; an object with a texture of
/// one of these images; and one without materials.
pub(super) fn materials() -> Vec<u8> {
    let lines = lines(indexed(&[CORNERS], 0).as_bytes());
    let groups = GroupParts::of(&bth_import::Groups {
        groups: vec![bth_import::Group { name: "leaf".into(), material: Some(1) }],
        materials: vec!["lamp".into(), "leaf".into()],
        runs: vec![[0, 0]],
    });
    let plain = MaterialParameters {
        base_color: [0.5, 0.25, 1.0, 1.0],
        emissive: [0.0; 3],
        alpha_cutoff: 0.5,
        alpha_mode: ALPHA_OPAQUE,
        flags: MATERIAL_DOUBLE_SIDED,
        base_color_texture: NONE,
        emissive_texture: NONE,
        reserved: [0; 4],
    };
    let lamp = MaterialParameters { emissive: [4.0, 3.0, 0.0], emissive_texture: 2, ..plain };
    let leaf = MaterialParameters { alpha_mode: ALPHA_MASK, flags: 0, base_color_texture: 0, ..plain };
    let of_leaf = Materials {
        parameters: vec![lamp, leaf],
        textures: vec![
            texture(GREEN_AND_BLUE, [WRAP_REPEAT, WRAP_MIRROR], FILTER_NEAREST),
            texture(GREEN_AND_BLUE, [WRAP_CLAMP; 2], FILTER_LINEAR),
            texture(RED, [WRAP_REPEAT; 2], FILTER_LINEAR),
        ],
        color_corners: vec![[0, 1, 0]],
        colors: vec![[65535; 4], [65535, 0, 32768, 65535]],
        ..Materials::default()
    };
    let blended =
        MaterialParameters { alpha_mode: ALPHA_BLEND, flags: MATERIAL_UNLIT, base_color_texture: 0, ..plain };
    let of_other = Materials {
        parameters: vec![blended, plain],
        textures: vec![texture(RED, [WRAP_CLAMP; 2], FILTER_NEAREST)],
        ..Materials::default()
    };
    let parts = ObjectParts { groups: Some(&groups), materials: Some(&of_leaf), ..one_triangle(&lines) };
    let mut builder = FileBuilder::new();
    object(&mut builder, 0, &parts).unwrap();
    object(&mut builder, 1, &ObjectParts { materials: Some(&of_other), ..parts }).unwrap();
    object(&mut builder, 2, &ObjectParts { materials: None, groups: None, ..parts }).unwrap();
    images(&mut builder, [RED, GREEN_AND_BLUE].map(|image| (hash128(image), image))).unwrap();
    builder.finish()
}

/// A material whose base color texture and emissive texture have sets of texture coordinates of
/// their own; and one without such coordinates, though its texture has them.
pub(super) fn second_uvs() -> Vec<u8> {
    let lines = lines(indexed(&[CORNERS], 0).as_bytes());
    let groups = GroupParts::of(&bth_import::Groups {
        groups: vec![bth_import::Group { name: "lamp".into(), material: Some(0) }],
        materials: vec!["lamp".into()],
        runs: vec![[0, 0]],
    });
    let lamp = MaterialParameters {
        base_color: [1.0; 4],
        emissive: [2.0; 3],
        alpha_cutoff: 0.5,
        alpha_mode: ALPHA_OPAQUE,
        flags: 0,
        base_color_texture: 0,
        emissive_texture: 1,
        reserved: [0; 4],
    };
    let first = texture(RED, [WRAP_REPEAT; 2], FILTER_LINEAR);
    let second = Texture { uv_set: UV_SET_SECOND, ..texture(RED, [WRAP_CLAMP; 2], FILTER_LINEAR) };
    let looks = Materials {
        parameters: vec![lamp],
        textures: vec![first, second],
        second_corners: vec![[0, 1, 0]],
        second_uvs: vec![[0.5, 0.25], [-1.0, 2.0]],
        ..Materials::default()
    };
    let uvs = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
    let source = Source {
        positions: &CORNERS,
        triangles: &[[0, 1, 2]],
        corners: &[[0, 1, 2]],
        uvs: &uvs,
        ..Source::default()
    };
    let parts = ObjectParts {
        source: Some(source),
        groups: Some(&groups),
        materials: Some(&looks),
        ..one_triangle(&lines)
    };
    let without = Materials { second_corners: Vec::new(), second_uvs: Vec::new(), ..looks.clone() };
    let mut builder = FileBuilder::new();
    object(&mut builder, 0, &parts).unwrap();
    object(&mut builder, 1, &ObjectParts { materials: Some(&without), ..parts }).unwrap();
    images(&mut builder, [(hash128(RED), RED)]).unwrap();
    builder.finish()
}

/// A metal whose gloss has a texture, and which has a texture of normals; and an object without
/// gloss.
pub(super) fn gloss() -> Vec<u8> {
    let lines = lines(indexed(&[CORNERS], 0).as_bytes());
    let groups = GroupParts::of(&bth_import::Groups {
        groups: vec![bth_import::Group { name: "bell".into(), material: Some(0) }],
        materials: vec!["brass".into()],
        runs: vec![[0, 0]],
    });
    let brass = MaterialParameters {
        base_color: [1.0, 0.75, 0.25, 1.0],
        emissive: [0.0; 3],
        alpha_cutoff: 0.5,
        alpha_mode: ALPHA_OPAQUE,
        flags: 0,
        base_color_texture: NONE,
        emissive_texture: NONE,
        reserved: [0; 4],
    };
    let shiny = GlossParameters {
        metallic: 1.0,
        roughness: 0.25,
        metallic_roughness_texture: 1,
        normal_texture: 0,
        ..bth_import::NO_GLOSS
    };
    let looks = Materials {
        parameters: vec![brass],
        gloss: vec![shiny],
        textures: vec![
            texture(RED, [WRAP_REPEAT; 2], FILTER_LINEAR),
            texture(GREEN_AND_BLUE, [WRAP_CLAMP; 2], FILTER_LINEAR),
        ],
        ..Materials::default()
    };
    let parts = ObjectParts { groups: Some(&groups), materials: Some(&looks), ..one_triangle(&lines) };
    let without = Materials { gloss: Vec::new(), ..looks.clone() };
    let mut builder = FileBuilder::new();
    object(&mut builder, 0, &parts).unwrap();
    object(&mut builder, 1, &ObjectParts { materials: Some(&without), ..parts }).unwrap();
    images(&mut builder, [RED, GREEN_AND_BLUE].map(|image| (hash128(image), image))).unwrap();
    builder.finish()
}

/// Changes the valid file.
fn broken(name: &str, change: impl FnOnce(&mut Editor)) -> Case {
    broken_file("materials", name, change)
}

/// Changes a valid file.
fn broken_file(of: &str, name: &str, change: impl FnOnce(&mut Editor)) -> Case {
    let base = valid().into_iter().find(|c| c.name == of).expect("a valid file of that name");
    let mut editor = Editor::new(&base.bytes);
    change(&mut editor);
    Case::new(name, editor.seal(Seal::Sections))
}

/// Makes a section of object 0 shorter and fills the rest with zeros.
fn shorten(e: &mut Editor, (object, kind): (u32, u32), rows: u64) {
    let at = e.entry_at(object, kind);
    let number =
        |e: &Editor, field: usize| u64::from_le_bytes(e.bytes[at + field..][..8].try_into().unwrap());
    let (start, length) =
        (number(e, offset_of!(SectionEntry, offset)), number(e, offset_of!(SectionEntry, length)));
    let stride = length / number(e, offset_of!(SectionEntry, count));
    e.put(at + offset_of!(SectionEntry, length), &(rows * stride).to_le_bytes());
    e.put(at + offset_of!(SectionEntry, count), &rows.to_le_bytes());
    let zeros = vec![0; (length - rows * stride) as usize];
    e.put((start + rows * stride) as usize, &zeros);
}

/// Faults of materials, textures and vertex colors.
pub(super) fn invalid() -> Vec<Case> {
    let material = |name: &str, at: usize, value: u32| {
        broken(name, |e| {
            e.put_u32(kind::MATERIAL_PARAMETERS, at, value);
        })
    };
    let gloss = |name: &str, at: usize, value: u32| {
        broken_file("gloss", name, |e| {
            e.put_u32(kind::GLOSS_PARAMETERS, at, value);
        })
    };
    let texture = |name: &str, at: usize, value: u32| {
        broken(name, |e| {
            e.put_u32(kind::TEXTURES, 64 + at, value);
        })
    };
    let mut cases = vec![
        broken("F149-row-missing", |e| shorten(e, (0, kind::MATERIAL_PARAMETERS), 1)),
        material("F149-base-color", offset_of!(MaterialParameters, base_color), f32::INFINITY.to_bits()),
        material("F149-alpha", offset_of!(MaterialParameters, base_color) + 12, 1.5f32.to_bits()),
        material("F149-emissive", offset_of!(MaterialParameters, emissive) + 4, (-1.0f32).to_bits()),
        material("F149-cutoff", offset_of!(MaterialParameters, alpha_cutoff), f32::NAN.to_bits()),
        material("F149-alpha-mode", offset_of!(MaterialParameters, alpha_mode), 3),
        material("F149-flags", offset_of!(MaterialParameters, flags), 4),
        material("F149-base-color-texture", offset_of!(MaterialParameters, base_color_texture), 3),
        material("F149-emissive-texture", 64 + offset_of!(MaterialParameters, emissive_texture), NONE - 1),
        material("F149-reserved", offset_of!(MaterialParameters, reserved) + 12, 1),
        texture("F160-wrap", offset_of!(Texture, wrap) + 4, 3),
        texture("F160-filter", offset_of!(Texture, filter), 2),
        texture("F160-transform", offset_of!(Texture, transform) + 8, f32::NAN.to_bits()),
        texture("F160-reserved", offset_of!(Texture, reserved) + 4, 1),
        texture("F160-uv-set", offset_of!(Texture, uv_set), 2),
        broken("F161-row", |e| {
            e.put_u32(kind::COLOR_CORNERS, 4, 2);
        }),
        broken("F161-no-colors", |e| shorten(e, (0, kind::COLORS), 0)),
        texture("F162-no-such-image", offset_of!(Texture, image), 0),
    ];
    cases.extend([
        gloss("F222-metallic", offset_of!(GlossParameters, metallic), 1.5f32.to_bits()),
        gloss("F222-roughness", offset_of!(GlossParameters, roughness), f32::NAN.to_bits()),
        gloss("F222-normal-scale", offset_of!(GlossParameters, normal_scale), f32::INFINITY.to_bits()),
        gloss("F222-strength", offset_of!(GlossParameters, occlusion_strength), (-1.0f32).to_bits()),
        gloss("F222-texture", offset_of!(GlossParameters, normal_texture), 2),
        gloss("F222-reserved", offset_of!(GlossParameters, reserved), 1),
    ]);
    cases.extend(invalid_images());
    let second = |name: &str, change: &dyn Fn(&mut Editor)| broken_file("second-uvs", name, change);
    cases.extend([
        second("F220-row", &|e| {
            e.put_u32(kind::SECOND_CORNERS, 8, 2);
        }),
        second("F220-no-coordinates", &|e| shorten(e, (0, kind::SECOND_UVS), 0)),
        second("F221-not-finite", &|e| {
            e.put_u32(kind::SECOND_UVS, 12, f32::NAN.to_bits());
        }),
    ]);
    cases
}

/// Faults of images.
fn invalid_images() -> Vec<Case> {
    let image = |name: &str, at: usize, value: &[u8]| {
        broken(name, |e| {
            let entry = e.entry_at(NONE, kind::IMAGES) + offset_of!(SectionEntry, offset);
            let start = u64::from_le_bytes(e.bytes[entry..][..8].try_into().unwrap()) as usize;
            e.put(start + at, value);
        })
    };
    let row = size_of::<Image>();
    let [first, second] = image_names();
    vec![
        image("F162-names-equal", row, &first),
        image("F162-names-descend", 0, &second.map(|byte| byte | 0x80)),
        image("F162-gap", row + offset_of!(Image, first), &1u64.to_le_bytes()),
        image("F162-empty", offset_of!(Image, length), &[0; 8]),
        image("F162-beyond", row + offset_of!(Image, length), &u64::MAX.to_le_bytes()),
        image("F162-bytes-left", row + offset_of!(Image, length), &1u64.to_le_bytes()),
        broken("F162-no-images", |e| shorten(e, (NONE, kind::IMAGES), 0)),
    ]
}
