//! Pictures that one shows to others: ground, framing, exposure, smoothing, noise and videos.

use crate::made_models::decoded;
use crate::support::{bthc, command, folder, obj, run, run_with, sphere};
use std::path::Path;

/// The pixels of a picture of a file.
#[track_caller]
fn shown(folder: &Path, file: &str, args: &[&str]) -> Vec<[u8; 3]> {
    let mut all = vec![file, "-o", "a.png"];
    let usual = ["--size", "48x36", "--spp", "4"];
    all.extend(usual.chunks(2).filter(|pair| !args.contains(&pair[0])).flatten());
    all.extend(args);
    run("bth-play", folder, &all).expect(0);
    decoded(&folder.join("a.png"))
}

fn warned(folder: &Path, file: &str, args: &[&str]) -> String {
    let all = [&[file, "-o", "a.png", "--size", "8x8", "--spp", "1"][..], args].concat();
    run("bth-play", folder, &all).expect(0).stderr
}

/// A scene of a ball, and of a floor if it has one.
fn scene(floor: bool) -> String {
    let mut text = "version = 1\nobjects = [{ name = \"ball\", model = \"ball.obj\" }, \
                    { name = \"floor\", model = \"floor.obj\" }]\n\
                    [[nodes]]\nname = \"b\"\nobject = \"ball\"\n"
        .to_owned();
    if floor {
        text += "[[nodes]]\nname = \"f\"\nobject = \"floor\"\ntranslation = [0, -1.1, 0]\n";
    }
    text
}

fn floor(size: f32) -> String {
    let s = size;
    obj(&[[-s, 0.0, -s], [s, 0.0, -s], [s, 0.0, s], [-s, 0.0, s]], &[[0, 2, 1], [0, 3, 2]])
}

#[test]
fn scenes_without_a_floor_get_a_ground_and_huge_floors_make_no_dot() {
    let folder = folder(&[
        ("ball.obj", &sphere(12)),
        ("floor.obj", &floor(200.0)),
        ("bare.manifest", &scene(false)),
        ("floor.manifest", &scene(true)),
    ]);
    let path = folder.path();
    for name in ["bare", "floor"] {
        bthc(path, &["compile", &format!("{name}.manifest"), "-o", &format!("{name}.bth")]).expect(0);
    }
    for mode in ["shaded", "path"] {
        let seen = |file: &str, more: &[&str]| shown(path, file, &[&["--mode", mode][..], more].concat());
        assert!(seen("bare.bth", &[]) != seen("bare.bth", &["--no-ground"]), "{mode}");
        assert!(seen("floor.bth", &[]) == seen("floor.bth", &["--no-ground"]), "{mode}");
    }
    // The ball has the same colour by instance, and fills a good part of both pictures.
    let count = |file: &str| {
        let ball = shown(path, file, &["--mode", "instances", "--spp", "1"]);
        let middle = ball[18 * 48 + 24];
        ball.iter().filter(|pixel| pixel.iter().zip(middle).all(|(a, b)| a.abs_diff(b) < 90)).count()
    };
    assert!(count("bare.bth") > 300 && count("floor.bth") > 300);
}

#[test]
fn a_model_that_lies_or_is_looked_at_from_inside_is_warned_of() {
    // A pyramid whose base is across z.
    let pyramid = obj(
        &[[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [0.0, 4.0, 0.0], [2.0, 2.0, 5.0]],
        &[[0, 2, 1], [0, 3, 2], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
    );
    let folder = folder(&[("a.obj", &pyramid), ("ball.obj", &sphere(12))]);
    bthc(folder.path(), &["compile", "a.obj", "ball.obj"]).expect(0);
    assert!(warned(folder.path(), "a.bth", &[]).contains("--up z"));
    assert_eq!(warned(folder.path(), "a.bth", &["--up", "z"]), "");
    assert_eq!(warned(folder.path(), "a.bth", &["--up", "y"]), "");
    assert_eq!(warned(folder.path(), "ball.bth", &[]), "");
    let inside = ["--camera", "0,0,0,0,0,1"];
    assert!(warned(folder.path(), "ball.bth", &inside).contains("the camera is inside something solid"));
    assert_eq!(warned(folder.path(), "ball.bth", &["--inside"]), "");
    assert_eq!(warned(folder.path(), "ball.bth", &["--camera", "0,0,3,0,0,0"]), "");
}

#[test]
fn exposure_is_chosen_for_the_picture_or_given_in_stops() {
    let folder = folder(&[("ball.obj", &sphere(12))]);
    bthc(folder.path(), &["compile", "ball.obj"]).expect(0);
    let mean = |stops: &[&str]| {
        let pixels = shown(folder.path(), "ball.bth", &[&["--mode", "path"][..], stops].concat());
        pixels.iter().map(|p| f64::from(p[1])).sum::<f64>() / pixels.len() as f64
    };
    let [dark, middle, bright] = ["-4", "-1", "3"].map(|stops| mean(&["--exposure", stops]));
    assert!(dark + 20.0 < middle && middle + 20.0 < bright, "{dark} {middle} {bright}");
    assert!((100.0..200.0).contains(&mean(&[])), "{}", mean(&[]));
    assert!(warned(folder.path(), "ball.bth", &["--exposure", "1"]).contains("--exposure changes nothing"));
}

#[test]
fn facets_look_smooth_below_the_crease_angle() {
    let folder = folder(&[("ball.obj", &sphere(12))]);
    bthc(folder.path(), &["compile", "ball.obj"]).expect(0);
    let normals = |degrees: &str| {
        let args = ["--mode", "normals", "--size", "96x72", "--spp", "1", "--smooth", degrees];
        let mut pixels = shown(folder.path(), "ball.bth", &args);
        pixels.sort_unstable();
        pixels.dedup();
        pixels.len()
    };
    let (flat, smooth) = (normals("0"), normals("30"));
    assert!(flat < 250 && smooth > 2 * flat, "{flat} colours, {smooth} smooth");
}

#[test]
fn noise_is_removed_unless_it_is_wanted() {
    let folder = folder(&[("ball.obj", &sphere(12))]);
    bthc(folder.path(), &["compile", "ball.obj"]).expect(0);
    let seen = |denoise: &str, spp: &str, threads: &str| {
        let mode = ["--mode", "path", "--exposure", "-1", "--size", "96x72", "--denoise", denoise];
        shown(folder.path(), "ball.bth", &[&mode[..], &["--spp", spp, "--threads", threads]].concat())
    };
    let truth = seen("off", "128", "2");
    let error = |picture: &[[u8; 3]]| {
        let far = |(a, b): (&[u8; 3], &[u8; 3])| f64::from(a[1].abs_diff(b[1])).powi(2);
        picture.iter().zip(&truth).map(far).sum::<f64>()
    };
    let (noisy, filtered) = (seen("off", "4", "1"), seen("on", "4", "1"));
    assert!(error(&filtered) < 0.6 * error(&noisy), "{} {}", error(&filtered), error(&noisy));
    assert!(filtered == seen("on", "4", "2"), "threads change nothing");
}

/// Tiles of two machines become the picture of one, byte by byte, also where noise is removed, over
/// the borders of tiles.
#[test]
fn tiles_become_the_picture_that_is_rendered_at_once() {
    let folder =
        folder(&[("ball.obj", &sphere(12)), ("s.manifest", &scene(false)), ("floor.obj", &floor(9.0))]);
    let path = folder.path();
    bthc(path, &["compile", "s.manifest", "-o", "s.bth", "-q"]).expect(0);
    let play = |args: &[&str]| {
        run("bth-play", path, &[&["s.bth", "--size", "150x70", "--spp", "2", "--json"], args].concat())
    };
    let bytes = |name: &str| std::fs::read(path.join(name)).expect("a picture");
    for mode in ["path", "shaded"] {
        let tiles = &["--mode", mode, "--tiles", "3x2"];
        play(&["--mode", mode, "-o", "whole.png"]).expect(0);
        for shard in ["1/2", "2/2"] {
            let done = play(&[&["-o", "a.png", "--shard", shard][..], tiles].concat()).expect(0).json();
            assert_eq!(done["frames"].as_array().map(Vec::len), Some(3), "{done}");
        }
        let again = play(&[&["-o", "a.png", "--shard", "1/2"][..], tiles].concat()).expect(0).json();
        assert_eq!(again["frames_skipped"], 3);
        // A tile that is cut off counts as missing.
        std::fs::write(path.join("a.3x2-5.png"), &bytes("a.3x2-5.png")[..60]).unwrap();
        let joined = play(&[&["-o", "a.png"][..], tiles].concat()).expect(0).json();
        let rendered = joined["frames"].as_array().expect("frames");
        assert!(rendered.len() == 1 && rendered[0]["tile"] == 5, "{joined}");
        assert!(bytes("a.png") == bytes("whole.png") && !path.join("a.3x2-1.png").exists(), "{mode}");
    }
    let numbered = ["-o", "####.png", "--tiles", "2x1", "--frames", "0..0", "--denoise", "off"];
    play(&numbered).expect(0);
    play(&["-o", "whole.png", "--denoise", "off"]).expect(0);
    assert!(bytes("0000.png") == bytes("whole.png"));
    for wrong in [
        &["-o", "a.gif", "--tiles", "2x2"][..],
        &["-o", "a.png", "--tiles", "2x2", "--mode", "steps"],
        &["-o", "a.png", "--tiles", "2x2", "--denoise", "oidn"],
        &["-o", "a.png", "--tiles", "0x2"],
        &["-o", "a.png", "--shard", "1/2"],
    ] {
        let run = play(wrong).expect(2);
        assert!(run.stderr.contains("--tiles"), "{run:?}");
    }
}

#[test]
fn videos_are_written_by_ffmpeg_or_the_lack_of_it_is_told() {
    let folder = folder(&[("ball.obj", &sphere(8))]);
    bthc(folder.path(), &["compile", "ball.obj"]).expect(0);
    let args = ["ball.bth", "-o", "a.mp4", "--size", "33x17", "--spp", "1"];
    let mut without = command("bth-play", folder.path(), &args);
    without.env("PATH", folder.path());
    let missing = run_with(without).expect(4).stderr;
    for part in ["a.mp4: BTH-P007", "ffmpeg, which is not on the PATH", "hint: install ffmpeg"] {
        assert!(missing.contains(part), "{missing}");
    }
    if std::process::Command::new("ffmpeg").arg("-version").output().is_err() {
        println!("skipped: there is no ffmpeg here to write a video");
        return;
    }
    run("bth-play", folder.path(), &args).expect(0);
    let video = std::fs::read(folder.path().join("a.mp4")).unwrap();
    assert_eq!(&video[4..8], b"ftyp");
    let names = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(names, 3, "nothing else stays");
}
