//! 3MF: what becomes of objects, components, items, units, materials, colours and other parts, what
//! is skipped or refused, and packages that are damaged at random.

use super::*;
use bth_import::gltf::scene::{self, ImportOptions};
use bth_random::Rng;
use bth_scene::{Manifest, Transform};
use std::io::Write;

const RELATIONSHIPS: &str = r#"<?xml version="1.0"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Type="http://schemas.openxmlformats.org/package/2006/relationships/metadata/thumbnail" Target="/t.png" Id="a"/>
<Relationship Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel" Target="/3D/3dmodel.model" Id="b"/>
</Relationships>"#;
/// A plate of two materials and a plate of colours, an assembly of these, and an object of another
/// part. A beam lattice and a texture are skipped.
const ROOT: &str = include_str!("../../../../fuzz/seeds/threemf/plates.model");
const OTHER: &str = r#"<model xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" unit="inch"><resources>
<object id="4" name="Far"><mesh>
<vertices><vertex x="6000000000.25" y="0" z="0"/><vertex x="6000000001.25" y="0" z="0"/><vertex x="6000000000.25" y="1" z="0"/></vertices>
<triangles><triangle v1="0" v2="1" v3="2"/></triangles></mesh></object>
</resources><build/></model>"#;

/// A package of parts, each deflated.
fn package(parts: &[(&str, &[u8])]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut archive = rawzip::ZipArchiveWriter::new(&mut bytes);
    for (name, text) in parts {
        let method = rawzip::CompressionMethod::DEFLATE;
        let (mut entry, config) = archive.new_file(*name).compression_method(method).start().unwrap();
        let encoder = flate2::write::DeflateEncoder::new(&mut entry, flate2::Compression::best());
        let mut writer = config.wrap(encoder);
        writer.write_all(text).unwrap();
        let (encoder, descriptor) = writer.finish().unwrap();
        encoder.finish().unwrap();
        entry.finish(descriptor).unwrap();
    }
    archive.finish().unwrap();
    bytes
}

fn of(root: &str) -> Vec<u8> {
    let parts = [("_rels/.rels", RELATIONSHIPS), ("3D/3dmodel.model", root), ("3d/other.MODEL", OTHER)];
    package(&parts.map(|(name, text)| (name, text.as_bytes())))
}

fn manifest(bytes: &[u8], monitor: &dyn Monitor) -> (Manifest, scene::ImportReport) {
    scene::import_bytes(Path::new("a.3mf"), bytes, "a.3mf", &ImportOptions::default(), monitor).unwrap()
}

#[test]
fn a_scene_has_what_is_built_and_its_components() {
    let listener = Listener::default();
    let (manifest, report) = manifest(&of(ROOT), &listener);
    assert_eq!(report.space.as_deref(), Some("units of 0.0254 m, z up; read as metres with y up"));
    let parents: Vec<_> = manifest.nodes.iter().map(|node| (node.name, node.parent)).collect();
    let expected = [
        ("root", None),
        ("Both", Some(0)),
        ("Plate <A>", Some(1)),
        ("object 5", Some(1)),
        ("Both 2", Some(0)),
        ("Plate <A> 2", Some(4)),
        ("object 5 2", Some(4)),
        ("Far", Some(0)),
        ("Far/mesh", Some(7)),
    ];
    assert_eq!(parents, expected);
    let matrix = |node: usize| match manifest.nodes.get(node).transform {
        Transform::Matrix(rows) => rows,
        Transform::Parts { .. } => panic!("expected a matrix"),
    };
    let unit = 0.0254;
    assert_eq!(matrix(0), [[unit, 0., 0., 0.], [0., 0., unit, 0.], [0., -unit, 0., 0.]]);
    assert_eq!(matrix(3), [[0., -1., 0., 10.], [1., 0., 0., 0.], [0., 0., 1., 0.]]);
    // Positions in f32 are relative to the middle.
    let Transform::Parts { translation, .. } = manifest.nodes.get(8).transform else { panic!() };
    assert!((translation[0] - 6e9).abs() < 1e3);
    assert!(listener.heard(
        "elements \"beamlattice\" of beamlattice/2017/02 are left out, the first at 3D/3dmodel.model line 19"
    ));
    assert!(listener.heard("elements \"texture2dgroup\" of material/2015/02 are left out"));
}

#[test]
fn materials_and_colors_are_those_of_triangles() {
    let (mesh, report) = import_with("a.3mf", &of(ROOT), everything(), &Silent).unwrap();
    assert_eq!((report.format.as_str(), mesh.triangles.len()), ("3mf", 9));
    let groups = mesh.groups.unwrap();
    assert_eq!(groups.materials, ["Red", "Glass"]);
    let materials = mesh.materials.unwrap();
    assert_eq!(materials.parameters[0].base_color, [1.0, 0.0, 0.0, 1.0]);
    assert_eq!(materials.parameters[1].base_color, [1.0, 1.0, 1.0, 128.0 / 255.0]);
    let color = |row: u32| materials.colors[row as usize];
    let (white, green) = ([65535; 4], [0, 65535, 0, 65535]);
    let colored: Vec<_> = materials.color_corners.iter().map(|corners| corners.map(color)).collect();
    assert_eq!(colored.iter().filter(|corners| **corners == [white, green, green]).count(), 2);
    assert_eq!(colored.iter().filter(|corners| **corners == [white; 3]).count(), 7);
}

#[test]
fn what_is_malformed_is_refused_with_its_place() {
    let root = "3D/3dmodel.model";
    for [from, to, code, place, message] in [
        ["unit=\"inch\"", "unit=\"ell\"", "BTH-I002", "line 2", "micron, millimeter"],
        ["requiredextensions=\"p b\"", "requiredextensions=\"q\"", "BTH-I006", "line 2", "found q"],
        ["v3=\"3\" p1", "v3=\"4\" p1", "BTH-I005", "line 14", "below 4, found 4"],
        ["v3=\"3\" p1=\"1\"", "p1=\"1\"", "BTH-I002", "line 14", "v1, v2 or v3"],
        ["v3=\"3\" p1=\"1\"", "v3=\"3\" p1=\"2\"", "BTH-I005", "line 14", "below 2 of group 1, found 2"],
        ["pid=\"2\" p1", "pid=\"8\" p1", "BTH-I005", "line 18", "found 8"],
        [
            "y=\"1\" z=\"0\"/></vertices>",
            "y=\"l\" z=\"0\"/></vertices>",
            "BTH-I002",
            "line 13",
            "found \"l\"",
        ],
        ["#FF0000", "red", "BTH-I002", "line 9", "#FF8000"],
        ["2 0 0 5\"", "2 0 0\"", "BTH-I002", "line 26", "twelve"],
        ["<object id=\"5\">", "<object id=\"4\">", "BTH-I002", "line 16", "new id, found 4"],
        ["m:colorgroup id=\"2\"", "m:colorgroup id=\"1\"", "BTH-I002", "line 10", "new id, found 1"],
        ["<item objectid=\"6\"/>", "<item objectid=\"9\"/>", "BTH-I005", "object 9", "found none"],
        ["<component objectid=\"4\"/>", "<component objectid=\"7\"/>", "BTH-I012", "object", "each other"],
        ["/3D/Other", "/3D/No", "BTH-I002", "3D/No.model", "found none"],
        ["</build>", "</item>", "BTH-I002", "line 26", "XML"],
        ["</build>\n</model>", "", "BTH-I003", "line 27", "end of an element"],
        ["<build>", "<!DOCTYPE a><build>", "BTH-I002", "line 26", "document type"],
        ["x=\"1\" y=\"0\"", "x=\"nan\" y=\"0\"", "BTH-I004", "", "finite"],
    ] {
        let edited = ROOT.replace(from, to);
        assert_ne!(edited, ROOT, "{from}");
        let found = refused("a.3mf", &of(&edited));
        assert_eq!(found.0, code, "{from}: {found:?}");
        assert!(found.1.contains(place) && found.2.contains(message), "{from}: {found:?}");
    }
    let nested = ROOT.replace("<build>", &format!("{}<build>", "<a>".repeat(300)));
    assert!(refused("a.3mf", &of(&nested)).2.contains("256 elements"));
    let pair = |text: &[u8]| package(&[("_rels/.rels", RELATIONSHIPS.as_bytes()), (root, text)]);
    for (bytes, code, place, message) in [
        (pair(b"%3McF and more"), "BTH-I006", root, "not encrypted"),
        (pair(b"<a/>"), "BTH-I002", root, "element model"),
        (pair(b"\xFF\xFE<\0"), "BTH-I006", root, "UTF-16"),
        (pair(&vec![b' '; 40 << 20]), "BTH-I002", root, "256 times"),
        (package(&[(root, ROOT.as_bytes())]), "BTH-I002", "_rels/.rels", "found none"),
        (package(&[("_rels/.rels", b"<a/>")]), "BTH-I002", "_rels/.rels", "relationship"),
        (b"PK\x03\x04".to_vec(), "BTH-I002", "file", "ZIP"),
    ] {
        let found = refused("a.3mf", &bytes);
        assert_eq!((found.0, found.1.as_str()), (code, place), "{}", found.2);
        assert!(found.2.contains(message), "{}", found.2);
    }
}

/// Objects that hold two of the one before, 25 levels: more nodes than a scene may have.
#[test]
fn assemblies_without_bounds_are_refused() {
    let level = |id: u32| {
        let below = format!("<component objectid=\"{}\"/>", id - 1).repeat(2);
        format!("<object id=\"{id}\"><components>{below}</components></object>")
    };
    let levels: String = (8..33).map(level).collect();
    let text = ROOT.replace("</resources>", &format!("{levels}</resources>"));
    let text = text.replace("<item objectid=\"6\"/>", "<item objectid=\"32\"/>");
    let error = import_bytes("a.3mf", &of(&text), Keep::None).unwrap_err();
    assert!(matches!(error, Error::Limit { code: "BTH-L050", .. }), "{error}");
}

/// Damaged parts and packages are refused or give scenes; nothing panics.
#[test]
fn damaged_packages_do_not_panic() {
    const WORDS: [&str; 8] = ["0", "-1", "4294967296", "1e39", "nan", "\"", "<", "/>"];
    let mut read = 0;
    for seed in 0..300 {
        let mut rng = Rng::new(seed);
        let mut text = ROOT.to_owned();
        for _ in 0..1 + rng.below(3) {
            let at = rng.below(text.len() as u64) as usize;
            let end = (at + rng.below(20) as usize).min(text.len());
            text.replace_range(at..end, WORDS[rng.below(8) as usize]);
        }
        let mut bytes = of(if seed % 3 == 0 { ROOT } else { &text });
        if seed % 3 == 0 {
            let at = rng.below(bytes.len() as u64) as usize;
            bytes[at] ^= 1 << rng.below(8);
        }
        let path = Path::new("a.3mf");
        let options = ImportOptions::default();
        if let Ok((manifest, _)) = scene::import_bytes(path, &bytes, "a.3mf", &options, &Silent) {
            read += 1;
            bth_scene::parse(&manifest.to_toml(), Path::new("a.manifest")).unwrap();
        }
        let _ = bth_import::import_bytes(path, &bytes, everything(), &Silent);
    }
    assert!(read > 15, "{read} of 300 were read");
}
