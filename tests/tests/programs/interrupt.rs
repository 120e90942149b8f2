//! Whenever the compiler is interrupted, its output is complete or absent.

use crate::support::{bthc, command, folder, sphere, wait};
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

/// Files of a folder other than these.
fn litter(folder: &Path, expected: &[&str]) -> Vec<String> {
    let names = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
    names.filter(|name| !expected.contains(&name.as_str())).collect()
}

fn check_output(folder: &Path) {
    if folder.join("ball.bth").exists() {
        bthc(folder, &["verify", "ball.bth"]).expect(0);
    }
}

#[test]
fn killed_compilation_leaves_a_whole_output_or_none() {
    let folder = folder(&[("ball.obj", &sphere(64))]);
    // From before the program has started to after it has ended.
    for milliseconds in [0, 3, 10, 20, 40, 60, 90, 130, 200, 300, 500, 800] {
        let mut child = command("bthc", folder.path(), &["compile", "ball.obj", "--quiet"]).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(milliseconds));
        child.kill().unwrap();
        child.wait().unwrap();
        check_output(folder.path());
        let _ = std::fs::remove_file(folder.path().join("ball.bth"));
    }
    // At worst a hidden unfinished file stays behind, which the next run removes.
    bthc(folder.path(), &["compile", "ball.obj", "--quiet"]).expect(0);
    assert_eq!(litter(folder.path(), &["ball.obj", "ball.bth"]), [""; 0]);
}

#[cfg(unix)]
#[test]
fn interrupted_compilation_exits_130_and_leaves_nothing() {
    let folder = folder(&[("ball.obj", &sphere(160))]);
    let mut interrupted = 0;
    for milliseconds in [40, 80, 120, 160, 200, 300] {
        let mut child =
            command("bthc", folder.path(), &["compile", "ball.obj", "--quiet", "--quality", "best"]);
        let mut child = child.stderr(Stdio::null()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(milliseconds));
        let pid = child.id().to_string();
        let sent = std::process::Command::new("kill").args(["-INT", &pid]).status().unwrap();
        let status = wait(&mut child, Duration::from_secs(60)).expect("ends soon after Ctrl-C");
        if status.code() == Some(130) {
            interrupted += 1;
            assert_eq!(litter(folder.path(), &["ball.obj"]), [""; 0]);
        } else {
            // It had ended before, or the signal came before its handler was installed.
            let unheard = std::os::unix::process::ExitStatusExt::signal(&status) == Some(2);
            assert!(status.success() || unheard || !sent.success(), "{status:?}");
            check_output(folder.path());
            let _ = std::fs::remove_file(folder.path().join("ball.bth"));
        }
    }
    assert!(interrupted > 0, "no interrupt met the compiler at work");
}

/// While it waits for standard input, nothing polls.
#[cfg(unix)]
#[test]
fn a_command_that_waits_for_its_input_is_cancelled() {
    let folder = folder(&[]);
    for signal in ["-INT", "-TERM", "-HUP"] {
        if signal == "-HUP" && bth_files::signals::is_ignored(1) {
            println!("skipped: a hangup, which nohup keeps from what it starts");
            continue;
        }
        let mut command = command("bthc", folder.path(), &["compile", "-", "-o", "a.bth", "--json"]);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        std::thread::sleep(Duration::from_millis(500));
        send(signal, &child);
        let status = wait(&mut child, Duration::from_secs(20)).expect("ends soon after the signal");
        assert_eq!(status.code(), Some(130), "{signal}");
        let json: serde_json::Value = serde_json::from_reader(child.stdout.take().unwrap()).unwrap();
        assert_eq!(json["error"]["code"], "BTH-C000");
    }
}

#[cfg(unix)]
fn send(signal: &str, child: &std::process::Child) {
    let sent = std::process::Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
}

/// `timeout` sends two signals, since it sends one to the group, too. A second one ends the program
/// at once.
#[cfg(unix)]
#[test]
fn two_signals_leave_an_error_and_no_copy_of_the_input() {
    let (folder, copies) = (folder(&[("ball.obj", &sphere(160))]), tempfile::tempdir().unwrap());
    let mut ended = 0;
    for milliseconds in [40, 80, 120, 160, 200, 300] {
        let args = ["compile", "-", "--format", "obj", "-o", "a.bth", "--json", "--quality", "best"];
        let mut command = command("bthc", folder.path(), &args);
        command.stdin(std::fs::File::open(folder.path().join("ball.obj")).unwrap());
        command.env("TMPDIR", copies.path()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut child = command.spawn().unwrap();
        std::thread::sleep(Duration::from_millis(milliseconds));
        send("-TERM", &child);
        send("-TERM", &child);
        let status = wait(&mut child, Duration::from_secs(60)).expect("ends soon after the signals");
        if status.code() == Some(130) {
            ended += 1;
            let json: serde_json::Value = serde_json::from_reader(child.stdout.take().unwrap()).unwrap();
            assert_eq!(json["error"]["code"], "BTH-C000");
        } else {
            // It had ended before, or the signals came before the handler was installed.
            let unheard = std::os::unix::process::ExitStatusExt::signal(&status) == Some(15);
            assert!(status.success() || unheard, "{status:?}");
            let _ = std::fs::remove_file(folder.path().join("a.bth"));
        }
        assert_eq!(litter(copies.path(), &[]), [""; 0]);
    }
    assert!(ended > 0, "no signal met the compiler at work");
}

/// `nohup bthc ...` goes on after the terminal is closed.
#[cfg(unix)]
#[test]
fn an_ignored_hangup_stays_ignored() {
    let folder = folder(&[]);
    let bthc = command("bthc", folder.path(), &[]).get_program().to_owned();
    let mut shell = std::process::Command::new("sh");
    shell.args(["-c", "trap '' HUP; exec \"$0\" compile - -o a.bth"]).arg(bthc);
    let mut child = shell.stdin(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    std::thread::sleep(Duration::from_millis(500));
    send("-HUP", &child);
    std::thread::sleep(Duration::from_millis(500));
    assert!(child.try_wait().unwrap().is_none(), "the hangup ended it");
    send("-TERM", &child);
    let status = wait(&mut child, Duration::from_secs(20)).expect("ends soon after the signal");
    assert_eq!(status.code(), Some(130));
}

#[test]
fn compilation_ends_with_its_input_where_that_is_asked_for() {
    let folder = folder(&[("ball.obj", &sphere(160))]);
    let mut ended = 0;
    for milliseconds in [0, 40, 80, 120, 160, 200] {
        let args = ["compile", "ball.obj", "--quiet", "--quality", "best", "--end-with-input"];
        let mut child = command("bthc", folder.path(), &args);
        let mut child = child.stdin(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(milliseconds));
        drop(child.stdin.take());
        let status = wait(&mut child, Duration::from_secs(60)).expect("ends soon after its input");
        if status.code() == Some(130) {
            ended += 1;
            assert_eq!(litter(folder.path(), &["ball.obj"]), [""; 0]);
        } else {
            assert!(status.success(), "{status:?}");
            check_output(folder.path());
            let _ = std::fs::remove_file(folder.path().join("ball.bth"));
        }
    }
    assert!(ended > 0, "no end of the input met the compiler at work");
}

#[cfg(unix)]
#[test]
fn an_interrupted_player_exits_130_and_leaves_nothing() {
    let folder = folder(&[("ball.obj", &sphere(32))]);
    bthc(folder.path(), &["compile", "ball.obj", "--quiet"]).expect(0);
    let mut interrupted = std::collections::HashSet::new();
    let moments = [50, 100, 200, 300, 400, 600, 800];
    let both = moments.into_iter().flat_map(|moment| [(moment, "-INT"), (moment, "-TERM")]);
    for (milliseconds, signal) in both {
        let args = ["ball.bth", "-o", "a.png", "--size", "3000x3000", "--spp", "1", "--json"];
        let mut child = command("bth-play", folder.path(), &args);
        let child = child.stderr(Stdio::null()).stdout(Stdio::piped()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(milliseconds));
        let sent =
            std::process::Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
        let output = child.wait_with_output().unwrap();
        if output.status.code() == Some(130) {
            interrupted.insert(signal);
            let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
            assert_eq!(json["error"]["code"], "BTH-C000");
            assert_eq!(litter(folder.path(), &["ball.obj", "ball.bth", "a.png"]), [""; 0]);
        } else {
            let unheard = std::os::unix::process::ExitStatusExt::signal(&output.status).is_some();
            assert!(output.status.success() || unheard || !sent.success(), "{output:?}");
        }
        let _ = std::fs::remove_file(folder.path().join("a.png"));
    }
    assert_eq!(interrupted.len(), 2, "no interrupt met the player at work");
}
