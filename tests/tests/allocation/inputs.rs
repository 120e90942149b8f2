//! No allocation is larger than the size of the input justifies, whatever sizes the input declares.

use crate::measure::largest;
use bth_compile::Silent;
use bth_import::{Keep, import_bytes};
use bth_tests::conformance::{Editor, Seal, valid};
use std::path::Path;

#[test]
fn opening_a_damaged_file_allocates_no_more_than_a_few_times_its_bytes() {
    for case in valid() {
        for at in (0..case.bytes.len()).step_by(4) {
            for word in [u32::MAX, 1 << 30, 1 << 24] {
                let mut editor = Editor::new(&case.bytes);
                editor.put(at, &word.to_le_bytes());
                let bytes = editor.seal(Seal::Sections);
                let most = largest(|| {
                    if let Ok(file) = bth_format::File::from_bytes(&bytes) {
                        let _ = bth_format::verify::verify(&file);
                    }
                    let _ = bth::from_bytes(&bytes);
                });
                assert!(most <= 4 * bytes.len() + 4096, "{} with {word:#x} at {at}: {most} bytes", case.name);
            }
        }
    }
}

/// Sources of few bytes that announce much.
fn liars() -> Vec<(&'static str, Vec<u8>)> {
    let text = |s: &str| s.as_bytes().to_vec();
    let ply = |format: &str, count: &str, list: &str| {
        text(&format!(
            "ply\nformat {format} 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\n\
             element face {count}\nproperty list {list} int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n"
        ))
    };
    let stl = |count: u32| [&[b' '; 80][..], &count.to_le_bytes(), &[0; 50]].concat();
    let gltf = |count: &str, length: &str| {
        text(&format!(
            r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
            "buffers":[{{"byteLength":{length},"uri":"data:application/octet-stream;base64,AAAAAAAAAAA="}}],
            "bufferViews":[{{"buffer":0,"byteLength":{length}}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":{count},"type":"VEC3"}},
            {{"componentType":5125,"count":{count},"type":"SCALAR"}}]}}"#
        ))
    };
    // A compressed view, a view of zeros and a Draco stream of eight bytes.
    let compressed = |count: &str, view: &str, primitive: &str| {
        text(&format!(
            r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"extensions":{{{primitive}}}}}]}}],
            "buffers":[{{"byteLength":8,"uri":"data:application/octet-stream;base64,oQAAAAAAAAA="}},{{"byteLength":{count}}}],
            "bufferViews":[{{"buffer":1,"byteLength":{count},"extensions":{{{view}}}}},{{"buffer":0,"byteLength":8}}],
            "accessors":[{{"componentType":5126,"count":{count},"type":"VEC3"{}}}]}}"#,
            if view.is_empty() { "" } else { r#","bufferView":0"# }
        ))
    };
    let meshopt = |count: &str, mode: &str, stride: u32| {
        let properties =
            format!(r#""buffer":0,"byteLength":8,"byteStride":{stride},"count":{count},"mode":"{mode}""#);
        compressed(count, &format!(r#""EXT_meshopt_compression":{{{properties}}}"#), "")
    };
    let mut liars = vec![
        ("a.off", text("OFF\n4000000000 4000000000 0\n0 0 0\n")),
        ("b.off", text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4000000000 0 1 2\n")),
        ("a.obj", text("v 0 0 0\nf 4000000000 1 1\nf -4000000000 1 1\n")),
        ("a.stl", stl(u32::MAX)),
        ("b.stl", stl(1 << 26)),
    ];
    for count in ["4294967295", "1000000000", "18446744073709551615"] {
        for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
            liars.push(("a.ply", ply(format, count, "uchar")));
            liars.push(("b.ply", ply(format, "3", "uint")));
        }
        liars.push(("a.gltf", gltf(count, "8")));
        liars.push(("b.gltf", gltf(count, count)));
        liars.push(("c.gltf", compressed(count, "", "")));
        liars.push((
            "d.gltf",
            compressed(
                count,
                "",
                r#""KHR_draco_mesh_compression":{"bufferView":1,"attributes":{"POSITION":0}}"#,
            ),
        ));
        liars.push(("e.gltf", meshopt(count, "ATTRIBUTES", 12)));
        liars.push(("f.gltf", meshopt(count, "ATTRIBUTES", 256)));
        liars.push(("g.gltf", meshopt(count, "TRIANGLES", 4)));
        liars.push(("h.gltf", meshopt(count, "INDICES", 2)));
    }
    liars
}

/// A scene may have many millions of nodes, so no list of them has many bytes for each.
#[test]
fn nodes_of_a_manifest_take_few_bytes() {
    const NODES: usize = 50_000;
    let node =
        |i: usize| format!("[[nodes]]\nname = \"n{i}\"\nobject = \"a\"\ntranslation = [{i}, 0.5, 1]\n");
    let objects = "version = 1\n[[objects]]\nname = \"a\"\nmodel = \"a.ply\"\n".to_owned();
    let text = objects + &(0..NODES).map(node).collect::<String>();
    let most = largest(|| {
        let manifest = bth_scene::parse(&text, Path::new("a.manifest")).expect("a manifest");
        assert_eq!(manifest.nodes.get(NODES - 1).object, Some(0));
    });
    assert!(most <= 64 * NODES, "{most} bytes for {NODES} nodes");
}

#[test]
fn sources_that_announce_more_than_they_hold_allocate_little() {
    for (name, bytes) in liars() {
        let most = largest(|| drop(import_bytes(Path::new(name), &bytes, Keep::All, &Silent)));
        let shown = String::from_utf8_lossy(&bytes[..bytes.len().min(120)]).into_owned();
        assert!(most <= 1 << 20, "{name}: {most} bytes for {} of input: {shown}", bytes.len());
    }
}
