//! What a user gets who makes a mistake: a message and an exit code, never a backtrace.

use std::process::Command;

/// A path in this crate at which there is no file.
const NO_FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/no-such-library");

/// The exit code and standard error of the program, run with backtraces enabled.
fn mistake(arguments: &[&str]) -> (i32, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bth-bench"));
    command.env("RUST_BACKTRACE", "1").env("EMBREE_LIB", NO_FILE).env("TINYBVH_LIB", NO_FILE);
    let output = command.args(arguments).output().unwrap();
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(
        !message.contains("stack backtrace") && !message.contains("panicked"),
        "{arguments:?}: {message}"
    );
    assert!(output.stdout.is_empty(), "{arguments:?} printed results");
    (output.status.code().expect("an exit code"), message)
}

#[test]
fn misused_command_lines_exit_with_2_and_name_the_word() {
    for (arguments, word) in [
        (&["speeds", "torus-knot"][..], "speeds"),
        (&["speed", "torus-knot", "--ray", "5"], "--ray"),
        (&["speed", "torus-knot", "--rounds", "0"], "--rounds"),
        (&["speed", "torus-knot", "--rays", "0"], "--rays"),
        (&["speed"], "<MODEL>"),
        (&["compare", "a.so", "b.so", "torus-knot", "--worse", "1"], "--worse"),
        (&["stress", "--size", "0"], "--size"),
        (&["speed", "torus-knot", "--name", "../speed"], "--name"),
        (&["speed", "torus-knot", "--name", ""], "--name"),
        (&["shutter", "swarm", "--open", "1,nan"], "--open"),
    ] {
        let (code, message) = mistake(arguments);
        assert_eq!(code, 2, "{arguments:?}: {message}");
        assert!(message.contains(word), "{arguments:?}: {message}");
    }
}

#[test]
fn files_and_names_that_do_not_exist_exit_with_1_and_are_named() {
    for arguments in [
        &["speed", "missing.ply"][..],
        &["speed", "no-such-model"],
        &["speed", "torus-knot:0"],
        &["speed", "torus-knot", "--set", "missing"],
        &["accuracy", "torus-knot", "--tracer", "missing"],
        &["load", "missing.ply"],
        &["load-scenes", "missing.manifest"],
        &["load-scenes", "objects:missing"],
        &["quality", "missing.ply"],
        &["scenes", "missing"],
        &["record", "missing"],
        &["summary", "--folder", "missing"],
        &["compare", "missing.so", "missing.so", "torus-knot"],
    ] {
        let (code, message) = mistake(arguments);
        assert_eq!(code, 1, "{arguments:?}: {message}");
        assert!(message.starts_with("error: "), "{arguments:?}: {message}");
        let named =
            arguments.iter().skip(1).any(|name| message.contains(name.trim_start_matches("objects:")));
        assert!(named, "{arguments:?}: {message}");
    }
}

#[test]
fn files_that_are_no_models_exit_with_1_and_are_named() {
    let folder = tempfile::tempdir().unwrap();
    for (name, contents) in
        [("broken.ply", "ply\nformat none 1.0\n"), ("broken.stl", ""), ("broken.xyz", "1 2 3\n")]
    {
        let path = folder.path().join(name);
        std::fs::write(&path, contents).unwrap();
        let (code, message) = mistake(&["speed", path.to_str().unwrap()]);
        assert_eq!(code, 1, "{name}: {message}");
        assert!(message.contains(name), "{name}: {message}");
    }
}
