//! `bthc info`, `verify`, `marks` and `diff`: what they report about files and models.

use crate::support::{bthc, crossing, folder, obj, run, sphere, sphere_mesh};
use bth_format::layout::{FreeBins, kind};
use bth_scenes::knot::torus_knot;
use bth_tests::conformance::{Editor, Seal};
use std::path::Path;

#[test]
fn info_shows_sections_and_provenance_without_paths() {
    let folder = folder(&[("ball.obj", &sphere(12))]);
    bthc(folder.path(), &["compile", "ball.obj"]).expect(0);
    let json = bthc(folder.path(), &["info", "ball.bth", "--json"]).expect(0).json();
    assert_eq!(json["objects"][0]["triangles"], 4 * 12 * 11);
    assert!(json["sections"].as_array().is_some_and(|s| s.len() > 3), "{json:#}");
    let source = blake3_of(folder.path().join("ball.obj"));
    assert_eq!(json["provenance"]["source"]["blake3"], source);
    assert!(!json.to_string().contains("ball"), "{json:#}");
    let text = bthc(folder.path(), &["info", "ball.bth", "--cpu"]).expect(0).stdout;
    assert!(text.contains("LINES") && text.contains("architecture"), "{text}");
    assert!(!text.contains('{') && !text.contains("tet leaves") && text.contains("made by"), "{text}");
    assert!(text.lines().all(|line| line.len() <= 100), "{text}");
}

#[test]
fn info_of_a_model_shows_its_box_names_and_materials() {
    let text =
        "o roof\nusemtl tiles\nv 1 2 3\nv 4 2 3\nv 1 6 3\nf 1 2 3\no wall\nv 1 2 -8\nf 1 2 4\nf 1 4 3\n";
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
               element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let gltf = r#"{"asset": {"version": "2.0"}, "nodes": [{"name": "empty"}], "scenes": [{"nodes": [0]}]}"#;
    let folder = folder(&[("house.obj", text), ("flat.ply", ply), ("scene.gltf", gltf)]);
    let json = bthc(folder.path(), &["info", "house.obj", "--json"]).expect(0).json();
    assert_eq!((&json["model"]["triangles"], &json["model"]["boundary_edges"]), (&3.into(), &3.into()));
    assert_eq!((&json["lower"], &json["upper"]), (&[1.0, 2.0, -8.0].into(), &[4.0, 6.0, 3.0].into()));
    assert_eq!(json["groups"][1], serde_json::json!({"name": "wall", "triangles": 2, "material": 0}));
    assert_eq!(json["materials"][0], "tiles");
    let text = bthc(folder.path(), &["info", "house.obj"]).expect(0).stdout;
    assert!(text.contains("1 2 -8") && text.contains("roof") && text.contains("tiles"), "{text}");
    assert!(bthc(folder.path(), &["info", "flat.ply"]).expect(0).stdout.contains("1 1 0"));
    let json = bthc(folder.path(), &["info", "scene.gltf", "--json"]).expect(0).json();
    assert_eq!((&json["import"]["nodes"], &json["model"]["triangles"]), (&1.into(), &0.into()));
    assert!(bthc(folder.path(), &["info", "none.ply"]).expect(4).stderr.contains("BTH-O001"));
}

fn blake3_of(path: std::path::PathBuf) -> String {
    blake3::hash(&std::fs::read(path).unwrap()).to_hex().to_string()
}

#[test]
fn verify_finds_a_damaged_byte() {
    let folder = folder(&[("ball.obj", &sphere(12))]);
    bthc(folder.path(), &["compile", "ball.obj"]).expect(0);
    let path = folder.path().join("ball.bth");
    let mut bytes = std::fs::read(&path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(&path, bytes).unwrap();
    let run = bthc(folder.path(), &["verify", "ball.bth"]).expect(1);
    assert!(run.stderr.contains("BTH-F"), "{run:?}");
    let json = bthc(folder.path(), &["verify", "ball.bth", "--json"]).expect(1).json();
    assert_eq!(json["verified"], false);
    assert!(json["errors"][0]["code"].as_str().is_some_and(|c| c.starts_with("BTH-F")), "{json:#}");
}

#[test]
fn verify_deep_finds_what_a_file_knows_wrongly() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("knot.ply");
    bth_scenes::write::file(&torus_knot(3000), &path).unwrap();
    bthc(folder.path(), &["compile", "knot.ply", "--free-directions", "all"]).expect(0);
    let right =
        bthc(folder.path(), &["verify", "--deep", "--rays", "2000", "knot.bth", "--json"]).expect(0).json();
    assert_eq!((&right["verified"], &right["deep"]["wrong"]), (&true.into(), &0.into()));
    let count = |name: &str| right["deep"][name].as_u64().unwrap();
    assert!(count("rays") > 1900 && count("hits") > 600 && count("known_directions") > 200, "{right:#}");

    // All bins of the triangles that the geometric check passes over are called free.
    let path = folder.path().join("knot.bth");
    let mut editor = Editor::new(&std::fs::read(&path).unwrap());
    let triangles = bthc(folder.path(), &["info", "knot.bth", "--json"]).expect(0).json();
    let triangles = triangles["objects"][0]["triangles"].as_u64().unwrap() as usize;
    let step = triangles.div_ceil(64);
    let bins = FreeBins::ALL.to_le_bytes();
    for triangle in (0..triangles).filter(|triangle| !triangle.is_multiple_of(step)) {
        let at = editor.section_at(kind::FREE_DIRECTIONS) + 20 * triangle + 4;
        editor.put(at, &bins);
    }
    std::fs::write(&path, editor.seal(Seal::Sections)).unwrap();
    bthc(folder.path(), &["verify", "knot.bth"]).expect(0);
    let run = bthc(folder.path(), &["verify", "--deep", "--rays", "2000", "knot.bth"]).expect(1);
    // All ways of tracing use what the file knows, so answers are wrong in the same way (V001), and
    // do not differ (V002).
    assert!(run.stderr.contains("BTH-V001") && run.stderr.contains("BTH-F209"), "{run:?}");
    assert!(!run.stderr.contains("BTH-V002"), "{run:?}");
    assert!(run.stdout.is_empty(), "{run:?}");
    let wrong =
        bthc(folder.path(), &["verify", "--deep", "--rays", "2000", "knot.bth", "--json"]).expect(1).json();
    assert_eq!(wrong["verified"], false);
    assert!(wrong["deep"]["wrong"].as_u64().is_some_and(|wrong| wrong > 100), "{wrong:#}");
}

/// Rays must be sampled from the triangles that are traced: the triangles of the poses, which here
/// are far apart.
#[test]
fn verify_deep_traces_objects_that_deform_in_their_poses() {
    let (positions, faces) = sphere_mesh(8);
    let moved: Vec<_> = positions.iter().map(|[x, y, z]| [x + 100.0, 3.0 * y, *z]).collect();
    let manifest = r#"version = 1
frames = { first = 0, last = 1, rate = 1 }
objects = [{ name = "o", sequence = "f_#.obj" }]
nodes = [{ name = "o", object = "o" }]
"#;
    let folder = folder(&[
        ("f_0.obj", &obj(&positions, &faces)),
        ("f_1.obj", &obj(&moved, &faces)),
        ("s.manifest", manifest),
    ]);
    bthc(folder.path(), &["compile", "s.manifest"]).expect(0);
    let deep =
        bthc(folder.path(), &["verify", "--deep", "--rays", "900", "s.bth", "--json"]).expect(0).json();
    let count = |name: &str| deep["deep"][name].as_u64().unwrap();
    assert!(count("hits") > 250 && count("rays") >= 900 && count("wrong") == 0, "{deep:#}");
}

/// Objects without triangles, without instances and with all that a file may have.
#[test]
fn verify_deep_accepts_every_valid_file() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../format-spec/conformance/valid");
    let mut files = 0;
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        // No query reads these yet.
        if path.ends_with("exact-positions.bth") {
            continue;
        }
        bthc(&folder, &["verify", "--deep", "--rays", "60", path.to_str().unwrap()]).expect(0);
        files += 1;
    }
    assert!(files > 20, "{files}");
}

#[test]
fn verify_deep_says_what_reaches_too_far_for_an_instance() {
    let far = f32::MAX;
    let model = obj(&[[far, far, far], [-far, 0.0, far], [0.0, -far, -far]], &[[0, 1, 2]]);
    let folder = folder(&[("far.obj", &model)]);
    bthc(folder.path(), &["compile", "far.obj"]).expect(0);
    let run = bthc(folder.path(), &["verify", "--deep", "far.bth"]).expect(0);
    assert!(run.stderr.contains("object 0 is not traced") && run.stderr.contains("BTH-S002"), "{run:?}");
}

#[test]
fn marks_lists_crossing_triangles() {
    let folder = folder(&[("crossing.obj", &crossing())]);
    let json = bthc(folder.path(), &["marks", "crossing.obj", "--json", "--tris", "x.tris"]).expect(0).json();
    assert_eq!(json["bad_triangles"], serde_json::json!([0, 1]));
    assert_eq!(json["bad_pairs"], 1);
    let tris = std::fs::read(folder.path().join("x.tris")).unwrap();
    assert_eq!((&tris[..4], tris.len()), (&b"TRIS"[..], 16 + 3 * 36));
    let text = bthc(folder.path(), &["marks", "crossing.obj"]).expect(0).stdout;
    assert_eq!(text.lines().last(), Some("2 of 3 triangles in 1 bad contacts"));
}

#[test]
fn info_lists_groups_and_materials() {
    let faces: String = (0..45).map(|i| format!("g part {i}\nf 1 2 3\n")).collect();
    let model =
        format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red \u{7}paint\no body\nf 1 2 3\nf 3 2 1\n{faces}");
    let folder = folder(&[("car.obj", &model)]);
    bthc(folder.path(), &["compile", "car.obj", "--names"]).expect(0);
    bthc(folder.path(), &["verify", "car.bth"]).expect(0);
    let json = bthc(folder.path(), &["info", "car.bth", "--json"]).expect(0).json();
    let object = &json["objects"][0];
    assert_eq!(object["materials"], serde_json::json!(["red \u{7}paint"]));
    assert_eq!(object["groups"].as_array().map(Vec::len), Some(46));
    assert_eq!(object["groups"][0], serde_json::json!({"name": "body", "triangles": 2, "material": 0}));
    assert_eq!(json["provenance"]["options"]["names"], true);
    let text = bthc(folder.path(), &["info", "car.bth"]).expect(0).stdout;
    let row = text.lines().find(|line| line.contains("body")).expect("a row of the group");
    assert_eq!(row.split_whitespace().collect::<Vec<_>>(), ["0", "body", "red", "\\u{7}paint", "2"]);
    assert!(text.contains("6 more, see --json") && !text.contains('\u{7}'), "{text}");

    bthc(folder.path(), &["compile", "car.obj"]).expect(0);
    let json = bthc(folder.path(), &["info", "car.bth", "--json"]).expect(0).json();
    assert_eq!(
        (&json["objects"][0]["groups"], &json["objects"][0]["name"]),
        (&serde_json::json!([]), &"".into())
    );
}

#[test]
fn verify_tells_of_which_objects_the_file_keeps_the_source() {
    let objects = ["kept", "dropped"].map(|name| format!("{{ name = \"{name}\", file = \"{name}.bth\" }}"));
    let nodes = ["kept", "dropped"].map(|name| format!("{{ name = \"{name}\", object = \"{name}\" }}"));
    let manifest =
        format!("version = 1\nobjects = [{}]\nnodes = [{}]\n", objects.join(", "), nodes.join(", "));
    let folder = folder(&[("a.obj", &sphere(6)), ("both.manifest", &manifest)]);
    let path = folder.path();
    bthc(path, &["compile", "a.obj", "-o", "kept.bth"]).expect(0);
    bthc(path, &["compile", "a.obj", "-o", "dropped.bth", "--no-geometry"]).expect(0);
    bthc(path, &["compile", "both.manifest"]).expect(0);
    for (name, last) in [
        ("kept.bth", "verified; compared with the source's triangles\n"),
        ("dropped.bth", "verified; the file keeps no source to compare with\n"),
        (
            "both.bth",
            "verified; 1 of 2 objects compared with the source's triangles; the file keeps no others\n",
        ),
    ] {
        let text = bthc(path, &["verify", name]).expect(0).stdout;
        assert!(text.ends_with(last), "{text}");
    }
}

#[test]
fn info_tells_objects_apart_with_the_bytes_of_each() {
    let manifest = "version = 1\n\
        objects = [{ name = \"ball\", model = \"ball.obj\" }, { name = \"flat\", model = \"flat.obj\" }]\n\
        nodes = [{ name = \"a\", object = \"ball\" }, { name = \"b\", object = \"flat\" }]\n";
    let flat = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let folder = folder(&[("ball.obj", &sphere(12)), ("flat.obj", flat), ("two.manifest", manifest)]);
    bthc(folder.path(), &["compile", "two.manifest", "--names"]).expect(0);
    let json = bthc(folder.path(), &["info", "two.bth", "--json"]).expect(0).json();
    let text = bthc(folder.path(), &["info", "two.bth"]).expect(0).stdout;
    let values = |name: &str| -> Vec<String> {
        text.lines().filter_map(|line| Some(line.strip_prefix(name)?.trim().replace(',', ""))).collect()
    };
    assert_eq!(values("object  "), ["0 ball", "1 flat"], "{text}");
    let numbers =
        |name: &str| values(name).iter().map(|text| text.parse::<f64>().unwrap()).collect::<Vec<_>>();
    let each = numbers("bytes a triangle").into_iter().zip(numbers("triangles  "));
    let total: f64 = each.map(|(bytes, triangles)| bytes * triangles).sum();
    // The text has one digit behind the point.
    let rounding = 0.05 * (4 * 12 * 11 + 1) as f64;
    assert!((total - json["resident_bytes"].as_f64().unwrap()).abs() <= rounding, "{total} {text}");
}

#[test]
fn completions_and_manual_are_printed() {
    let folder = folder(&[]);
    let programs = [
        ("bthc", "completions", "man"),
        ("bth-play", "--completions", "--man"),
        ("bth-scenes", "completions", "man"),
    ];
    for (program, completions, man) in programs {
        for shell in ["bash", "zsh", "fish"] {
            let printed = run(program, folder.path(), &[completions, shell]).expect(0);
            assert!(printed.stdout.contains(program), "{program} {shell}: {printed:?}");
        }
        let page = run(program, folder.path(), &[man]).expect(0).stdout;
        assert!(page.contains(&format!(".TH {program}")), "{program}: {page}");
        assert!(!page.contains("(1)"), "{program}: the page names others, which there are not: {page}");
    }
}
