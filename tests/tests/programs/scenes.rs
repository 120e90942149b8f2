//! Scenes: import, compilation, sequences of frames and animations.

use crate::support::{Run, command, data, folder, run_with, sphere};
use std::path::Path;

const QUAD: &str = "v -3 -1 -3\nv 3 -1 -3\nv 3 -1 3\nv -3 -1 3\nf 4 3 2 1\n";
const SCENE: &str = r#"version = 1
frames = { last = 5, rate = 5 }
camera = "eye"
objects = [{ name = "ball", model = "models/ball.obj" }, { name = "quad", model = "models/quad.obj" }]
nodes = [
    { name = "floor", object = "quad" }, { name = "pivot" },
    { name = "ball", object = "ball", parent = "pivot", translation = [1, 0, 0], scale = [-0.7, 0.7, 0.7] },
    { name = "eye", look = { from = [0, 3, 6], to = [0, 0, 0] } }, { name = "lamp", translation = [0, 5, 0] },
]
cameras = [{ name = "eye", node = "eye", fov = 45 }, { name = "flat", node = "eye", height = 5 }]
lights = [{ name = "lamp", node = "lamp", kind = "point", intensity = 50 }]
[[tracks]]
node = "pivot"
property = "rotation"
times = [0, 1]
values = [{ axis = [0, 1, 0], degrees = 0 }, { axis = [0, 1, 0], degrees = 170 }]
"#;

/// The scene above and its models.
fn scene() -> tempfile::TempDir {
    let folder = folder(&[("scene.manifest", SCENE)]);
    std::fs::create_dir(folder.path().join("models")).unwrap();
    std::fs::write(folder.path().join("models/ball.obj"), sphere(10)).unwrap();
    std::fs::write(folder.path().join("models/quad.obj"), QUAD).unwrap();
    folder
}

/// Runs a program whose cache lies in the folder.
pub(crate) fn run(program: &str, folder: &Path, args: &[&str]) -> Run {
    let mut command = command(program, folder, args);
    command.env("BTH_CACHE_DIR", folder.join("cache"));
    run_with(command)
}

fn play(folder: &Path, args: &[&str]) -> Run {
    let mut all = vec!["scene.bth", "--size", "48x27", "--spp", "1"];
    all.extend(args);
    run("bth-play", folder, &all)
}

pub(crate) fn compiled() -> tempfile::TempDir {
    let folder = scene();
    run("bthc", folder.path(), &["compile", "scene.manifest"]).expect(0);
    folder
}

fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn manifests_compile_to_files_that_verify_and_tell_what_they_hold() {
    let folder = scene();
    let text = run("bthc", folder.path(), &["compile", "scene.manifest"]).expect(0).stdout;
    assert!(
        text.contains("frames") && text.contains("0 to 5 at 5/s") && text.contains("wrote scene.bth"),
        "{text}"
    );
    let first = std::fs::read(folder.path().join("scene.bth")).unwrap();
    let args = ["compile", "scene.manifest", "-o", "b.bth", "--threads", "1", "--json"];
    let json = run("bthc", folder.path(), &args).expect(0).job();
    assert_eq!(json["scene"]["instances"], 2);
    assert_eq!(json["scene"]["objects"][0]["names"][0], "ball");
    assert!(first == std::fs::read(folder.path().join("b.bth")).unwrap(), "threads change nothing");
    run("bthc", folder.path(), &["verify", "scene.bth"]).expect(0);
    let info = run("bthc", folder.path(), &["info", "scene.bth", "--json"]).expect(0).json();
    assert_eq!(info["scene"]["cameras"], serde_json::json!(["eye", "flat"]));
    assert_eq!(info["scene"]["last_frame"], 5);
    assert!(run("bthc", folder.path(), &["info", "scene.bth"]).expect(0).stdout.contains("SCENE"));
}

#[test]
fn faults_of_manifests_are_told_with_line_and_column() {
    let folder = folder(&[("bad.manifest", "version = 1\nnodes = [{ name = \"a\", parant = \"b\" }]\n")]);
    let refused = run("bthc", folder.path(), &["compile", "bad.manifest", "--json"]).expect(3);
    assert!(refused.stderr.contains("bad.manifest:2:24: BTH-M003: unknown key `parant`"), "{refused:?}");
    let error = &refused.json()["error"];
    assert_eq!(
        (&error["code"], &error["line"], &error["column"]),
        (&"BTH-M003".into(), &2.into(), &24.into())
    );
    assert!(
        run("bth-play", folder.path(), &["bad.manifest", "-o", "x.png"]).expect(3).stderr.contains(":2:24:")
    );
    run("bthc", folder.path(), &["compile", "absent.manifest"]).expect(4);
    assert_eq!(files(folder.path()), ["bad.manifest"]);
}

#[test]
fn numbered_frames_are_resumed_shared_out_and_forced() {
    let folder = compiled();
    let rendered = |run: Run| -> Vec<i64> {
        let json = run.expect(0).json();
        json["frames"].as_array().unwrap().iter().map(|f| f["frame"].as_i64().unwrap()).collect()
    };
    let all = ["-o", "out/####.png", "--json"];
    let shard = |part| rendered(play(folder.path(), &[&all[..], &["--shard", part]].concat()));
    assert_eq!(shard("1/2"), [0, 2, 4]);
    let bytes = std::fs::read(folder.path().join("out/0002.png")).unwrap();
    // A truncated picture and one of another size are rendered again.
    std::fs::write(folder.path().join("out/0002.png"), &bytes[..bytes.len() - 7]).unwrap();
    let small =
        ["scene.bth", "-o", "out/####.png", "--frames", "4", "--force", "--size", "8x8", "--spp", "1"];
    run("bth-play", folder.path(), &small).expect(0);
    assert_eq!(rendered(play(folder.path(), &all)), [1, 2, 3, 4, 5]);
    assert_eq!(files(&folder.path().join("out")).len(), 6);
    assert!(bytes == std::fs::read(folder.path().join("out/0002.png")).unwrap());
    assert_eq!(rendered(play(folder.path(), &all)), [0i64; 0]);
    let forced = [&all[..], &["--frames", "1..2", "--force"]].concat();
    assert_eq!(rendered(play(folder.path(), &forced)), [1, 2]);
    let frames: Vec<_> = files(&folder.path().join("out"))
        .iter()
        .map(|name| std::fs::read(folder.path().join("out").join(name)).unwrap())
        .collect();
    assert!(frames.windows(2).all(|pair| pair[0] != pair[1]), "the scene moves");
}

#[test]
fn animations_and_streams_hold_every_frame() {
    let folder = compiled();
    for name in ["a.apng", "a.gif", "a.y4m"] {
        play(folder.path(), &["-o", name, "--mode", "normals"]).expect(0);
    }
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    let count = |bytes: &[u8], what: &[u8]| bytes.windows(what.len()).filter(|w| *w == what).count();
    let apng = read("a.apng");
    assert_eq!((count(&apng, b"fcTL"), count(&apng, b"acTL"), count(&apng, b"IEND")), (6, 1, 1));
    let gif = read("a.gif");
    assert!(gif.starts_with(b"GIF89a") && gif.ends_with(b";"));
    let y4m = read("a.y4m");
    let header = b"YUV4MPEG2 W48 H27 F5:1 Ip A1:1 C444 XCOLORRANGE=LIMITED\n";
    assert!(y4m.starts_with(header));
    assert_eq!(y4m.len(), header.len() + 6 * (6 + 3 * 48 * 27));
    let mut stream =
        command("bth-play", folder.path(), &["scene.bth", "-o", "-", "--size", "48x27", "--spp", "1"]);
    let output = stream.args(["--mode", "normals", "--stats"]).output().unwrap();
    assert!(output.stdout == y4m, "standard output holds the stream and nothing else");
    assert!(String::from_utf8_lossy(&output.stderr).contains("objects touched"));
}

#[test]
fn cameras_of_the_scene_differ_and_unknown_ones_are_refused() {
    let folder = compiled();
    let picture = |args: &[&str]| {
        play(folder.path(), &[&["-o", "x.png"][..], args].concat()).expect(0);
        std::fs::read(folder.path().join("x.png")).unwrap()
    };
    let pictures = [
        picture(&[]),
        picture(&["--camera", "flat"]),
        picture(&["--camera", "0,5,5,0,0,0"]),
        picture(&["--yaw", "100"]),
        picture(&["--frames", "3"]),
        picture(&["--fov", "20"]),
    ];
    assert!((1..pictures.len()).all(|i| !pictures[..i].contains(&pictures[i])));
    assert!(pictures[0] == picture(&["--camera", "eye"]), "the scene's first choice");
    let unknown = play(folder.path(), &["-o", "y.png", "--camera", "ear"]).expect(2);
    assert!(unknown.stderr.contains("\"eye\", \"flat\""), "{unknown:?}");
}

#[test]
fn options_that_do_not_fit_the_output_are_refused() {
    let folder = compiled();
    for (args, words) in [
        (&["-o", "x.png", "--frames", "0..2"][..], "holds one frame"),
        (&["-o", "x.gif", "--shard", "1/2"], "numbered pictures"),
        (&["-o", "x.jpeg"], ".apng"),
        (&["-o", "##.png", "--frames", "3..9"], "frames 0 to 5"),
        (&["-o", "##.png", "--shard", "3/2"], "I from 1 to N"),
        (&["-o", "##.png", "--frames", "3..1"], "from 3 on"),
    ] {
        let refused = play(folder.path(), args).expect(2);
        assert!(refused.stderr.contains(words), "{args:?}: {refused:?}");
    }
    assert!(files(folder.path()).iter().all(|f| !f.ends_with(".png") && !f.ends_with(".gif")));
}

#[test]
fn every_mode_shows_the_scene_whatever_the_number_of_threads() {
    let folder = compiled();
    let mut pictures = Vec::new();
    for mode in ["shaded", "normals", "ao", "steps", "path", "instances"] {
        let picture = |threads: &str| {
            play(folder.path(), &["-o", "x.png", "--mode", mode, "--threads", threads]).expect(0);
            std::fs::read(folder.path().join("x.png")).unwrap()
        };
        let one = picture("1");
        assert!(one == picture("2"), "{mode}");
        assert!(!pictures.contains(&one), "{mode} looks like another mode");
        pictures.push(one);
    }
}

#[test]
fn manifests_are_played_through_the_cache() {
    let folder = scene();
    let args = [
        &["scene.manifest", "-o", "x.png", "--size", "48x27", "--spp", "1", "--stats", "--json"][..],
        &["--cache-dir", "cache"],
    ]
    .concat();
    let json = run("bth-play", folder.path(), &args).expect(0).json();
    assert_eq!((&json["stats"]["objects"], &json["stats"]["objects_touched"]), (&2.into(), &2.into()));
    let kept = || {
        let list = ["cache", "list", "--stage", "scene", "--json", "--cache-dir", "cache"];
        run("bthc", folder.path(), &list).expect(0).json()["entries"].as_array().unwrap().len()
    };
    assert_eq!(kept(), 1);
    run("bth-play", folder.path(), &args).expect(0);
    assert_eq!(kept(), 1, "nothing is compiled twice");
    std::fs::write(folder.path().join("models/quad.obj"), QUAD.replace("-1 3", "-1 4")).unwrap();
    run("bth-play", folder.path(), &args).expect(0);
    assert_eq!(kept(), 2, "a changed model is");

    // Without the compiler in the same folder the error of the player has a hint.
    let alone = tempfile::tempdir().unwrap();
    let program = alone.path().join("bth-play");
    let built = bth_tests::target_folder().join("bth-play");
    // A file that is being written cannot be started, and other tests start programs that inherit
    // open files.
    std::fs::hard_link(&built, &program).or_else(|_| std::fs::copy(&built, &program).map(|_| ())).unwrap();
    let mut command = std::process::Command::new(&program);
    let output =
        command.args(args).current_dir(folder.path()).env("BTH_CACHE_DIR", alone.path().join("c")).output();
    let output = output.unwrap();
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(3), "{message}");
    assert!(
        message.contains("BTH-P003") && message.contains("bthc compile scene.manifest -o scene.bth"),
        "{message}"
    );
}

#[test]
fn frames_that_cannot_be_shown_end_with_the_node() {
    let folder = scene();
    let squeezed = format!(
        "{SCENE}[[tracks]]\nnode = \"ball\"\nproperty = \"scale\"\ntimes = [0, 1]\nvalues = [[1, 1, 1], [1, 1e-12, 1]]\n"
    );
    std::fs::write(folder.path().join("scene.manifest"), squeezed).unwrap();
    run("bthc", folder.path(), &["compile", "scene.manifest"]).expect(0);
    play(folder.path(), &["-o", "x.png", "--frames", "4"]).expect(0);
    let refused = play(folder.path(), &["-o", "y.png", "--frames", "5"]).expect(3);
    assert!(
        refused.stderr.contains("BTH-S001") && refused.stderr.contains("node \"ball\" at 1 s"),
        "{refused:?}"
    );
}

#[test]
fn animated_models_are_imported_compiled_and_rendered() {
    let Some(data) = data() else { return };
    let mut seen = 0;
    for entry in std::fs::read_dir(data.join("animated")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|e| e != "glb") {
            continue;
        }
        let folder = tempfile::tempdir().unwrap();
        std::fs::copy(&path, folder.path().join("x.glb")).unwrap();
        let name = path.display().to_string();
        let go = |program: &str, args: &[&str]| {
            let ended = run(program, folder.path(), args);
            assert_eq!(ended.code, Some(0), "{name}: {ended:?}");
            ended
        };
        go("bthc", &["import", "x.glb", "-o", "x.manifest"]);
        go("bthc", &["compile", "x.manifest", "-o", "a.bth", "--structure", "bvh"]);
        go("bthc", &["compile", "x.glb", "-o", "b.bth", "--structure", "bvh"]);
        let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
        assert!(read("a.bth") == read("b.bth"), "{name}");
        go("bthc", &["verify", "a.bth"]);
        let last = go("bthc", &["info", "a.bth", "--json"]).json()["scene"]["last_frame"].as_i64().unwrap();
        for frame in [0, last / 2, last] {
            let frame = frame.to_string();
            let args =
                ["a.bth", "-o", "x.png", "--size", "64x36", "--spp", "1", "--frames", &frame, "--json"];
            let json = go("bth-play", &args).json();
            assert!(json["frame"]["instances_visible"].as_u64() > Some(0), "{name}");
        }
        let strict = run("bthc", folder.path(), &["import", "x.glb", "-o", "s.manifest", "--strict"]);
        assert!(matches!(strict.code, Some(0 | 3)), "{name}: {strict:?}");
        seen += 1;
    }
    assert!(seen > 10, "{seen}");
}

#[cfg(target_os = "linux")]
#[test]
fn gltf_files_whose_names_cannot_stand_in_manifests_are_refused_by_name() {
    use std::os::unix::ffi::OsStrExt;
    let folder = tempfile::tempdir().unwrap();
    let not_text = std::ffi::OsStr::from_bytes(b"a\xFF.gltf");
    for name in [not_text, "a:b.gltf".as_ref()] {
        std::fs::write(folder.path().join(name), "{}").unwrap();
        let mut import = command("bthc", folder.path(), &["import"]);
        import.arg(name);
        let refused = run_with(import).expect(2);
        assert!(refused.stderr.contains("cannot stand in a manifest"), "{refused:?}");
        assert!(refused.stderr.contains("rename it"), "{refused:?}");
    }
    let mut compile = command("bthc", folder.path(), &["compile"]);
    compile.arg(not_text);
    let refused = run_with(compile).expect(3);
    assert!(refused.stderr.contains("BTH-I006: expected a file name in UTF-8"), "{refused:?}");
}

#[test]
fn manifests_are_written_beside_or_above_their_model_only() {
    let Some(data) = data() else { return };
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir_all(folder.path().join("a/b")).unwrap();
    std::fs::copy(data.join("animated/khr_AnimatedTriangle.glb"), folder.path().join("a/x.glb")).unwrap();
    run("bthc", folder.path(), &["import", "a/x.glb", "-o", "up.manifest", "--quiet"]).expect(0);
    let text = std::fs::read_to_string(folder.path().join("up.manifest")).unwrap();
    assert!(text.contains("model = \"a/x.glb\""), "{text}");
    run("bthc", folder.path(), &["compile", "up.manifest", "--quiet"]).expect(0);
    let below = run("bthc", folder.path(), &["import", "a/x.glb", "-o", "a/b/down.manifest"]).expect(2);
    assert!(below.stderr.contains("beside that file or in a folder above"), "{below:?}");
    run("bthc", folder.path(), &["compile", "a/x.glb", "-o", "flat.bth", "--flatten", "--json"]).expect(0);
    let info = run("bthc", folder.path(), &["info", "flat.bth", "--json"]).expect(0).json();
    assert!(info["scene"].is_null());
}

#[test]
fn objects_that_no_ray_comes_near_are_not_touched() {
    let folder = compiled();
    let touched = |camera: &str| {
        let args = ["-o", "x.png", "--stats", "--json", "--mode", "normals", "--camera", camera];
        let json = play(folder.path(), &args).expect(0).json();
        let length = std::fs::metadata(folder.path().join("scene.bth")).unwrap().len();
        assert_eq!(json["stats"]["mapped_bytes"], length);
        assert!(json["stats"]["resident_bytes"].as_u64() <= Some(length.next_multiple_of(4096)));
        json["stats"]["objects_touched"].as_u64().unwrap()
    };
    assert_eq!(touched("0,9,0,0,99,0"), 0, "the sky");
    assert_eq!(touched("-2,3,2,-2.5,-1,2.5"), 1, "a corner of the floor");
    assert_eq!(touched("0,3,6,0,0,0"), 2, "all");
}

/// What a scene skips is told, as for single models.
#[test]
fn scenes_tell_what_they_leave_out() {
    let manifest = r#"version = 1
objects = [{ name = "o", model = "o.obj" }, { name = "moves", sequence = ["p.obj", "q.obj"] }]
nodes = [{ name = "a", object = "o" }, { name = "flat", object = "o", scale = [1, 0, 1] }, { name = "m", object = "moves" }]
"#;
    let model = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\np 1\nl 1 2\n";
    let moved = model.replace("v 1 0 0", "v 2 0 0");
    let folder = folder(&[("o.obj", model), ("p.obj", model), ("q.obj", &moved), ("s.manifest", manifest)]);
    let run = run("bthc", folder.path(), &["compile", "s.manifest", "--json"]).expect(0);
    let warnings = run.job()["warnings"].to_string();
    for text in ["o.obj: 2 elements are left out", "p.obj: 2 elements are left out", "node \\\"flat\\\""] {
        assert!(warnings.contains(text), "{warnings}");
    }
}

#[test]
fn warnings_come_in_the_order_of_the_objects() {
    // The first object takes longer than the others together.
    let arrows = |count: usize| {
        let positions: String =
            (0..count).map(|z| format!("v 0 0 {z}\nv 4 0 {z}\nv 1 1 {z}\nv 0 4 {z}\n")).collect();
        let faces: String = (0..count)
            .map(|z| 4 * z)
            .map(|v| format!("f {} {} {} {}\n", v + 2, v + 3, v + 4, v + 1))
            .collect();
        positions + &faces
    };
    let (long, short) = (arrows(10_000), arrows(1));
    let names: Vec<String> = (0..6).map(|row| format!("{row}.obj")).collect();
    let object = |name: &String| format!("[[objects]]\nname = \"{name}\"\nmodel = \"{name}\"\n");
    let node = |name: &String| format!("[[nodes]]\nname = \"{name}\"\nobject = \"{name}\"\n");
    let rows: String = names.iter().map(object).chain(names.iter().map(node)).collect();
    let manifest = format!("version = 1\n{rows}");
    let mut files = vec![("order.manifest", manifest.as_str())];
    let text = |row| if row == 0 { long.as_str() } else { short.as_str() };
    files.extend(names.iter().enumerate().map(|(row, name)| (name.as_str(), text(row))));
    let folder = folder(&files);
    let run =
        run("bthc", folder.path(), &["compile", "order.manifest", "--json", "--threads", "4"]).expect(0);
    let report = run.job();
    let warnings: Vec<_> =
        report["warnings"].as_array().unwrap().iter().map(|w| w.as_str().unwrap()).collect();
    assert_eq!(warnings.len(), names.len(), "{warnings:#?}");
    for (warning, name) in warnings.iter().zip(&names) {
        assert!(warning.contains(&format!("{name}: ")), "{warnings:#?}");
    }
}
