//! Scenes whose glTF documents are damaged at random, from the seeds of the fuzz target
//! `gltf_scene`: they are refused, or give manifests that read back equal and meshes with all that
//! moves them in range.

use std::path::Path;

use bth_import::gltf::Chosen;
use bth_import::gltf::scene::{self, ImportOptions};
use bth_import::{GltfPart, Keep, Mesh, Silent, import_gltf_parts_bytes};
use bth_random::Rng;
use bth_scene::Source;

/// Numbers that replace others.
const NUMBERS: [&str; 12] =
    ["0", "1", "2", "3", "4", "5", "-1", "1e39", "0.5", "65536", "4294967295", "18446744073709551615"];

fn seed(name: &str) -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds/gltf_scene").join(name);
    std::fs::read(path).unwrap()
}

/// A document with a number replaced, a part removed or doubled, or a character of the binary data
/// changed.
fn damaged(bytes: &[u8], rng: &mut Rng) -> Vec<u8> {
    let mut out = bytes.to_vec();
    let below = |rng: &mut Rng, n: usize| rng.below(n.max(1) as u64) as usize;
    for _ in 0..1 + rng.below(3) {
        let at = below(rng, out.len());
        match rng.below(4) {
            0 => {
                let Some(start) = out[at..].iter().position(u8::is_ascii_digit).map(|k| at + k) else {
                    continue;
                };
                let end = start + out[start..].iter().take_while(|c| c.is_ascii_digit()).count();
                let number = NUMBERS[below(rng, NUMBERS.len())];
                out.splice(start..end, number.bytes());
            }
            kind @ (1 | 2) => {
                let comma = |from: usize| out[from..].iter().position(|c| *c == b',').map(|k| from + k);
                let Some(start) = comma(at) else { continue };
                let Some(end) = comma(start + 1) else { continue };
                let part = if kind == 1 { Vec::new() } else { [&out[start..end], &out[start..end]].concat() };
                out.splice(start..end, part);
            }
            _ => {
                // Within base64, whose alphabet this is.
                let Some(data) = out.windows(7).position(|w| w == b"base64,") else { continue };
                let at = data + 7 + below(rng, 400);
                let letter = b"ABCDwxyz0129+/"[below(rng, 14)];
                if let Some(c) = out.get_mut(at).filter(|c| c.is_ascii_alphanumeric()) {
                    *c = letter;
                }
            }
        }
    }
    out
}

fn check(mesh: &Mesh) {
    let Some(moved) = &mesh.deformation else { return };
    let normals = mesh.attributes.as_ref().map_or(0, |attributes| attributes.normals.len());
    let (sets, targets) = (moved.counts.influence_sets as usize, moved.counts.targets as usize);
    assert_eq!([moved.joints.len(), moved.weights.len()], [sets * mesh.positions.len(); 2]);
    assert!(moved.joints.as_flattened().iter().all(|joint| u32::from(*joint) < moved.counts.joints));
    assert!(moved.weights.as_flattened().iter().all(|weight| weight.is_finite() && *weight >= 0.0));
    assert!(moved.deltas.as_flattened().iter().all(|x| x.is_finite()));
    assert!([targets, 2 * targets].contains(&moved.morphs.len()));
    for (i, morph) in moved.morphs.iter().enumerate() {
        let all = if i < targets { mesh.positions.len() } else { normals };
        if morph.first_row == u32::MAX {
            assert_eq!(morph.deltas as usize, all);
        } else {
            let rows = &moved.morph_rows[morph.first_row as usize..][..morph.deltas as usize];
            assert!(rows.windows(2).all(|pair| pair[0] < pair[1]));
            assert!(rows.iter().all(|row| (*row as usize) < all));
        }
        assert!(morph.first_delta as usize + morph.deltas as usize <= moved.deltas.len());
    }
}

/// How far the reader came: to a manifest, to meshes, to meshes that deform.
fn read(bytes: &[u8], rigid_parts: bool) -> [bool; 3] {
    let path = Path::new("/nonexistent/model.gltf");
    let options = ImportOptions { animation: Chosen::All, rigid_parts, ..ImportOptions::default() };
    let Ok((manifest, _)) = scene::import_bytes(path, bytes, "model.gltf", &options, &Silent) else {
        return [false; 3];
    };
    let text = manifest.to_toml();
    let again = bth_scene::parse(&text, Path::new("a.manifest"));
    assert!(again.unwrap_or_else(|e| panic!("{e}\n{text}")) == manifest, "{text}");
    let part = |object: &bth_scene::Object| match object.source {
        Source::Model { mesh, .. } => mesh.map(GltfPart::Mesh),
        Source::Deforming { mesh, without, .. } => Some(GltfPart::Deforming { mesh, without }),
        Source::RigidPart { mesh, joint, .. } => Some(GltfPart::Rigid { mesh, joint }),
        Source::AtRest { node, .. } => Some(GltfPart::AtRest(node)),
        _ => None,
    };
    let parts: Vec<GltfPart> = manifest.objects.iter().filter_map(part).collect();
    let Ok(meshes) = import_gltf_parts_bytes(path, bytes, &parts, Keep::All, &Silent) else {
        return [true, false, false];
    };
    meshes.iter().for_each(|(mesh, _)| check(mesh));
    [true, true, meshes.iter().any(|(mesh, _)| mesh.deformation.is_some())]
}

#[test]
fn a_skin_that_does_not_exist_is_an_error_of_meshes_whose_weights_move() {
    let text = String::from_utf8(seed("morphed_skin.gltf")).unwrap();
    let other = text.replace(r#""skin":0"#, r#""skin":1"#);
    assert_ne!(other, text);
    let options = ImportOptions::default();
    let read = scene::import_bytes(Path::new("a.gltf"), other.as_bytes(), "a.gltf", &options, &Silent);
    let error = read.err().map(|error| error.to_string()).unwrap_or_default();
    assert!(error.starts_with("a.gltf: skin 1: BTH-I012: it does not exist"), "{error}");
}

#[test]
fn damaged_documents_are_refused_or_make_sense() {
    let mut counts = [0; 3];
    for name in ["skinned.gltf", "morphed.gltf", "morphed_skin.gltf"] {
        let whole = seed(name);
        assert_eq!(read(&whole, false), [true; 3], "{name}");
        assert_eq!(read(&whole, true)[..2], [true; 2], "{name}");
        let mut rng = Rng::new(7);
        for round in 0..4000 {
            let came = read(&damaged(&whole, &mut rng), round % 4 == 0);
            counts.iter_mut().zip(came).for_each(|(count, came)| *count += usize::from(came));
        }
    }
    // The damage is neither fatal nor harmless: each step accepts some and refuses some.
    assert!(
        counts[2] > 400 && counts[1] >= counts[2] && counts[0] > counts[1] && counts[0] < 7600,
        "{counts:?}"
    );
}
