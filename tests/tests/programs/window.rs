//! The window of `bth-play` on a virtual display, driven by its keys.

use crate::scenes::{compiled, run};
use crate::support::{command, wait};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(60);

/// A virtual display, which ends when the value is dropped.
struct Display {
    server: Child,
    name: String,
}

impl Display {
    /// Starts a display that keeps its screen in a file of the folder; `None`, and a printed
    /// reason, where that is impossible.
    fn start(folder: &Path) -> Option<Display> {
        let there = |program: &str, arg: &str| {
            let found = Command::new(program).arg(arg).stdout(Stdio::null()).stderr(Stdio::null()).status();
            found.is_ok()
        };
        if !there("Xvfb", "-help") || !there("xdotool", "version") {
            println!("SKIPPED: the window, for want of Xvfb or xdotool");
            return None;
        }
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "320x240x24", "-nolisten", "tcp", "-fbdir"])
            .arg(folder)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut number = String::new();
        let out = server.stdout.take().unwrap();
        std::io::BufRead::read_line(&mut std::io::BufReader::new(out), &mut number).unwrap();
        assert!(!number.trim().is_empty(), "Xvfb starts");
        Some(Display { server, name: format!(":{}", number.trim()) })
    }

    /// What xdotool prints; empty where it fails.
    fn xdotool(&self, args: &[&str]) -> String {
        let output = Command::new("xdotool").args(args).env("DISPLAY", &self.name).output().unwrap();
        String::from_utf8_lossy(&output.stdout).trim().to_owned()
    }

    /// The command that starts the player on this display.
    fn play(&self, folder: &Path, args: &[&str]) -> Command {
        let mut all = vec!["scene.bth", "--window", "--size", "96x54", "--spp", "1", "--json"];
        all.extend(args);
        let mut play = command("bth-play", folder, &all);
        play.env("DISPLAY", &self.name).env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
        play
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// Polls until there is a value.
#[track_caller]
fn until<T>(what: &str, mut ask: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(answer) = ask() {
            return answer;
        }
        assert!(start.elapsed() < LIMIT, "{what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// A pixel of the screen that Xvfb keeps in a folder (XWD: a header of big-endian words, colours,
/// rows of words).
fn screen(folder: &Path) -> impl Fn(usize, usize) -> [u8; 3] {
    let bytes = std::fs::read(folder.join("Xvfb_screen0")).unwrap();
    let word = |i: usize| u32::from_be_bytes(bytes[4 * i..4 * i + 4].try_into().unwrap()) as usize;
    let (start, row, little) = (word(0) + 12 * word(19), word(12), word(7) == 0);
    assert_eq!(word(11), 32, "bits of a pixel");
    move |x, y| {
        let at = start + y * row + 4 * x;
        if little {
            [bytes[at + 2], bytes[at + 1], bytes[at]]
        } else {
            [bytes[at + 1], bytes[at + 2], bytes[at + 3]]
        }
    }
}

/// The pixels of a picture.
fn picture(path: &Path) -> (usize, usize, Vec<u8>) {
    let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut bytes).unwrap();
    (reader.info().width as usize, reader.info().height as usize, bytes)
}

#[test]
fn keys_move_the_window_and_it_shows_what_pictures_show() {
    let folder = compiled();
    let Some(display) = Display::start(folder.path()) else { return };
    let mut play = display.play(folder.path(), &["--screenshot", "shot.png"]);
    let mut child = play.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let window = until("there is a window", || {
        let found = display.xdotool(&["search", "--name", "frame 0 of 5 - shaded.*1 of 1 samples"]);
        (!found.is_empty()).then_some(found)
    });
    until("it takes the keys", || {
        display.xdotool(&["windowfocus", &window]);
        display.xdotool(&["key", "2"]);
        display.xdotool(&["getwindowname", &window]).contains("- normals -").then_some(())
    });
    display.xdotool(&["key", "Right"]);
    let title = until("the next frame is shown", || {
        let title = display.xdotool(&["getwindowname", &window]);
        title.contains("frame 1 of 5 - normals").then_some(title)
    });
    assert!(title.starts_with("scene.bth - bth-play - ") && title.contains(" fps"), "{title}");
    display.xdotool(&["key", "p"]);
    let shot = until("the picture is saved", || std::fs::read(folder.path().join("shot.png")).ok());
    let args =
        ["scene.bth", "--size", "96x54", "--spp", "1", "--mode", "normals", "--frames", "1", "-o", "x.png"];
    run("bth-play", folder.path(), &args).expect(0);
    assert!(shot == std::fs::read(folder.path().join("x.png")).unwrap(), "what -o writes");

    // The screen shows the same pixels, except for the playback bar.
    let (width, height, pixels) = picture(&folder.path().join("x.png"));
    assert_eq!((width, height), (96, 54));
    let shown = screen(folder.path());
    for y in 0..height - 5 {
        for x in 0..width {
            assert_eq!(shown(x, y), pixels[3 * (y * width + x)..][..3], "{x} {y}");
        }
    }
    assert_ne!(shown(0, height - 1), shown(width - 1, height - 1), "the bar shows the part that has passed");

    display.xdotool(&[
        "mousemove",
        "40",
        "20",
        "mousedown",
        "1",
        "mousemove",
        "60",
        "25",
        "mouseup",
        "1",
        "key",
        "p",
    ]);
    until("the user's camera sees something else", || {
        let now = std::fs::read(folder.path().join("shot.png")).ok()?;
        display.xdotool(&["key", "p"]);
        (now != shot && now.ends_with(b"IEND\xaeB`\x82")).then_some(())
    });
    display.xdotool(&["key", "Escape"]);
    let ended = wait(&mut child, LIMIT).expect("Escape closes the window");
    let output = child.wait_with_output().unwrap();
    assert!(ended.success(), "{output:?}");
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&json["window"]["frame"], &json["window"]["mode"]), (&1.into(), &"normals".into()), "{json}");
}

#[test]
fn windows_close_after_so_many_pictures_with_the_last_of_them() {
    let folder = compiled();
    let Some(display) = Display::start(folder.path()) else { return };
    let mut pictures = Vec::new();
    for (count, shutter) in [("1", None), ("4", None), ("4", Some("--shutter=0.8"))] {
        let mut args =
            vec!["--window-frames", count, "--screenshot", "shot.png", "--mode", "path", "--frames", "3"];
        args.extend(shutter);
        let output = display.play(folder.path(), &args).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(json["window"]["pictures"].to_string(), count);
        let shown = std::fs::read(folder.path().join("shot.png")).unwrap();
        assert!(!pictures.contains(&shown), "more samples and a shutter make other pictures");
        // The window converges to the picture of as many samples, to the bit.
        let mut args = vec![
            "scene.bth",
            "--size",
            "96x54",
            "--spp",
            count,
            "--mode",
            "path",
            "--frames",
            "3",
            "-o",
            "x.png",
        ];
        args.extend(shutter);
        run("bth-play", folder.path(), &args).expect(0);
        assert!(shown == std::fs::read(folder.path().join("x.png")).unwrap(), "{count} samples, {shutter:?}");
        pictures.push(shown);
    }
}

#[test]
fn without_a_display_the_window_is_refused() {
    let folder = compiled();
    let mut play = command("bth-play", folder.path(), &["scene.bth", "--window"]);
    play.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
    let output = play.output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(4), "{message}");
    assert!(message.contains("BTH-P004") && message.contains("-o writes pictures"), "{message}");
    for args in [
        &["scene.bth"][..],
        &["scene.bth", "--window", "-o", "x.png"],
        &["scene.bth", "-o", "x.png", "--screenshot", "y.png"],
    ] {
        run("bth-play", folder.path(), args).expect(2);
    }
}
