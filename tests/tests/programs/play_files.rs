//! Files of `bth-play`: what pictures may replace, where they go, and sources that it has compiled.

use crate::made_models::{png, square, unlit};
use crate::support::{Run, bthc, command, folder, run, run_with, sphere};
use serde_json::json;
use std::path::Path;

fn play(folder: &Path, args: &[&str]) -> Run {
    run("bth-play", folder, &[args, &["--size", "16x9", "--spp", "1"]].concat())
}

#[test]
fn no_picture_replaces_what_is_read() {
    let texture = unlit(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    let folder = folder(&[
        ("quad.gltf", &square(&texture, &[json!({"uri": "0000.png"})], None)),
        ("sky.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\u{1}\u{1}\u{1}\u{1}"),
    ]);
    let path = folder.path();
    let texels = png(1, &[[255, 0, 0, 255]]);
    std::fs::write(path.join("0000.png"), &texels).unwrap();
    bthc(path, &["compile", "quad.gltf", "-o", "quad.bth", "-q"]).expect(0);
    std::fs::copy(path.join("quad.bth"), path.join("0007.png")).unwrap();
    std::fs::create_dir(path.join("d")).unwrap();
    std::fs::copy(path.join("sky.hdr"), path.join("sky.png")).unwrap();
    for args in [
        &["quad.gltf", "-o", "0000.png"][..],
        &["quad.gltf", "-o", "d/../0000.png"],
        &["quad.gltf", "-o", "####.png"],
        &["0007.png", "-o", "0007.png"],
        &["quad.bth", "--mode", "path", "--env", "sky.png", "-o", "./sky.png"],
    ] {
        let run = play(path, args).expect(2);
        assert!(run.stderr.contains("would replace a file that is read"), "{run:?}");
    }
    assert!(std::fs::read(path.join("0000.png")).unwrap() == texels);
    play(path, &["quad.gltf", "-o", "other/####.png"]).expect(0);
    assert!(path.join("other/0000.png").is_file());
}

/// As in a container without a home, or with one that cannot be written.
#[test]
fn models_are_shown_without_a_folder_for_the_cache() {
    let folder = folder(&[("ball.obj", &sphere(12)), ("file", "")]);
    for home in [None, Some("file")] {
        let mut player = command("bth-play", folder.path(), &["ball.obj", "-o", "a.png", "--size", "16x9"]);
        player.env_remove("BTH_NO_CACHE").env_remove("BTH_CACHE_DIR").env_remove("XDG_CACHE_HOME");
        player.env_remove("LOCALAPPDATA");
        match home {
            Some(home) => player.env("HOME", folder.path().join(home)),
            None => player.env_remove("HOME"),
        };
        let run = run_with(player).expect(0);
        assert_eq!(run.stderr.contains("warning: going on without the cache"), home.is_some(), "{run:?}");
        std::fs::remove_file(folder.path().join("a.png")).unwrap();
    }
}

/// A model is mapped from the cache, whose files have names that nobody knows.
#[test]
fn messages_about_a_model_name_it_and_not_its_entry_in_the_cache() {
    let folder = folder(&[("ball.obj", &sphere(4))]);
    let args = ["ball.obj", "-o", "a.png", "--cache-dir", "c"];
    let play = |more: &[&str]| play(folder.path(), &[&args, more].concat());
    let lacks = play(&["--camera", "nosuch"]).expect(2);
    assert!(lacks.stderr.starts_with("error: BTH-U001: ball.obj has no cameras"), "{lacks:?}");
    let far = play(&["--camera", "1e39,0,0,0,0,0"]).expect(0);
    assert!(far.stderr.starts_with("warning: ball.obj: the camera"), "{far:?}");
    let stats = &play(&["--stats", "--json"]).expect(0).json()["stats"];
    assert!(stats["mapped_bytes"] == stats["file_bytes"], "{stats}");
}

/// A cache in which nothing can be kept is no fault of the materials.
#[cfg(unix)]
#[test]
fn an_entry_that_cannot_be_kept_is_an_error_of_the_cache() {
    let folder = folder(&[("ball.obj", &sphere(48))]);
    let player = command("bth-play", folder.path(), &[]);
    let mut limited = std::process::Command::new("sh");
    limited.args(["-c", "ulimit -f 40; exec \"$0\" \"$@\""]).arg(player.get_program());
    limited.args(["ball.obj", "-o", "a.png", "--size", "16x9", "--mode", "path", "--cache-dir", "c"]);
    limited.current_dir(folder.path());
    let run = run_with(limited).expect(4);
    assert!(run.stderr.contains("BTH-O061") && !run.stderr.contains("materials"), "{run:?}");
}

#[test]
fn where_nothing_can_be_written_nothing_is_rendered() {
    let folder = folder(&[("ball.obj", &sphere(12)), ("file", "")]);
    let path = folder.path();
    bthc(path, &["compile", "ball.obj", "-q"]).expect(0);
    // So many samples would take minutes.
    for output in ["file/a.png", "file/a.gif", "file/a.apng", "file/####.png"] {
        let args = ["ball.bth", "-o", output, "--size", "1280x720", "--spp", "65536", "--json"];
        let run = run("bth-play", path, &args).expect(4);
        let error = &run.json()["error"];
        assert_eq!(error["code"], "BTH-P002", "{run:?}");
        assert!(error["hint"].is_string() && !run.stderr.contains(".tmp"), "{run:?}");
    }
    for output in ["new/a.png", "newer/a.gif"] {
        play(path, &["ball.bth", "-o", output]).expect(0);
        assert!(path.join(output).is_file());
    }
}

#[test]
fn what_the_compiler_says_is_passed_on_once() {
    let folder = folder(&[("bad.obj", "v 0 0 x\n"), ("cube.obj", &sphere(4))]);
    let error = |args: &[&str], exit: i32| {
        let run = play(folder.path(), &[args, &["-o", "a.png", "--json"]].concat()).expect(exit);
        assert_eq!(run.stderr.matches("error: ").count(), 1, "{run:?}");
        run.json()["error"].clone()
    };
    let missing = error(&["none.obj"], 4);
    assert_eq!((&missing["code"], &missing["place"]), (&json!("BTH-O001"), &json!("none.obj")));
    let bad = error(&["bad.obj"], 3);
    assert!(bad["place"] == "bad.obj:1" && bad["hint"].is_string(), "{bad:#}");
    let mut wrong = command("bth-play", folder.path(), &["cube.obj", "-o", "a.png"]);
    wrong.env("BTH_CACHE_SIZE", "foo");
    run_with(wrong).expect(2);
}

#[test]
fn without_a_cache_nothing_stays() {
    let folder = folder(&[("cube.obj", &sphere(4))]);
    let home = folder.path().join("home");
    std::fs::create_dir(&home).unwrap();
    let mut command = command("bth-play", folder.path(), &["cube.obj", "-o", "a.png", "--size", "8x8"]);
    command.env_remove("BTH_CACHE_DIR").env("XDG_CACHE_HOME", &home).env("TMPDIR", &home);
    run_with(command).expect(0);
    assert_eq!(std::fs::read_dir(&home).unwrap().count(), 0);
}

#[test]
fn options_are_checked_though_no_frame_is_left() {
    let folder = folder(&[("ball.obj", &sphere(4))]);
    bthc(folder.path(), &["compile", "ball.obj", "-q"]).expect(0);
    play(folder.path(), &["ball.bth", "-o", "####.png"]).expect(0);
    let json = play(folder.path(), &["ball.bth", "-o", "####.png", "--json"]).expect(0).json();
    assert_eq!(json["frames_skipped"], 1, "{json:#}");
    assert!(!json.to_string().contains("-0"), "{json:#}");
    play(folder.path(), &["ball.bth", "-o", "####.png", "--camera", "nope"]).expect(2);
}
