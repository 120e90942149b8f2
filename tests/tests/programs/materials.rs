//! Materials from the source to pixels: colours of small made glTF and OBJ models in pictures of
//! `bth-play`, and errors.

use crate::made_models::{VIEW, at, nothing, picture, png, shown, square, unlit, uri};
use crate::support::{Run, bthc, command, folder, run, run_with};
use serde_json::{Value, json};
use std::path::Path;

#[test]
fn four_texels_are_where_the_texture_has_them_with_their_bytes() {
    let texels = [[255, 0, 0, 255], [0, 188, 0, 255], [10, 20, 230, 255], [188, 188, 188, 255]];
    let material = unlit(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    let picture = picture(&square(&material, &[json!({"uri": uri(&png(2, &texels))})], None), &[]);
    for ((x, y), texel) in [(0.5, 1.5), (1.5, 1.5), (0.5, 0.5), (1.5, 0.5)].into_iter().zip(texels) {
        assert_eq!(at(&picture, x, y), texel[..3], "({x}, {y})");
    }
}

/// The base colour by the second set of texture coordinates, which runs from right to left, and the
/// emission by the first one; and the other way round. A mirrored node shows the same surface from
/// behind.
#[test]
fn textures_of_two_sets_lie_where_each_set_has_them() {
    let red_left = uri(&png(2, &[[255, 0, 0, 255], [0, 0, 0, 255]]));
    let green_top = uri(&png(1, &[[0, 255, 0, 255], [0, 0, 0, 255]]));
    let images = [json!({"uri": red_left}), json!({"uri": green_top})];
    for (base, emissive) in [(1, 0), (0, 1), (1, 1), (0, 0)] {
        let material = unlit(json!({"doubleSided": true, "emissiveFactor": [1, 1, 1],
            "emissiveTexture": {"index": 1, "texCoord": emissive},
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "texCoord": base}}}));
        let mut document: Value = serde_json::from_str(&square(&material, &images, None)).unwrap();
        // Right to left, and upside down.
        let turned: Vec<u8> =
            [1.0f32, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0].iter().flat_map(|x| x.to_le_bytes()).collect();
        document["buffers"].as_array_mut().unwrap().push(json!({"byteLength": 32, "uri": uri(&turned)}));
        document["bufferViews"].as_array_mut().unwrap().push(json!({"buffer": 1, "byteLength": 32}));
        let accessor = json!({"bufferView": 4, "componentType": 5126, "count": 4, "type": "VEC2"});
        document["accessors"].as_array_mut().unwrap().push(accessor);
        document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = json!(4);
        for mirrored in [false, true] {
            if mirrored {
                document["nodes"][0] = json!({"mesh": 0, "scale": [-1, 1, 1], "translation": [2, 0, 0]});
            }
            let picture = picture(&document.to_string(), &[]);
            for (x, y) in [(0.5, 1.5), (1.5, 1.5), (0.5, 0.5), (1.5, 0.5)] {
                let is_red = ((x < 1.0) != (base == 1)) != mirrored;
                let is_green = (y > 1.0) != (emissive == 1);
                let expected = [if is_red { 255 } else { 0 }, if is_green { 255 } else { 0 }, 0];
                assert_eq!(
                    at(&picture, x, y),
                    expected,
                    "sets {base} and {emissive} at ({x}, {y}), {mirrored}"
                );
            }
        }
    }
}

/// Every step of the chain is linear light: 0.5 of it is the byte 188 (IEC 61966-2-1).
#[test]
fn half_the_light_is_mid_grey_from_factors_vertices_and_texels() {
    let grey = png(1, &[[188, 188, 188, 255]]);
    let factor = unlit(json!({"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1]}}));
    assert_eq!(at(&picture(&square(&factor, &[], None), &[]), 1.2, 0.7), [188; 3]);
    let white = unlit(json!({}));
    assert_eq!(at(&picture(&square(&white, &[], Some([[0.5, 0.5, 0.5, 1.0]; 4])), &[]), 1.2, 0.7), [188; 3]);
    let texel = unlit(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    let image = [json!({"uri": uri(&grey)})];
    assert_eq!(at(&picture(&square(&texel, &image, None), &[]), 1.2, 0.7), [188; 3]);
    // Vertex colours are interpolated linearly: 0.25 on the left to 0.75 on the right.
    let ramp =
        [[0.25, 0.25, 0.25, 1.0], [0.75, 0.75, 0.75, 1.0], [0.75, 0.75, 0.75, 1.0], [0.25, 0.25, 0.25, 1.0]];
    let ramped = picture(&square(&white, &[], Some(ramp)), &[]);
    let light = |byte: u8| ((f64::from(byte) / 255.0 + 0.055) / 1.055).powf(2.4);
    for x in [0.2, 0.6, 1.3, 1.8] {
        // The pixel shows the mean over its width of 0.05.
        let expected = 0.25 + 0.25 * ((x * 20.0f64).floor() + 0.5) / 20.0;
        assert!((light(at(&ramped, x, 1.0)[0]) - expected).abs() < 0.01, "{x}");
    }
}

#[test]
fn masks_are_holes_for_all_rays_and_blending_lets_a_share_pass() {
    let half = [json!({"uri": uri(&png(2, &[[255, 255, 255, 0], [255, 255, 255, 255]]))})];
    let mask = unlit(
        json!({"alphaMode": "MASK", "doubleSided": true, "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}),
    );
    for args in [&[][..], &["--mode", "path", "--exposure", "0", "--denoise", "off"]] {
        let (seen, empty) = (picture(&square(&mask, &half, None), args), nothing(args));
        assert_eq!(at(&seen, 0.5, 1.0), at(&empty, 0.5, 1.0), "{args:?}");
        assert_ne!(at(&seen, 1.5, 1.0), at(&empty, 1.5, 1.0), "{args:?}");
    }
    assert_eq!(at(&picture(&square(&mask, &half, None), &[]), 1.5, 1.0), [255; 3]);
    let black = unlit(
        json!({"alphaMode": "BLEND", "doubleSided": true, "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 0.5]}}),
    );
    let many = ["--spp", "64"];
    let (seen, empty) = (picture(&square(&black, &[], None), &many), nothing(&many));
    let light = |pixel: [u8; 3]| ((f64::from(pixel[1]) / 255.0 + 0.055) / 1.055).powf(2.4);
    let share = light(at(&seen, 1.0, 1.0)) / light(at(&empty, 1.0, 1.0));
    assert!((share - 0.5).abs() < 0.05, "half of the light behind passes: {share}");
}

#[test]
fn backs_are_seen_only_of_double_sided_materials() {
    let behind = ["--camera", "1,1,-5,1,1,0"];
    let material = |double| {
        unlit(json!({"doubleSided": double, "pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}}))
    };
    let [single, double] =
        [false, true].map(|double| picture(&square(&material(double), &[], None), &behind));
    assert_eq!(at(&double, 1.0, 1.0), [255, 0, 0]);
    assert_eq!(at(&single, 1.0, 1.0), at(&nothing(&behind), 1.0, 1.0));
    assert_eq!(at(&picture(&square(&material(false), &[], None), &[]), 1.0, 1.0), [255, 0, 0]);
}

/// The byte of light in a picture of mode path with `--exposure 0`, below the light that is
/// compressed: the tone mapper takes 0.04 away.
fn byte(light: f64) -> f64 {
    255.0 * (1.055 * (light - 0.04).powf(1.0 / 2.4) - 0.055)
}

const EXACT: [&str; 6] = ["--mode", "path", "--exposure", "0", "--denoise", "off"];

/// A black surface shows its emission alone: 0.2 of the light is the byte 124.
#[test]
fn emission_is_added_to_reflected_light() {
    let texels = [json!({"uri": uri(&png(1, &[[255, 188, 255, 255]]))})];
    let material = unlit(json!({"emissiveFactor": [0.2, 0.4, 0.2], "emissiveTexture": {"index": 0},
        "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]}}));
    let model = square(&material, &texels, None);
    let [r, g, b] = at(&picture(&model, &[]), 1.0, 1.0);
    assert_eq!([r, b], [124, 124]);
    assert!(g.abs_diff(124) <= 1, "0.4 times 0.503: {g}");
    let traced = at(&picture(&model, &EXACT), 1.0, 1.0);
    assert!((f64::from(traced[0]) - byte(0.2)).abs() <= 1.0, "{traced:?} for {}", byte(0.2));
    // The same light on top of what is reflected.
    let lit = |emitted: f64| {
        let material = json!({"emissiveFactor": [emitted, emitted, emitted],
            "pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.2, 0.2, 1], "metallicFactor": 0}});
        let [r, ..] = at(&picture(&square(&material, &[], None), &[]), 1.0, 1.0);
        ((f64::from(r) / 255.0 + 0.055) / 1.055).powf(2.4)
    };
    assert!((lit(0.2) - lit(0.0) - 0.2).abs() < 0.01);
}

/// The white furnace: in uniform light a white surface cannot be told from it, be it metal or not,
/// rough or smooth; a red metal reflects red alone.
#[test]
fn white_surfaces_reflect_all_light_and_metals_have_its_color() {
    let surface = |base: [f64; 3], metallic: f64, roughness: f64| {
        let [r, g, b] = base;
        let material = json!({"doubleSided": true, "pbrMetallicRoughness": {"baseColorFactor": [r, g, b, 1],
            "metallicFactor": metallic, "roughnessFactor": roughness}});
        let folder = folder(&[("a.gltf", &square(&material, &[], None))]);
        bthc(folder.path(), &["compile", "a.gltf", "--materials", "-o", "a.bth"]).expect(0);
        std::fs::write(folder.path().join("grey.hdr"), hdr(4, 2, [128, 128, 128, 129])).unwrap();
        let args = [&EXACT[..], &["--env", "grey.hdr", "--spp", "64"]].concat();
        at(&shown(folder.path(), &args), 1.0, 1.0)
    };
    for (metallic, roughness) in [(0.0, 1.0), (0.0, 0.3), (1.0, 1.0), (1.0, 0.5), (1.0, 0.1)] {
        let [r, g, b] = surface([1.0; 3], metallic, roughness);
        let off = f64::from(r) - byte(0.6);
        assert!(off.abs() < 4.0 && r == g && g == b, "{metallic} {roughness}: {r} for {}", byte(0.6));
    }
    let [r, g, b] = surface([1.0, 0.02, 0.02], 1.0, 0.2);
    assert!(r > 180 && g < 60 && b < 60, "{r} {g} {b}");
}

/// An object with a look of its manifest is shown as the same model with that material.
#[test]
fn objects_of_manifests_look_as_they_say() {
    let made = |base: [f64; 3], metallic: f64, emitted: f64| {
        let [r, g, b] = base;
        let material = json!({"doubleSided": true, "emissiveFactor": [emitted, 0, 0],
            "pbrMetallicRoughness": {"baseColorFactor": [r, g, b, 1], "metallicFactor": metallic,
            "roughnessFactor": 0.5}});
        square(&material, &[], None)
    };
    let grey = made([0.3; 3], 0.0, 0.0);
    let looks = [
        ("color = \"#00bc00\", material = { roughness = 0.5 }", made([0.0, 0.502_886_458, 0.0], 0.0, 0.0)),
        (
            "color = [0.9, 0.4, 0.1], material = { metallic = 1, roughness = 0.5, emission = [0.1, 0, 0] }",
            made([0.9, 0.4, 0.1], 1.0, 0.1),
        ),
    ];
    for (look, model) in looks {
        let text = format!(
            "version = 1\nobjects = [{{ name = \"a\", model = \"grey.gltf\", mesh = 0, {look} }}]\n\
             nodes = [{{ name = \"a\", object = \"a\" }}]\n"
        );
        let folder = folder(&[("grey.gltf", &grey), ("a.manifest", &text)]);
        bthc(folder.path(), &["compile", "a.manifest", "-o", "a.bth"]).expect(0);
        bthc(folder.path(), &["verify", "a.bth"]).expect(0);
        for args in [&[][..], &EXACT] {
            let (seen, expected) = (shown(folder.path(), args), picture(&model, args));
            assert_eq!(at(&seen, 1.0, 1.0), at(&expected, 1.0, 1.0), "{look} {args:?}");
            let [r, g, b] = at(&seen, 1.0, 1.0);
            assert!(r.abs_diff(g) > 40 && r.abs_diff(b) > 0, "{look}: {r} {g} {b}");
        }
    }
}

/// The key light comes from above and the left: surfaces that a texture turns there are brighter.
#[test]
fn textures_turn_surfaces_and_keep_light_from_them() {
    let turned = |left: [u8; 4], right: [u8; 4]| {
        let normals = [json!({"uri": uri(&png(2, &[left, right]))})];
        let material = json!({"normalTexture": {"index": 0},
            "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 1}});
        let picture = picture(&square(&material, &normals, None), &["--spp", "16"]);
        [0.5, 1.5].map(|x| u32::from(at(&picture, x, 1.0)[1]))
    };
    let [left, right] = turned([40, 128, 220, 255], [216, 128, 220, 255]);
    assert!(left > right + 30, "left {left}, right {right}");
    let [up, down] = turned([128, 216, 220, 255], [128, 40, 220, 255]);
    assert!(up > down + 30, "up {up}, down {down}");
    let [flat, same] = turned([128, 128, 255, 255], [128, 128, 255, 255]);
    assert!(flat.abs_diff(same) < 12, "{flat} {same}");
    let occluded = |strength: f64| {
        let black = [json!({"uri": uri(&png(1, &[[0, 0, 0, 255]]))})];
        let material = json!({"occlusionTexture": {"index": 0, "strength": strength},
            "pbrMetallicRoughness": {"metallicFactor": 0}});
        at(&picture(&square(&material, &black, None), &["--spp", "16"]), 1.0, 1.0)[1]
    };
    assert!(occluded(1.0) + 15 < occluded(0.0));
}

#[test]
fn light_falls_on_base_colors_and_clay_stays_what_it_was() {
    let red = json!({"doubleSided": true, "pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.1, 0.1, 1], "metallicFactor": 0}});
    let model = square(&red, &[], None);
    let [r, g, b] = at(&picture(&model, &[]), 1.0, 1.0);
    assert!(r > 2 * g && r > 2 * b && r < 255, "{r} {g} {b}");
    let folder = folder(&[("a.gltf", &model)]);
    bthc(folder.path(), &["compile", "a.gltf", "--flatten", "-o", "a.bth"]).expect(0);
    let plain = shown(folder.path(), &[]);
    assert!(plain == picture(&model, &["--mode", "clay"]), "clay, and a file without materials");
}

#[test]
fn pictures_do_not_depend_on_threads_and_instruction_sets() {
    let texels: Vec<[u8; 4]> =
        (0..64u8).map(|k| [4 * k, 255 - 4 * k, 128, if k % 3 == 0 { 0 } else { 200 }]).collect();
    let material = json!({"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}});
    let model = square(&material, &[json!({"uri": uri(&png(8, &texels))})], Some([[1.0, 0.5, 0.2, 0.9]; 4]));
    let folder = folder(&[("a.gltf", &model)]);
    bthc(folder.path(), &["compile", "a.gltf", "--materials", "-o", "a.bth"]).expect(0);
    for mode in ["shaded", "path"] {
        let one = shown(folder.path(), &["--mode", mode, "--threads", "1", "--isa", "scalar"]);
        assert!(one == shown(folder.path(), &["--mode", mode, "--threads", "3"]), "{mode}");
    }
}

/// The text of a Radiance file of one color.
fn hdr(width: u32, height: u32, rgbe: [u8; 4]) -> Vec<u8> {
    let mut bytes = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes();
    (0..width * height).for_each(|_| bytes.extend(rgbe));
    bytes
}

#[test]
fn surroundings_light_the_scene_in_their_color() {
    let white = json!({"doubleSided": true, "pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.8, 0.8, 1]}});
    let folder = folder(&[("a.gltf", &square(&white, &[], None))]);
    bthc(folder.path(), &["compile", "a.gltf", "--materials", "-o", "a.bth"]).expect(0);
    std::fs::write(folder.path().join("blue.hdr"), hdr(4, 2, [10, 20, 200, 129])).unwrap();
    std::fs::write(folder.path().join("bad.hdr"), b"#?RADIANCE\n\n-Y 4").unwrap();
    let seen =
        shown(folder.path(), &["--mode", "path", "--exposure", "0", "--env", "blue.hdr", "--spp", "16"]);
    let [r, g, b] = at(&seen, 1.0, 1.0);
    assert!(b > g && g > r && b > 100, "{r} {g} {b}");
    let failed = |args: &[&str], code: i32, text: &str| {
        let all: Vec<&str> = ["a.bth", "-o", "x.png"].iter().chain(args).copied().collect();
        let run = run("bth-play", folder.path(), &all).expect(code);
        assert!(run.stderr.contains(text) && run.stderr.contains("hint"), "{run:?}");
    };
    failed(&["--mode", "path", "--env", "bad.hdr"], 3, "bad.hdr: BTH-P006");
    failed(&["--mode", "path", "--env", "none.hdr"], 4, "none.hdr: BTH-P006");
    failed(&["--env", "blue.hdr"], 2, "--mode path");
}

/// A square of two triangles of OBJ with a library.
fn obj(folder: &Path, library: &str) -> Run {
    let text = "mtllib a.mtl\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl paint\nf 1/1 2/2 3/3 4/4\n";
    std::fs::write(folder.join("a.obj"), text).unwrap();
    std::fs::write(folder.join("a.mtl"), library).unwrap();
    bthc(folder, &["compile", "a.obj", "--materials", "-o", "a.bth"])
}

#[test]
fn material_libraries_of_obj_files_are_read() {
    let folder = folder(&[]);
    let texels = [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [255, 255, 255, 255]];
    std::fs::write(folder.path().join("four texels.png"), png(2, &texels)).unwrap();
    // Black, so that the emission alone is seen; the second coordinate of OBJ grows upwards.
    obj(folder.path(), "newmtl paint\nKd 0 0 0\nKe 0.2 0.2 0.2\nmap_Ke -clamp on four texels.png\n")
        .expect(0);
    let seen = shown(folder.path(), &[]);
    for ((x, y), [r, g, b, _]) in [(0.2, 1.8), (1.8, 1.8), (0.2, 0.2), (1.8, 0.2)].into_iter().zip(texels) {
        assert_eq!(at(&seen, x, y), [r, g, b].map(|byte| if byte == 255 { 124 } else { 0 }), "({x}, {y})");
    }
    let other = obj(folder.path(), "newmtl other\nKd 1 0 0\nmap_Bump x.png\nbump y.png\n").expect(0);
    assert!(
        other.stderr.contains("\"paint\" is in no library") && other.stderr.contains("bump, map_bump"),
        "{other:?}"
    );
}

#[test]
fn what_cannot_be_read_is_an_error_with_place_and_hint() {
    let folder = folder(&[]);
    let refused = |run: Run, texts: &[&str]| {
        let run = run.expect(if texts.contains(&"BTH-L003") { 5 } else { 3 });
        assert!(texts.iter().chain(&["hint"]).all(|text| run.stderr.contains(text)), "{texts:?} in {run:?}");
    };
    let gltf = |image: Value| {
        let material = json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}});
        std::fs::write(folder.path().join("a.gltf"), square(&material, &[image], None)).unwrap();
        bthc(folder.path(), &["compile", "a.gltf", "--materials", "-o", "b.bth"])
    };
    refused(gltf(json!({"uri": "none.png"})), &["a.gltf: image 0: BTH-I016", "none.png", "--materials"]);
    refused(
        gltf(json!({"uri": uri(b"no image at all")})),
        &["a.gltf: image 0: BTH-I016", "PNG, JPEG or WebP"],
    );
    let mut huge = png(1, &[[1; 4]]);
    huge[16..24].copy_from_slice(&[0, 1, 0, 0, 0, 1, 0, 0]);
    refused(gltf(json!({"uri": uri(&huge)})), &["BTH-L003", "/a.gltf: image 0 has 4294967296 texels"]);
    refused(obj(folder.path(), "newmtl paint\nmap_Kd none.png\n"), &["a.mtl:2: BTH-I016", "none.png"]);
    refused(obj(folder.path(), "newmtl paint\nKd 1 x 0\n"), &["a.mtl:2: BTH-I002", "red, green and blue"]);
    refused(obj(folder.path(), "newmtl paint\nd 7\n"), &["a.mtl:2: BTH-I002", "0 to 1"]);
    refused(obj(folder.path(), "newmtl paint\nmap_Kd C:\\x.png\n"), &["a.mtl:2: BTH-I016", "relative"]);
    std::fs::remove_file(folder.path().join("a.mtl")).unwrap();
    let lost = bthc(folder.path(), &["compile", "a.obj", "--materials", "-o", "a.bth"]);
    refused(lost, &["a.obj:1: BTH-I016", "a.mtl"]);
    // An image whose header alone is right shows when it is decoded; the rest is shown.
    let good = png(16, &[[9; 4]; 256]);
    gltf(json!({"uri": uri(&good[..good.len() - 20])})).expect(0);
    let shown = run("bth-play", folder.path(), &["b.bth", "-o", "x.png", "--size", "20x20"]).expect(0);
    assert!(
        shown.stderr.contains("b.bth: image 0: BTH-P005") && shown.stderr.contains("--mode clay"),
        "{shown:?}"
    );
}

/// What was compiled without an image is not taken from the cache where the image is wanted,
/// neither for a model nor for a scene.
#[test]
fn what_lacks_an_image_is_in_the_cache_for_lenient_compilations_alone() {
    let folder = folder(&[]);
    obj(folder.path(), "newmtl paint\nKd 1 0 0\nmap_Kd none.png\n").expect(3);
    let material = json!({"alphaMode": "MASK", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}});
    std::fs::write(folder.path().join("a.gltf"), square(&material, &[json!({"uri": "none.png"})], None))
        .unwrap();
    for model in ["a.obj", "a.gltf"] {
        for wanted in [&["--materials"][..], &["--alpha", "mask"]] {
            if model == "a.obj" && wanted[0] == "--alpha" {
                continue;
            }
            let compile = |output: &str, more: &[&str]| {
                let common = ["compile", model, "--structure", "bvh", "--cache-dir", "cache", "-o", output];
                bthc(folder.path(), &[&common, wanted, more].concat())
            };
            for output in ["first.bth", "second.bth"] {
                let lenient = compile(output, &["--lenient-materials"]).expect(0);
                assert!(lenient.stderr.contains("; it is left out"), "{lenient:?}");
            }
            assert!(compile("third.bth", &[]).expect(3).stderr.contains("BTH-I016"), "{model} {wanted:?}");
        }
    }
}

/// The player compiles models with materials. Images that cannot be read it does without, and where
/// materials are malformed it says so and shows the rest.
#[test]
fn models_are_shown_in_their_colors() {
    let folder = folder(&[]);
    let play = |model: &str, args: &[&str]| {
        let all: Vec<&str> = [model, "-o", "a.png"].iter().chain(&VIEW).chain(args).copied().collect();
        let mut play = command("bth-play", folder.path(), &all);
        play.env_remove("BTH_NO_CACHE").env("BTH_CACHE_DIR", folder.path().join("cache"));
        let run = run_with(play).expect(0);
        (run.stderr, std::fs::read(folder.path().join("a.png")).unwrap())
    };
    let red = unlit(json!({"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}}));
    std::fs::write(folder.path().join("a.gltf"), square(&red, &[], None)).unwrap();
    let (shown, clay) = (play("a.gltf", &[]).1, play("a.gltf", &["--mode", "clay"]).1);
    assert_ne!(shown, clay);
    let textured = unlit(json!({"pbrMetallicRoughness":
        {"baseColorFactor": [1, 0, 0, 1], "baseColorTexture": {"index": 0}}}));
    std::fs::write(folder.path().join("b.gltf"), square(&textured, &[json!({"uri": "none.png"})], None))
        .unwrap();
    let (said, picture) = play("b.gltf", &[]);
    assert!(
        said.contains("b.gltf: image 0: expected the image") && said.contains("; it is left out"),
        "{said}"
    );
    assert_eq!(picture, shown);
    // The image is used as soon as it is there.
    std::fs::write(folder.path().join("none.png"), png(1, &[[0, 255, 0, 255]])).unwrap();
    let (said, picture) = play("b.gltf", &[]);
    assert!(said.lines().all(|line| !line.starts_with("warning: ")) && picture != shown, "{said}");
    let broken = unlit(json!({"pbrMetallicRoughness": {"baseColorFactor": [2, 0, 0, 3]}}));
    std::fs::write(folder.path().join("c.gltf"), square(&broken, &[], None)).unwrap();
    let (said, picture) = play("c.gltf", &[]);
    assert!(
        said.contains("BTH-I002") && said.contains("warning: c.gltf: its materials cannot be read"),
        "{said}"
    );
    assert_eq!(picture, clay);
}

/// Files without the option are what they were; with it only sections are added, and a scene stores
/// each image once.
#[test]
fn materials_are_sections_of_their_own_and_images_are_stored_once() {
    let folder = folder(&[]);
    let image = uri(&png(2, &[[1, 2, 3, 255], [9, 8, 7, 255]]));
    let material = json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}});
    for name in ["a.gltf", "b.gltf"] {
        let shift = if name == "a.gltf" { json!({}) } else { json!({"name": "another"}) };
        let mut model: Value =
            serde_json::from_str(&square(&material, &[json!({"uri": image})], None)).unwrap();
        model["materials"][0].as_object_mut().unwrap().extend(shift.as_object().unwrap().clone());
        std::fs::write(folder.path().join(name), model.to_string()).unwrap();
    }
    let manifest = "version = 1\n[[objects]]\nname = \"a\"\nmodel = \"a.gltf\"\n[[objects]]\nname = \"b\"\nmodel = \"b.gltf\"\n\
        [[nodes]]\nname = \"a\"\nobject = \"a\"\n[[nodes]]\nname = \"b\"\nobject = \"b\"\n";
    std::fs::write(folder.path().join("s.manifest"), manifest).unwrap();
    bthc(folder.path(), &["compile", "s.manifest", "--materials", "-o", "s.bth"]).expect(0);
    bthc(folder.path(), &["verify", "s.bth"]).expect(0);
    let info = bthc(folder.path(), &["info", "s.bth", "--json"]).expect(0).json();
    let count = |kind: &str| {
        let sections = info["sections"].as_array().unwrap().iter().filter(|s| s["kind"] == kind);
        sections.map(|s| s["count"].as_u64().unwrap()).collect::<Vec<_>>()
    };
    assert_eq!(
        (count("MATERIAL_PARAMETERS"), count("TEXTURES"), count("IMAGES")),
        (vec![1, 1], vec![1, 1], vec![1])
    );
    bthc(folder.path(), &["compile", "a.gltf", "-o", "plain.bth", "--attributes", "all", "--names"])
        .expect(0);
    bthc(folder.path(), &["compile", "a.gltf", "-o", "rich.bth", "--materials"]).expect(0);
    let [plain, rich] =
        ["plain.bth", "rich.bth"].map(|file| bth_format::File::read(folder.path().join(file)).unwrap());
    let added = [35, 36, 39, 40, 70];
    for section in rich.sections().filter(|s| s.entry.kind != 32 && !added.contains(&s.entry.kind)) {
        let same = plain.section(section.entry.object, section.entry.kind).unwrap();
        assert!(same.bytes == section.bytes, "kind {}", section.entry.kind);
    }
    assert_eq!(rich.table().len(), plain.table().len() + added.len());
}
