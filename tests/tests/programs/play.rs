//! `bth-play`: pictures of every mode, the same with any number of threads.

use crate::support::{bthc, folder, run, sphere};
use std::path::Path;

fn play(folder: &Path, args: &[&str]) -> crate::support::Run {
    let mut all = vec!["ball.bth", "-o", "out.png", "--size", "50x37", "--spp", "2"];
    all.extend(args);
    run("bth-play", folder, &all)
}

fn picture(folder: &Path, args: &[&str]) -> Vec<u8> {
    play(folder, args).expect(0);
    std::fs::read(folder.join("out.png")).unwrap()
}

/// Width and height in the header of a PNG file.
fn size(png: &[u8]) -> (u32, u32) {
    assert_eq!(&png[..8], b"\x89PNG\r\n\x1a\n");
    let number = |at: usize| u32::from_be_bytes(png[at..at + 4].try_into().unwrap());
    (number(16), number(20))
}

#[test]
fn picture_has_the_right_size_and_does_not_depend_on_threads() {
    let folder = folder(&[("ball.obj", &sphere(16))]);
    bthc(folder.path(), &["compile", "ball.obj"]).expect(0);
    let mut pictures = Vec::new();
    for mode in ["shaded", "normals", "ao", "steps"] {
        let one = picture(folder.path(), &["--mode", mode, "--threads", "1"]);
        assert_eq!(size(&one), (50, 37));
        assert!(one == picture(folder.path(), &["--mode", mode, "--threads", "2"]), "{mode}");
        assert!(!pictures.contains(&one), "{mode} looks like another mode");
        pictures.push(one);
    }
    let read = picture(folder.path(), &["--read"]);
    assert!(read == pictures[0]);
    let names: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(names.len(), 3, "{names:?}");
}

#[test]
fn cameras_differ_and_look_from_inside_too() {
    let folder = folder(&[("ball.obj", &sphere(16))]);
    bthc(folder.path(), &["compile", "ball.obj"]).expect(0);
    let cameras = [
        &[][..],
        &["--yaw", "-120", "--pitch", "60"],
        &["--inside"],
        &["--camera", "0,0,3,0,0,-1"],
        &["--zoom", "3"],
        &["--up", "z"],
        &["--pitch", "90"],
    ];
    let mut pictures: Vec<Vec<u8>> = cameras.iter().map(|args| picture(folder.path(), args)).collect();
    pictures.sort();
    pictures.dedup();
    assert_eq!(pictures.len(), cameras.len());
}

#[test]
fn json_reports_time_and_rays() {
    let folder = folder(&[("ball.obj", &sphere(16))]);
    bthc(folder.path(), &["compile", "ball.obj"]).expect(0);
    let json = play(folder.path(), &["--mode", "steps", "--json"]).expect(0).json();
    assert_eq!(json["frame"]["nearest_rays"], 50 * 37 * 2);
    assert!(json["frame"]["steps"]["nodes"].as_f64().is_some_and(|n| n > 0.0), "{json:#}");
    assert!(json["rays_per_second"].as_f64().is_some_and(|n| n > 0.0), "{json:#}");
}

#[test]
fn files_without_geometry_look_the_same_but_for_smooth_normals() {
    let folder = folder(&[("ball.obj", &sphere(16))]);
    let mut pictures = Vec::new();
    for options in [&[][..], &["--no-geometry"]] {
        bthc(folder.path(), &[&["compile", "ball.obj"][..], options].concat()).expect(0);
        for mode in ["shaded", "ao", "path"] {
            // The default camera is chosen by the vertices.
            play(folder.path(), &["--mode", mode, "--smooth", "0", "--camera", "0,-3,1,0,0,0"]).expect(0);
            pictures.push(std::fs::read(folder.path().join("out.png")).expect("a picture"));
        }
    }
    let (whole, bare) = pictures.split_at(3);
    assert!(whole == bare && whole[0] != whole[1]);
}

#[test]
fn model_without_triangles_gives_an_empty_picture() {
    let folder = folder(&[("ball.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")]);
    bthc(folder.path(), &["compile", "ball.obj"]).expect(0);
    for mode in ["shaded", "normals", "ao", "steps"] {
        play(folder.path(), &["--mode", mode]).expect(0);
        play(folder.path(), &["--mode", mode, "--inside"]).expect(0);
    }
}

#[test]
fn frames_that_a_model_does_not_have_are_named() {
    let folder = folder(&[("ball.obj", &sphere(16))]);
    bthc(folder.path(), &["compile", "ball.obj"]).expect(0);
    play(folder.path(), &["--frames", "0"]).expect(0);
    for (frames, found) in [("5", "frame 5 alone"), ("0..3", "frames 0 to 3")] {
        let refused = play(folder.path(), &["--frames", frames]).expect(2).stderr;
        let text = format!("ball.bth has frame 0 alone; expected frames of it, found {found}");
        assert!(refused.contains(&text), "{refused}");
    }
}

#[test]
fn help_lists_all_exit_codes() {
    let folder = folder(&[]);
    let lists = |program: &str| {
        let help = run(program, folder.path(), &["--help"]).expect(0).stdout;
        let codes = help.lines().skip_while(|line| *line != "Exit codes:").skip(1);
        codes.map(|line| line.split_whitespace().next().unwrap_or_default().to_owned()).collect::<Vec<_>>()
    };
    // Those of models that bth-play compiles are the compiler's, except that nothing is checked.
    let compiler = lists("bthc");
    assert_eq!(compiler, ["0", "1", "2", "3", "4", "5", "70", "130"]);
    assert_eq!(lists("bth-play"), compiler.into_iter().filter(|code| code != "1").collect::<Vec<_>>());
}

#[test]
fn options_and_files_that_show_nothing_are_warned_of() {
    let empty = "version = 1\nobjects = [{ name = \"none\", model = \"none.obj\" }]\n[[nodes]]\nname = \"n\"\nobject = \"none\"\n";
    let folder = folder(&[("ball.obj", &sphere(16)), ("none.obj", "v 0 0 0\n"), ("none.manifest", empty)]);
    bthc(folder.path(), &["compile", "ball.obj", "none.obj"]).expect(0);
    bthc(folder.path(), &["compile", "none.manifest", "-o", "scene.bth"]).expect(0);
    let stderr = |args: &[&str]| play(folder.path(), args).expect(0).stderr;
    assert_eq!(stderr(&["--fov", "40"]), "");
    assert_eq!(stderr(&["--mode", "path", "--bounces", "1"]), "");
    assert_eq!(stderr(&["--mode", "steps", "--scale", "9"]), "");
    assert!(stderr(&["--bounces", "1"]).contains("warning: ball.bth: --bounces changes nothing"));
    assert!(stderr(&["--scale", "9"]).contains("warning: ball.bth: --scale changes nothing"));
    let seen_from = |eye: &str| stderr(&["--camera", &format!("{eye},0,0,0,0,0")]);
    assert_eq!(seen_from("3.4e38"), "");
    assert!(seen_from("1e39").contains("warning: ball.bth: the camera is farther from the origin than f32"));
    for (file, what) in
        [("none.bth", "the model has no triangles"), ("scene.bth", "no frame shows a triangle")]
    {
        let args = [file, "-o", "none.png", "--size", "8x8", "--spp", "1"];
        let told = run("bth-play", folder.path(), &args).expect(0).stderr;
        assert!(told.contains(&format!("warning: {file}: {what}")), "{told}");
    }
}
