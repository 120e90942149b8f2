//! `bthc compile`: outputs, structures, options and reports.

use crate::support::{bthc, crossing, folder, sphere};
use bth::rays::Ray;

#[test]
fn writes_a_file_beside_the_model_that_verifies() {
    let folder = folder(&[("ball.obj", &sphere(12))]);
    let run = bthc(folder.path(), &["compile", "ball.obj"]).expect(0);
    assert!(run.stdout.contains("triangles") && run.stdout.contains("wrote ball.bth"), "{run:?}");
    assert_eq!(run.stderr, "", "no progress in a pipe");
    bthc(folder.path(), &["verify", "ball.bth"]).expect(0);
}

#[test]
fn json_holds_the_reports_of_all_stages() {
    let folder = folder(&[("ball.obj", &sphere(12))]);
    let compile = |more: &[&str]| {
        let all = [&["compile", "ball.obj", "-o", "out.bth", "--json"], more].concat();
        bthc(folder.path(), &all).expect(0).job()
    };
    // Where tetrahedra cannot pay no node is marked.
    let dear = compile(&["--set", "min-tet-triangles=64", "--set", "c-tet=1000"]);
    assert!(dear["report"]["marks"].is_null() && !dear["report"]["costs"].is_null(), "{dear:#}");

    let json = compile(&["--set", "min-tet-triangles=64", "--set", "c-tet=0.001"]);
    assert_eq!(json["output"], "out.bth");
    assert_eq!(json["report"]["mesh"]["triangles"], 4 * 12 * 11);
    for stage in ["mesh", "bvh", "marks", "costs", "tets", "collapse", "file", "seconds"] {
        assert!(!json["report"][stage].is_null(), "{stage} in {json:#}");
    }
    let length = std::fs::metadata(folder.path().join("out.bth")).unwrap().len();
    assert_eq!(json["report"]["file"]["bytes"], length);
}

#[test]
fn quiet_prints_nothing() {
    let folder = folder(&[("ball.obj", &sphere(8))]);
    let run = bthc(folder.path(), &["compile", "ball.obj", "--quiet"]).expect(0);
    assert_eq!((run.stdout.as_str(), run.stderr.as_str()), ("", ""));
}

#[test]
fn a_model_without_triangles_compiles_with_a_warning() {
    let scene = r#"{"asset": {"version": "2.0"}, "nodes": [{}], "scenes": [{"nodes": [0]}]}"#;
    let folder = folder(&[("points.obj", "v 0 0 0\nv 1 0 0\n"), ("scene.gltf", scene)]);
    for model in ["points.obj", "scene.gltf"] {
        for more in [&["--quiet"][..], &["--json"]] {
            let run = bthc(folder.path(), &[&["compile", model][..], more].concat()).expect(0);
            let warning = format!("{model} has no triangles, so no ray hits it");
            assert!(run.stderr.contains(&warning), "{run:?}");
            assert!(more == ["--quiet"] || run.job()["warnings"][0] == warning.as_str(), "{run:?}");
        }
    }
}

#[test]
fn reports_have_no_rows_of_zeros_and_at_most_100_columns() {
    let folder = folder(&[("ball.obj", &sphere(8))]);
    let args = ["compile", "ball.obj", "--free-directions", "auto"];
    let text = bthc(folder.path(), &args).expect(0).stdout;
    assert!(text.contains("free directions") && text.contains("total"), "{text}");
    for line in text.lines() {
        assert!(line.len() <= 100 && !line.ends_with(" 0") && !line.ends_with(" 0.000 s"), "{line}");
    }
}

#[test]
fn bytes_depend_on_neither_threads_nor_folder_nor_name() {
    let model = sphere(24);
    let first = folder(&[("ball.obj", &model)]);
    let second = folder(&[("other.obj", &model)]);
    for options in [["--structure", "bth"], ["--structure", "bvh"], ["--quality", "best"]] {
        let compile = |folder: &std::path::Path, name: &str, threads: &str| {
            let mut args =
                vec!["compile", name, "-o", "out.bth", "--threads", threads, "--set", "min-tet-triangles=64"];
            args.extend(options);
            bthc(folder, &args).expect(0);
            std::fs::read(folder.join("out.bth")).unwrap()
        };
        let one = compile(first.path(), "ball.obj", "1");
        assert!(one == compile(first.path(), "ball.obj", "2"), "threads, {options:?}");
        assert!(one == compile(second.path(), "other.obj", "2"), "folder, {options:?}");
    }
}

#[test]
fn structure_bvh_has_no_tet_leaves() {
    let folder = folder(&[("ball.obj", &sphere(24))]);
    let run = bthc(folder.path(), &["compile", "ball.obj", "--structure", "bvh", "--json"]).expect(0);
    let report = &run.job()["report"];
    assert_eq!(report["file"]["tet_leaves"], 0);
    assert!(report["marks"].is_null() && report["tets"].is_null());
}

#[test]
fn structure_tets_refuses_crossing_triangles_and_says_how_many() {
    let folder = folder(&[("crossing.obj", &crossing())]);
    let run = bthc(folder.path(), &["compile", "crossing.obj", "--structure", "tets", "--json"]).expect(3);
    assert!(run.stderr.contains("2 of its 3 triangles are in 1 bad contact"), "{run:?}");
    assert!(run.stderr.contains("hint"), "{run:?}");
    assert_eq!(run.json()["error"]["code"], "BTH-I080");
    assert!(!folder.path().join("crossing.bth").exists());
}

#[test]
fn geometry_is_left_out_on_request() {
    let folder = folder(&[("ball.obj", &sphere(8))]);
    bthc(folder.path(), &["compile", "ball.obj", "--no-geometry"]).expect(0);
    let json = bthc(folder.path(), &["info", "ball.bth", "--json"]).expect(0).json();
    assert_eq!(json["objects"][0]["geometry"], false);
    bthc(folder.path(), &["verify", "ball.bth"]).expect(0);
}

#[test]
fn degenerate_triangles_are_counted_and_keep_their_ids() {
    let model = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nf 1 2 4\nf 1 2 3\n";
    let folder = folder(&[("flat.obj", model)]);
    let json = bthc(folder.path(), &["compile", "flat.obj", "--json"]).expect(0).job();
    assert_eq!(json["report"]["mesh"]["degenerate"], 1);
    let scene = bth::open(folder.path().join("flat.bth")).unwrap();
    let ray = bth::rays::Ray {
        origin: [0.2, 0.2, 1.0],
        tmin: 0.0,
        direction: [0.0, 0.0, -1.0],
        tmax: f32::INFINITY,
    };
    assert_eq!(scene.nearest(&ray).map(|hit| hit.primitive.triangle), Some(1));
}

#[test]
fn the_help_lists_options_under_their_headings() {
    let folder = folder(&[]);
    let help = bthc(folder.path(), &["compile", "--help"]).expect(0).stdout;
    let mut heading = "";
    let mut headings = std::collections::BTreeMap::new();
    for line in help.lines() {
        if let Some(name) = line.strip_suffix(':').filter(|name| !name.starts_with(' ')) {
            heading = name;
        } else if line.trim_start().starts_with('-')
            && let Some(option) = line.split_whitespace().find(|word| word.starts_with("--"))
        {
            headings.entry(option).or_insert(heading);
        }
    }
    for (option, heading) in [
        ("--quality", "Options"),
        ("--threads", "Options"),
        ("--json", "Options"),
        ("--materials", "What the file keeps"),
        ("--max-error", "Smaller files"),
        ("--deformable", "Objects that deform"),
        ("--flatten", "Scenes from glTF, FBX and 3MF"),
        ("--strict", "Scenes from glTF, FBX and 3MF"),
        ("--depfile", "Many models and build systems"),
        ("--in-cache", "Cache"),
    ] {
        assert_eq!(headings.get(option), Some(&heading), "{option}");
    }
}

#[test]
fn concave_polygons_are_covered_exactly_where_that_is_asked_for() {
    // A frame of 4 by 4 around a hole of 2 by 2, whose outline runs to the hole and back.
    let frame =
        "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 1 3 0\nv 3 3 0\nv 3 1 0\nf 1 2 3 4 1 5 6 7 8 5\n";
    let folder = folder(&[("frame.obj", frame)]);
    // Through which of sixteen squares of one unit rays along z find a surface.
    let covered = |polygons: &str, concave: u64, warnings: usize| {
        let all =
            ["compile", "frame.obj", "-o", "out.bth", "--structure", "bvh", "--json", "--polygons", polygons];
        let run = bthc(folder.path(), &all).expect(0);
        let mesh = &run.job()["report"]["mesh"];
        assert_eq!((&mesh["concave"], &mesh["triangles"]), (&concave.into(), &8.into()), "{mesh:#}");
        assert_eq!(run.stderr.lines().count(), warnings, "{run:?}");
        let scene = bth::open(folder.path().join("out.bth")).unwrap();
        let ray = |k: u8| Ray::new([f32::from(k % 4) + 0.4, f32::from(k / 4) + 0.3, 1.0], [0.0, 0.0, -1.0]);
        (0..16).filter(|k| scene.any(&ray(*k))).fold(0u16, |bits, k| bits | 1 << k)
    };
    let hole = 1 << 5 | 1 << 6 | 1 << 9 | 1 << 10;
    assert_eq!(covered("ears", 1, 0), !hole);
    assert_ne!(covered("fans", 1, 1) & hole, 0);
}

#[test]
fn the_cube_of_the_examples_is_as_it_is_compiled() {
    let sources = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../src/bth/doc");
    let folder = folder(&[("cube.obj", &std::fs::read_to_string(sources.join("cube.obj")).unwrap())]);
    bthc(folder.path(), &["compile", "cube.obj", "--no-cache"]).expect(0);
    let [compiled, kept] = [folder.path(), &sources].map(|at| std::fs::read(at.join("cube.bth")).unwrap());
    assert!(compiled == kept, "compile src/bth/doc/cube.obj again");
}
