//! Exit codes and error messages of wrong usage, missing files and malformed models.

use crate::support::{bthc, command, folder, run, run_with, sphere, wait};
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

#[test]
fn wrong_usage_exits_2() {
    let folder = folder(&[]);
    for args in [
        &[][..],
        &["compile"],
        &["compile", "a.obj", "--quality", "superb"],
        &["compile", "a.obj", "--set", "min-tet-triangles=-3"],
        &["compile", "a.obj", "--set", "poses"],
        &["compile", "a.obj", "--set", "speed=3"],
        &["compile", "a.obj", "--threads", "many"],
        &["unknown"],
    ] {
        let run = bthc(folder.path(), args).expect(2);
        assert!(!run.stderr.is_empty());
    }
    run("bth-play", folder.path(), &["a.bth", "-o", "a.png", "--size", "0x10"]).expect(2);
    run("bth-play", folder.path(), &["a.bth", "-o", "a.png", "--camera", "1,2,3"]).expect(2);
}

#[test]
fn wrong_usage_is_json_when_asked_for() {
    let folder = folder(&[]);
    let json = bthc(folder.path(), &["compile", "a.obj", "--structure", "x", "--json"]).expect(2).json();
    assert_eq!((&json["error"]["code"], &json["error"]["exit_code"]), (&"BTH-U001".into(), &2.into()));
}

#[test]
fn help_and_version_exit_0_and_help_lists_the_exit_codes() {
    let folder = folder(&[]);
    for args in [&["--help"][..], &["compile", "--help"], &["verify", "--help"]] {
        let run = bthc(folder.path(), args).expect(0);
        assert!(run.stdout.contains("130  cancelled"), "{run:?}");
    }
    let version = bthc(folder.path(), &["--version"]).expect(0).stdout;
    assert_eq!(version, format!("bthc {}\n", env!("CARGO_PKG_VERSION")));
    assert_eq!(bthc(folder.path(), &["-V"]).expect(0).stdout, version);
    let told = bthc(folder.path(), &["--version", "--verbose"]).expect(0).stdout;
    for what in [version.as_str(), "files:", "instruction set:", "features:", "TetGen:"] {
        assert!(told.contains(what), "{what} in {told}");
    }
    bthc(folder.path(), &["--verbose"]).expect(2);
    bthc(folder.path(), &["--isa", "scalar"]).expect(2);
    bthc(folder.path(), &[]).expect(2);
    run("bth-play", folder.path(), &["--help"]).expect(0);
}

#[test]
fn missing_files_exit_4() {
    let folder = folder(&[("ball.obj", &sphere(4))]);
    for args in [
        &["compile", "missing.obj"][..],
        &["compile", "ball.obj", "-o", "missing/ball.bth"],
        &["info", "missing.bth"],
        &["verify", "missing.bth"],
        &["trace", "missing.bth", "missing.rays", "-o", "x.hits"],
        &["marks", "missing.obj"],
    ] {
        let run = bthc(folder.path(), args).expect(4);
        assert!(run.stderr.starts_with("error: ") && run.stderr.contains("missing"), "{run:?}");
    }
    run("bth-play", folder.path(), &["missing.bth", "-o", "x.png"]).expect(4);
}

#[test]
fn errors_name_file_and_line() {
    let folder = folder(&[
        ("nan.obj", "v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n"),
        ("index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n\nf 1 2 7\n"),
        ("word.off", "OFF\n3 1 0\n0 0 0\n1 zero 0\n0 1 0\n3 0 1 2\n"),
    ]);
    for (name, line) in [("nan.obj", 3), ("index.obj", 5), ("word.off", 4)] {
        let run = bthc(folder.path(), &["compile", name]).expect(3);
        assert!(run.stderr.contains(&format!("{name}:{line}")), "{run:?}");
    }
}

#[test]
fn errors_about_the_contents_of_compiled_files_name_the_file() {
    let files = Path::new(env!("CARGO_MANIFEST_DIR")).join("../format-spec/conformance/invalid");
    for name in ["F104-bits.bth", "F150-frames.bth"] {
        let found = bthc(&files, &["info", name, "--json"]).expect(3);
        assert_eq!(found.json()["error"]["place"], name, "{found:?}");
        let found = bthc(&files, &["verify", name, "--json"]).expect(1);
        assert_eq!(found.json()["errors"][0]["place"], name, "{found:?}");
        for run in [bthc(&files, &["info", name]).expect(3), bthc(&files, &["verify", name]).expect(1)] {
            assert!(run.stderr.starts_with(&format!("error: {name}: BTH-F")), "{run:?}");
        }
    }
    // SAFETY: nobody writes to the file, whose contents are refused.
    #[allow(unsafe_code)]
    let mapped = unsafe { bth::map(files.join("F150-frames.bth")) };
    assert!(mapped.err().unwrap().path().is_some_and(|path| path.ends_with("F150-frames.bth")));
}

#[test]
fn control_characters_of_names_in_files_are_escaped() {
    let animated = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{}],
        "animations":[{"name":"\u001b[31mrun","channels":[],"samplers":[]}]}"#;
    let folder = folder(&[
        ("library.obj", "mtllib \u{1b}[31mred.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
        ("key.manifest", "version = 1\n\"\\u001b[31mkey\" = 1\n"),
        ("animated.gltf", animated),
    ]);
    let library = bthc(folder.path(), &["compile", "library.obj", "--materials"]).expect(3);
    let key = bthc(folder.path(), &["compile", "key.manifest"]).expect(3);
    let played = run("bth-play", folder.path(), &["key.manifest", "-o", "x.png"]).expect(3);
    let info = bthc(folder.path(), &["info", "animated.gltf"]).expect(0);
    for text in [library.stderr, key.stderr, played.stderr, info.stdout] {
        assert!(text.contains("\\u{1b}[31m") && !text.contains('\u{1b}'), "{text:?}");
    }
}

#[test]
fn unknown_formats_and_foreign_files_exit_3() {
    let folder = folder(&[("model.txt", "hello"), ("foreign.bth", "hello")]);
    bthc(folder.path(), &["compile", "model.txt"]).expect(3);
    for args in [&["info", "foreign.bth"][..], &["trace", "foreign.bth", "model.txt", "-o", "x.hits"]] {
        let run = bthc(folder.path(), args).expect(3);
        assert!(run.stderr.starts_with("error: "), "{run:?}");
    }
    run("bth-play", folder.path(), &["foreign.bth", "-o", "x.png"]).expect(3);
    assert!(!folder.path().join("x.hits").exists() && !folder.path().join("x.png").exists());
}

#[test]
fn model_is_never_overwritten_by_its_own_output() {
    let folder = folder(&[("model.bth", "v 0 0 0\n")]);
    bthc(folder.path(), &["compile", "model.bth"]).expect(2);
    assert_eq!(std::fs::read(folder.path().join("model.bth")).unwrap(), b"v 0 0 0\n");
}

#[cfg(target_os = "linux")]
#[test]
fn help_that_cannot_be_printed_is_an_error_and_a_closed_pipe_is_none() {
    let folder = folder(&[]);
    for (program, args) in [
        ("bthc", &["--help"][..]),
        ("bthc", &["compile", "-h"]),
        ("bthc", &["--version"]),
        ("bth-play", &["--help"]),
        ("bth-play", &["--version"]),
    ] {
        let mut full = command(program, folder.path(), args);
        full.stdout(std::fs::File::options().write(true).open("/dev/full").unwrap());
        let full = run_with(full).expect(4);
        assert!(full.stderr.contains("standard output"), "{full:?}");
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let mut closed = command(program, folder.path(), args);
        closed.stdout(writer);
        let closed = run_with(closed).expect(0);
        assert_eq!(closed.stderr, "", "{args:?}");
    }
}

/// By default a signal ends who writes beyond the limit.
#[cfg(unix)]
#[test]
fn a_limit_on_the_size_of_files_is_an_error_of_the_write() {
    let folder = folder(&[("ball.obj", &sphere(48))]);
    let path = folder.path();
    bthc(path, &["compile", "ball.obj", "--quiet"]).expect(0);
    for (program, args, code) in [
        ("bthc", &["compile", "ball.obj", "-o", "other.bth", "--json"][..], "BTH-O020"),
        ("bth-play", &["ball.bth", "-o", "a.png", "--json"], "BTH-P002"),
    ] {
        let program = command(program, path, &[]);
        let mut limited = std::process::Command::new("sh");
        limited.args(["-c", "ulimit -f 4; exec \"$0\" \"$@\""]).arg(program.get_program()).args(args);
        limited.current_dir(path).env("BTH_NO_CACHE", "1");
        let run = run_with(limited).expect(4);
        assert_eq!(run.json()["error"]["code"], code);
    }
    let mut names: Vec<_> = std::fs::read_dir(path).unwrap().map(|e| e.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["ball.bth", "ball.obj"], "no part of a file stays");
}

#[test]
fn where_no_thread_can_be_started_there_is_an_error() {
    let folder = folder(&[("ball.obj", &sphere(4))]);
    for (program, args) in [
        ("bthc", &["compile", "ball.obj", "--end-with-input", "--json"][..]),
        ("bth-play", &["ball.obj", "-o", "ball.png", "--json"]),
    ] {
        let mut command = command(program, folder.path(), args);
        // No system has as much memory for a stack.
        command.env("RUST_MIN_STACK", (1u64 << 47).to_string());
        let error = &run_with(command).expect(5).json()["error"];
        assert_eq!(error["code"], "BTH-L090", "{error}");
        assert!(error["hint"].as_str().unwrap().contains("--threads"), "{error}");
    }
}

/// A pipe without a writer would keep a program waiting, where Ctrl-C is heeded by nobody; and
/// `/dev/zero` has no end.
#[cfg(unix)]
#[test]
fn pipes_and_devices_are_refused_where_files_are_read_whole() {
    let folder = folder(&[("ball.obj", &sphere(4))]);
    let path = folder.path();
    bthc(path, &["compile", "ball.obj", "--quiet"]).expect(0);
    for pipe in ["p.obj", "p.glb", "p.manifest", "p"] {
        assert!(std::process::Command::new("mkfifo").arg(path.join(pipe)).status().unwrap().success());
    }
    for args in [
        &["bthc", "compile", "p.obj"][..],
        &["bthc", "compile", "p.glb"],
        &["bthc", "compile", "p.manifest"],
        &["bthc", "import", "p.glb", "-o", "a.manifest"],
        &["bthc", "marks", "p.obj"],
        &["bthc", "compile", "ball.obj", "--rays", "p"],
        &["bth-play", "ball.bth", "-o", "a.png", "--mode", "path", "--env", "/dev/zero"],
    ] {
        let mut child = command(args[0], path, &args[1..]);
        let mut child = child.stderr(Stdio::piped()).spawn().unwrap();
        let status = wait(&mut child, Duration::from_secs(20)).unwrap_or_else(|| panic!("{args:?} waits"));
        assert_eq!(status.code(), Some(4), "{args:?}");
        let said = std::io::read_to_string(child.stderr.take().unwrap()).unwrap();
        assert!(said.contains("not a regular file"), "{args:?}: {said}");
    }
    // What tells its length may come from where there is more.
    bthc(path, &["trace", "ball.bth", "/dev/zero", "-o", "a.hits"]).expect(3);
}
