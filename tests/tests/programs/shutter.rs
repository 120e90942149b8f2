//! Motion blur of `bth-play --shutter`, against pictures of single times.

use crate::scenes::{compiled, run};
use crate::support::{folder, sphere};
use std::path::Path;

/// A ball that moves over the picture, turns and is scaled, with a moving camera, from 0 to 2
/// seconds.
fn moving(rate: u32) -> String {
    format!(
        r#"version = 1
frames = {{ last = {last}, rate = {rate} }}
camera = "eye"
objects = [{{ name = "ball", model = "ball.obj" }}]
nodes = [
    {{ name = "ball", object = "ball" }}, {{ name = "other", object = "ball", translation = [0, -1.5, -2] }},
    {{ name = "eye", translation = [0, 0, 7] }},
]
cameras = [{{ name = "eye", node = "eye", fov = 45 }}]
[[tracks]]
node = "ball"
property = "translation"
times = [0, 2]
values = [[-3, 0.5, 0], [3, 0, 1]]
[[tracks]]
node = "ball"
property = "rotation"
times = [0, 2]
values = [{{ axis = [0, 0, 1], degrees = 0 }}, {{ axis = [0, 0, 1], degrees = 150 }}]
[[tracks]]
node = "eye"
property = "translation"
times = [0, 2]
values = [[0, 0, 7], [0, 0.4, 6]]
"#,
        last = 2 * rate,
    )
}

/// Two files with the same motion: one with a frame each second, one with 128.
fn files() -> tempfile::TempDir {
    let (seconds, fine) = (moving(1), moving(128));
    let folder =
        folder(&[("ball.obj", &sphere(10)), ("seconds.manifest", &seconds), ("fine.manifest", &fine)]);
    for name in ["seconds.manifest", "fine.manifest"] {
        run("bthc", folder.path(), &["compile", name]).expect(0);
    }
    folder
}

/// The pixels of a picture.
fn pixels(path: &Path) -> Vec<u8> {
    let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut bytes).unwrap();
    bytes
}

/// A byte of a picture as linear light (IEC 61966-2-1).
fn linear(byte: u8) -> f64 {
    let value = f64::from(byte) / 255.0;
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

#[test]
fn blurred_pictures_are_the_mean_of_pictures_of_single_times() {
    let folder = files();
    let at = folder.path();
    for (mode, light) in [("normals", None), ("shaded", Some(linear as fn(u8) -> f64))] {
        let value = |byte: u8| light.map_or(f64::from(byte) / 255.0, |linear| linear(byte));
        let picture = |file: &str, frames: &str, output: &str, more: &[&str]| {
            let mut args = vec![
                file,
                "--size",
                "40x24",
                "--mode",
                mode,
                "--frames",
                frames,
                "-o",
                output,
                "--no-ground",
            ];
            args.extend(more);
            run("bth-play", at, &args).expect(0);
        };
        picture("seconds.bth", "1", "blurred.png", &["--shutter", "1", "--spp", "256"]);
        picture("seconds.bth", "1", "sharp.png", &["--spp", "256"]);
        picture("fine.bth", "65..191", "fine/####.png", &["--spp", "8", "--force"]);
        let (blurred, sharp) = (pixels(&at.join("blurred.png")), pixels(&at.join("sharp.png")));
        let mut mean = vec![0.0; blurred.len()];
        // A shutter of one frame around the time of 1 second: the middles of 64 parts of the time
        // from 0.5 to 1.5 seconds.
        for frame in (65..192).step_by(2) {
            let still = pixels(&at.join(format!("fine/{frame:04}.png")));
            mean.iter_mut().zip(still).for_each(|(sum, byte)| *sum += value(byte) / 64.0);
        }
        let difference = |picture: &[u8]| {
            let sum: f64 = picture.iter().zip(&mean).map(|(byte, mean)| (value(*byte) - mean).abs()).sum();
            sum / mean.len() as f64
        };
        let (blurred, sharp) = (difference(&blurred), difference(&sharp));
        println!("{mode}: mean difference {blurred:.5}, without a shutter {sharp:.5}");
        assert!(blurred < 0.006 && sharp > 8.0 * blurred, "{mode}: {blurred} {sharp}");
    }
}

#[test]
fn blurred_pictures_depend_neither_on_threads_nor_on_the_instruction_set() {
    let folder = compiled();
    for mode in ["shaded", "normals", "ao", "steps", "path", "instances", "clay"] {
        let picture = |more: &[&str]| {
            let mut args = vec!["scene.bth", "--size", "48x27", "--spp", "3", "--frames", "2", "-o", "x.png"];
            args.extend(["--mode", mode]);
            args.extend(more);
            run("bth-play", folder.path(), &args).expect(0);
            std::fs::read(folder.path().join("x.png")).unwrap()
        };
        let one = picture(&["--shutter", "0.9", "--threads", "1"]);
        assert!(one == picture(&["--shutter", "0.9", "--threads", "3"]), "{mode}");
        if mode != "steps" {
            assert!(one == picture(&["--shutter", "0.9", "--isa", "scalar"]), "{mode}");
        }
        assert!(one != picture(&[]), "{mode} shows the motion");
    }
}

#[test]
fn shutters_are_reported_checked_and_without_effect_where_nothing_moves() {
    let folder = files();
    let still = sphere(8);
    std::fs::write(folder.path().join("still.obj"), still).unwrap();
    run("bthc", folder.path(), &["compile", "still.obj"]).expect(0);
    let play = |file: &str, more: &[&str]| {
        let mut args = vec![file, "--size", "20x12", "--spp", "4", "-o", "x.png", "--json"];
        args.extend(more);
        run("bth-play", folder.path(), &args)
    };
    let json = play("seconds.bth", &["--frames", "1", "--shutter", "0.5"]).expect(0).json();
    assert_eq!((&json["shutter"], &json["frame"]["times"]), (&0.5.into(), &64.into()), "{json:#}");
    assert_eq!(json["frame"]["nearest_rays"].as_u64().map(|rays| rays >= 20 * 12 * 4), Some(true));
    let json = play("seconds.bth", &["--frames", "1"]).expect(0).json();
    assert_eq!(
        (&json["shutter"], &json["frame"]["times"]),
        (&serde_json::Value::Null, &1.into()),
        "{json:#}"
    );
    let mut pictures = Vec::new();
    for more in [&[][..], &["--shutter", "0.5"]] {
        play("still.bth", more).expect(0);
        pictures.push(std::fs::read(folder.path().join("x.png")).unwrap());
    }
    assert!(pictures[0] == pictures[1]);
    for wrong in ["0", "-1", "nan", "inf", "half"] {
        play("seconds.bth", &[&format!("--shutter={wrong}")]).expect(2);
    }
}
