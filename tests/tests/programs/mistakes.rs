//! Mistakes that users make: every program answers with an error that can be acted on and the
//! documented exit code, and never with a panic or a backtrace, even where the environment enables
//! backtraces.

use crate::support::{Run, bthc, command, folder, run, run_with, sphere};
use std::path::Path;

/// Runs a program with backtraces enabled in its environment.
fn mistaken(program: &str, folder: &Path, args: &[&str]) -> Run {
    let mut command = command(program, folder, args);
    command.env("RUST_BACKTRACE", "1").env("RUST_LIB_BACKTRACE", "1");
    run_with(command)
}

/// A program, its arguments, its exit code, and what the error must contain.
type Mistake = (&'static str, &'static [&'static str], i32, &'static [&'static str]);

const BTHC: [Mistake; 22] = [
    ("bthc", &["nosuch"], 2, &["nosuch"]),
    ("bthc", &["compile", "ball.obj", "--nosuch"], 2, &["--nosuch"]),
    ("bthc", &["compile", "missing.obj"], 4, &["missing.obj", "BTH-O"]),
    ("bthc", &["compile", "empty"], 4, &["empty", "BTH-O"]),
    ("bthc", &["compile", "words.obj"], 3, &["words.obj:1", "BTH-I", "hint"]),
    ("bthc", &["compile", "words.gltf"], 3, &["words.gltf", "BTH-I", "hint"]),
    ("bthc", &["compile", "words.manifest"], 3, &["words.manifest:1", "BTH-M", "hint"]),
    ("bthc", &["compile", "ball.obj", "-o", "missing/ball.bth"], 4, &["missing", "BTH-O020"]),
    ("bthc", &["compile", "ball.obj", "-o", "ball.obj/ball.bth"], 4, &["ball.obj", "BTH-O020"]),
    ("bthc", &["compile", "ball.obj", "--cache-dir", "ball.obj"], 4, &["ball.obj", "BTH-O063"]),
    ("bthc", &["info", "empty"], 4, &["empty", "BTH-O001", "a folder, not a file"]),
    ("bthc", &["info", "words.manifest"], 3, &["words.manifest", "BTH-I001", "a scene manifest"]),
    ("bthc", &["marks", "ball.bth"], 3, &["ball.bth", "BTH-I001", "a compiled file", "bthc info"]),
    ("bthc", &["marks", "words.manifest"], 3, &["words.manifest", "BTH-I001", "a scene manifest"]),
    ("bthc", &["compile", "ball.bth", "-o", "x.bth"], 3, &["ball.bth", "BTH-I001", "a compiled file"]),
    ("bthc", &["verify", "missing.bth"], 4, &["missing.bth", "BTH-O001"]),
    ("bthc", &["trace", "missing.bth", "missing.rays", "-o", "x.hits"], 4, &["missing.rays", "BTH-O090"]),
    ("bthc", &["import", "ball.obj"], 2, &["BTH-U001", "ball.obj", "hint"]),
    ("bthc", &["--isa", "nosuch", "info", "ball.obj"], 2, &["nosuch"]),
    ("bthc", &["compile", "ball.obj", "--depfile", "-"], 2, &["--depfile", "not standard output"]),
    ("bthc", &["marks", "ball.obj", "--tris", "-"], 2, &["--tris", "not standard output"]),
    ("bthc", &["trace", "a.bth", "a.rays", "-o", "-"], 2, &["--output", "not standard output"]),
];

const BTH_PLAY: [Mistake; 12] = [
    ("bth-play", &["ball.bth", "-o", "x.png", "--mode", "nosuch"], 2, &["nosuch", "shaded"]),
    ("bth-play", &["ball.bth", "-o", "-", "--json"], 2, &["BTH-U001", "standard output", "-o"]),
    ("bth-play", &["ball.bth", "-o", "x.bmp"], 2, &["BTH-U001", "x.bmp", ".png"]),
    ("bth-play", &["ball.bth", "-o", "x.png", "--camera", "nosuch"], 2, &["nosuch"]),
    ("bth-play", &["ball.bth", "-o", "x.png", "--frames", "5..9"], 2, &["BTH-U001", "5 to 9"]),
    ("bth-play", &["missing.bth", "-o", "x.png"], 4, &["missing.bth", "BTH-O001"]),
    ("bth-play", &["missing.manifest", "-o", "x.png"], 4, &["missing.manifest", "BTH-M"]),
    ("bth-play", &["empty", "-o", "x.png"], 4, &["empty", "BTH-O001"]),
    ("bth-play", &["words.obj.bth", "-o", "x.png"], 3, &["words.obj.bth", "BTH-F"]),
    ("bth-play", &["ball.bth", "-o", "ball.bth/x.png", "--size", "8x8"], 4, &["ball.bth", "BTH-P002"]),
    ("bth-play", &["missing.obj", "-o", "x.png", "--cache-dir", "cache"], 4, &["missing.obj", "BTH-O001"]),
    ("bth-play", &["ball.obj", "-o", "x.png", "--cache-dir", "ball.obj"], 4, &["ball.obj", "BTH-P002"]),
];

const BTH_SCENES: [Mistake; 10] = [
    ("bth-scenes", &["nosuch"], 2, &["nosuch"]),
    ("bth-scenes", &["make", "nosuch", "-o", "x.ply"], 2, &["BTH-U001", "nosuch", "hint", "gyroid"]),
    ("bth-scenes", &["make", "carousel", "-o", "x.ply"], 2, &["carousel", "bth-scenes scene carousel"]),
    ("bth-scenes", &["scene", "blob", "-o", "x"], 2, &["BTH-U001", "bth-scenes make blob"]),
    ("bth-scenes", &["make", "blob", "-o", "x.fbx"], 2, &["BTH-U001", "x.fbx", ".ply", "hint"]),
    ("bth-scenes", &["make", "blob", "--faces", "0", "-o", "x.ply"], 2, &["0", "--faces"]),
    ("bth-scenes", &["make", "blob", "-o", "missing/x.ply"], 4, &["missing/x.ply", "BTH-O020"]),
    ("bth-scenes", &["make", "blob", "-o", "folder.ply"], 4, &["folder.ply", "BTH-O020"]),
    ("bth-scenes", &["scene", "nosuch", "-o", "x"], 2, &["BTH-U001", "nosuch", "hint", "carousel"]),
    ("bth-scenes", &["scene", "carousel", "-o", "ball.obj"], 4, &["ball.obj", "BTH-O020"]),
];

#[test]
fn mistakes_get_an_error_with_its_place_and_never_a_backtrace() {
    let folder = folder(&[
        ("ball.obj", &sphere(4)),
        ("words.obj", "v one two three\n"),
        ("words.gltf", "words"),
        ("words.manifest", "words"),
        ("words.obj.bth", "words"),
    ]);
    let path = folder.path();
    for name in ["empty", "folder.ply"] {
        std::fs::create_dir(path.join(name)).unwrap();
    }
    mistaken("bthc", path, &["compile", "ball.obj", "-q"]).expect(0);
    for (program, args, code, expected) in [&BTHC[..], &BTH_PLAY, &BTH_SCENES].concat() {
        let run = mistaken(program, path, args);
        assert_eq!(run.code, Some(code), "{program} {args:?}: {run:?}");
        assert!(run.stderr.starts_with("error: "), "{program} {args:?}: {run:?}");
        for text in expected {
            assert!(run.stderr.contains(text), "{program} {args:?} does not name {text:?}: {run:?}");
        }
        // Errors end with a hint. Errors of the command line have it as a separate text.
        if code != 2 {
            assert!(run.stderr.contains(" (hint: "), "{args:?}: {run:?}");
        }
        for text in ["backtrace", "panicked", "RUST_"] {
            assert!(!run.stderr.to_lowercase().contains(&text.to_lowercase()), "{program} {args:?}: {run:?}");
        }
    }
    assert!(!path.join("x.png").exists() && !path.join("x.ply").exists());
}

#[test]
fn a_closed_standard_output_is_no_error() {
    let folder = folder(&[]);
    for (program, args) in [("bth-scenes", &["list"][..]), ("bthc", &["man"])] {
        let mut command = command(program, folder.path(), args);
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = command.stdout(writer).env("RUST_BACKTRACE", "1").output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{program}: {output:?}");
        assert!(output.stderr.is_empty(), "{program}: {output:?}");
    }
}

#[test]
fn outputs_never_replace_what_is_read() {
    let scene = "version = 1\nobjects = [{ name = \"o\", model = \"a.obj\" }]\nnodes = [{ name = \"n\", object = \"o\" }]\n";
    let library = format!("mtllib a.mtl\n{}", sphere(8));
    let folder = folder(&[("a.obj", &library), ("a.mtl", "newmtl m\n"), ("s.manifest", scene)]);
    let path = folder.path();
    std::fs::create_dir(path.join("d")).unwrap();
    let contents = || ["a.obj", "a.mtl", "s.manifest"].map(|name| std::fs::read(path.join(name)).unwrap());
    let before = contents();
    let whole = path.join("a.obj").to_string_lossy().into_owned();
    bthc(path, &["compile", "a.obj", "-o", "a.bth"]).expect(0);
    for args in [
        &["compile", "a.obj", "-o", "a.obj"][..],
        &["compile", "a.obj", "-o", "./a.obj"],
        &["compile", "a.obj", "-o", "d/../a.obj"],
        &["compile", "a.obj", "-o", &whole],
        &["compile", "a.obj", "--materials", "-o", "a.mtl"],
        &["compile", "s.manifest", "-o", "a.obj"],
        &["compile", "s.manifest", "-o", "s.manifest"],
        &["compile", "s.manifest", "-o", "a.obj", "--dry-run"],
        &["compile", "s.manifest", "--depfile", "a.obj"],
        &["compile", "s.manifest", "a.obj", "--depfile", "./a.obj"],
        &["compile", "a.obj", "--depfile", "a.obj"],
        &["compile", "a.obj", "-o", "b.bth", "--depfile", "b.bth"],
        &["marks", "a.obj", "--tris", "./a.obj"],
    ] {
        let run = bthc(path, args).expect(2);
        assert!(run.stderr.contains("BTH-U001"), "{args:?}: {run:?}");
    }
    assert_eq!(contents(), before);
    let compiled = std::fs::read(path.join("a.bth")).unwrap();
    run("bth-play", path, &["a.bth", "-o", "./a.bth"]).expect(2);
    bthc(path, &["trace", "a.bth", "a.obj", "-o", "./a.bth"]).expect(2);
    assert_eq!(std::fs::read(path.join("a.bth")).unwrap(), compiled);
}
