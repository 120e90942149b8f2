//! Compressed glTF: files that gltf-transform 4 wrote (with the meshoptimizer and Draco of their
//! authors), and what other than files of the authors could be.

use super::*;
use std::path::Path;

/// The bent sheet of 5 by 4 vertices that the files contain.
fn sheet() -> ([[f64; 3]; 20], [[f64; 2]; 20]) {
    let row = |v: usize| (v % 5, v / 5);
    let position = |v| {
        let (i, j) = row(v);
        let angle = i as f64 * 0.4;
        [angle.sin(), j as f64 * 0.5, angle.cos()]
    };
    let uv = |v| {
        let (i, j) = row(v);
        [i as f64 / 4.0, j as f64 / 3.0]
    };
    (std::array::from_fn(position), std::array::from_fn(uv))
}

/// The sheet's triangles, each from its smallest vertex on, in order.
fn sheet_triangles() -> Vec<[usize; 3]> {
    let quads = (0..3).flat_map(|j| (0..4).map(move |i| j * 5 + i));
    let mut triangles: Vec<_> = quads.flat_map(|v| [[v, v + 1, v + 6], [v, v + 6, v + 5]]).collect();
    triangles.sort();
    triangles
}

/// A file among the seeds of the fuzz target.
fn seed(name: &str) -> Vec<u8> {
    std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds/gltf").join(name)).unwrap()
}

/// The sheet's vertex at a position, which may be off by the step of 12 bits over the sheet's
/// height of 1.5.
fn vertex(position: [f32; 3]) -> usize {
    let step = 1.5 / 4095.0;
    let near = |p: &[f64; 3]| (0..3).all(|k| (p[k] - f64::from(position[k])).abs() <= step);
    sheet().0.iter().position(near).unwrap_or_else(|| panic!("{position:?} is no vertex"))
}

/// Compares a file with the sheet: triangles, normals and texture coordinates.
fn check_sheet(name: &str) {
    let mesh = import_bytes("a.glb", &seed(name), Keep::All).unwrap().0;
    let attributes = mesh.attributes.as_ref().unwrap();
    let (positions, uvs) = sheet();
    let mut triangles = Vec::new();
    for (number, triangle) in mesh.triangles.iter().enumerate() {
        let vertices = triangle.map(|row| vertex(mesh.positions[row as usize]));
        for (vertex, row) in vertices.into_iter().zip(attributes.corners[number]) {
            let [x, _, z] = positions[vertex];
            let (normal, uv) = (attributes.normals[row as usize], attributes.uvs[row as usize]);
            // Normals of 8 bits with their sign, texture coordinates of 12.
            let far = |found: f32, value: f64, bits: i32| {
                (f64::from(found) - value).abs() > 2.0 / f64::from((1 << bits) - 1)
            };
            let wrong = (0..3).any(|k| far(normal[k], [x, 0.0, z][k], 7))
                || (0..2).any(|k| far(uv[k], uvs[vertex][k], 12));
            assert!(!wrong, "{name}: vertex {vertex} has {normal:?} {uv:?}");
        }
        let first = (0..3).min_by_key(|k| vertices[*k]).unwrap();
        triangles.push([0, 1, 2].map(|k| vertices[(first + k) % 3]));
    }
    triangles.sort();
    assert_eq!(triangles, sheet_triangles(), "{name}");
}

#[test]
fn draco_primitives_are_decoded() {
    check_sheet("draco.glb");
    check_sheet("draco-sequential.glb");
}

#[cfg(feature = "meshopt")]
#[test]
fn meshopt_views_are_decoded() {
    check_sheet("meshopt.glb");
    check_sheet("meshopt-filter.glb");
    // The name of the ratified extension, for the same streams.
    let renamed = replaced(&seed("meshopt.glb"), b"EXT_meshopt", b"KHR_meshopt");
    assert_eq!(
        import_bytes("a.glb", &renamed, Keep::All).unwrap(),
        import_bytes("a.glb", &seed("meshopt.glb"), Keep::All).unwrap()
    );
}

#[cfg(not(feature = "meshopt"))]
#[test]
fn a_build_without_the_decoder_names_the_extension_and_the_feature() {
    let error = import_bytes("a.glb", &seed("meshopt.glb"), Keep::None).unwrap_err().to_string();
    assert!(error.contains("BTH-I011") && error.contains("EXT_meshopt_compression"), "{error}");
    assert!(error.contains("cargo feature meshopt"), "{error}");
}

/// All occurrences of a pattern replaced by another of the same length.
fn replaced(bytes: &[u8], from: &[u8], to: &[u8]) -> Vec<u8> {
    assert_eq!(from.len(), to.len());
    let mut bytes = bytes.to_vec();
    for at in 0..bytes.len().saturating_sub(from.len()) {
        if bytes[at..].starts_with(from) {
            bytes[at..at + to.len()].copy_from_slice(to);
        }
    }
    bytes
}

/// The file of compressed views with a fallback buffer of this URI.
fn with_fallback(uri: &str) -> Vec<u8> {
    let bytes = seed("meshopt.glb");
    let json = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let mut document: serde_json::Value = serde_json::from_slice(&bytes[20..20 + json]).unwrap();
    document["buffers"][1]["uri"] = uri.into();
    super::gltf::glb(&document, &bytes[28 + json..])
}

#[test]
fn a_fallback_buffer_is_a_source_file_only_if_it_exists() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    std::fs::write(&path, with_fallback("fallback.bin")).unwrap();
    assert_eq!(bth_import::source_files(&path, bth_import::AlphaMode::None).unwrap(), [path.as_path()]);
    #[cfg(feature = "meshopt")]
    assert_eq!(import(&path, Keep::None, &Silent).unwrap().0.triangles.len(), 24);
    let fallback = folder.path().join("fallback.bin");
    std::fs::write(&fallback, [0; 624]).unwrap();
    assert_eq!(bth_import::source_files(&path, bth_import::AlphaMode::None).unwrap(), [path, fallback]);
}

#[cfg(not(feature = "meshopt"))]
#[test]
fn a_build_without_the_decoder_reads_the_fallback_buffer() {
    let zeros = format!("data:application/octet-stream;base64,{}", "AAAA".repeat(624 / 3));
    let mesh = import_bytes("a.glb", &with_fallback(&zeros), Keep::None).unwrap().0;
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (1, 24));
}

#[track_caller]
fn assert_edit_refused(name: &str, [from, to]: [&str; 2], place: &str, message: &str) {
    let bytes = replaced(&seed(name), from.as_bytes(), to.as_bytes());
    assert_ne!(bytes, seed(name), "{from} does not occur");
    let (code, found_place, found) = refused("a.glb", &bytes);
    assert!(matches!(code, "BTH-I014" | "BTH-I002"), "{code}");
    assert_eq!(found_place, place, "{found}");
    assert!(found.contains(message), "{found}");
}

#[cfg(feature = "meshopt")]
#[test]
fn refuses_meshopt_properties_that_do_not_follow_the_extension() {
    let view = "buffer view 0";
    let bad = |from_to, place, message| assert_edit_refused("meshopt.glb", from_to, place, message);
    bad(["\"TRIANGLES\"", "\"TRIANGLED\""], view, "found TRIANGLED");
    bad(["\"count\":72}", "\"count\":71}"], view, "that 3 divides, found 71");
    bad(["\"byteStride\":2", "\"byteStride\":3"], view, "byteStride of 2 or 4, found 3");
    bad(["\"byteStride\":12", "\"byteStride\":14"], "buffer view 1", "multiple of 4 up to 256, found 14");
    bad(
        ["\"byteLength\":41", "\"byteLength\":40"],
        view,
        "a stream of 41 bytes or more for 72 rows, found 40",
    );
    bad(["\"byteLength\":41", "\"byteLength\":99"], view, "expected a stream of meshoptimizer");
    let filtered =
        |from_to, message| assert_edit_refused("meshopt-filter.glb", from_to, "buffer view 2", message);
    filtered(["\"OCTAHEDRAL\"", "\"OCTAHEDRON\""], "found OCTAHEDRON");
    filtered(["\"OCTAHEDRAL\"", "\"QUATERNION\""], "byteStride of 8, found 4");
}

#[test]
fn refuses_draco_streams_and_properties_that_are_malformed() {
    let part = "mesh 0 primitive 0";
    assert_edit_refused("draco.glb", ["DRACO", "DRAKO"], part, "expected a stream of Draco");
    assert_edit_refused("draco.glb", ["\"POSITION\":0", "\"POSITION\":7"], part, "expected an attribute 7");
}

/// Any outcome but a panic is right for damaged streams.
#[test]
fn cuts_and_flipped_bits_of_compressed_streams_never_panic() {
    let mut random = bth_random::Rng::new(1);
    for name in ["draco.glb", "draco-sequential.glb", "meshopt.glb", "meshopt-filter.glb"] {
        let bytes = seed(name);
        let json = 20 + u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        for _ in 0..4000 {
            let mut damaged = bytes.clone();
            for _ in 0..=random.below(3) {
                let at = json + 8 + random.below((bytes.len() - json - 8) as u64) as usize;
                damaged[at] ^= 1 << random.below(8);
            }
            let _ = bth_import::import_bytes(Path::new("a.glb"), &damaged, Keep::All, &Silent);
        }
    }
}
