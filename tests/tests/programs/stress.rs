//! Many processes and one store, with random kills: no damaged entry is used, no partial file stays, and the store verifies.

use crate::cache::{cached, scene};
use crate::support::{command, run_with};
use bth_random::Rng;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

/// Seconds that the processes run; a minute for the full measure.
fn seconds() -> f64 {
    let set = std::env::var("BTH_STRESS_SECONDS").ok();
    set.map_or(4.0, |text| text.parse().expect("BTH_STRESS_SECONDS is a number"))
}

/// Everything below a folder but locks.
fn files(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => found.extend(files(&path)),
            false => found.push(path.file_name().unwrap().to_string_lossy().into_owned()),
        }
    }
    found
}

#[test]
fn eight_processes_with_random_kills_leave_a_store_that_verifies() {
    let folder = scene(6);
    let path = folder.path();
    let inputs: Vec<String> = (0..6).map(|i| format!("{i}.obj")).chain(["s.manifest".into()]).collect();
    let options: [&[&str]; 3] =
        [&["--min-tet-triangles", "64"], &["--structure", "bvh"], &["--quality", "best"]];
    // The expected outputs, compiled without a cache.
    let mut expected = std::collections::HashMap::new();
    for input in &inputs {
        for (i, options) in options.iter().enumerate() {
            let args = [&["compile", input, "-o", "expected.bth", "-q", "--no-cache"], *options].concat();
            cached(path, &args).expect(0);
            expected.insert((input.as_str(), i), std::fs::read(path.join("expected.bth")).unwrap());
        }
    }
    let temporary = &path.join("temporary");
    std::fs::create_dir(temporary).unwrap();
    let end = Instant::now() + Duration::from_secs_f64(seconds());
    let (inputs, options, expected) = (&inputs, &options, &expected);
    let (kills, whole) = std::thread::scope(|scope| {
        let process = |number: u64| {
            move || {
                let mut rng = Rng::new(number);
                let (mut kills, mut whole) = (0, 0);
                while Instant::now() < end {
                    let input = &inputs[rng.below(inputs.len() as u64) as usize];
                    let choice = rng.below(3) as usize;
                    let output = format!("out-{number}.bth");
                    // The store is small, so that entries are evicted while other processes read them.
                    let args =
                        ["compile", input, "-o", &output, "-q", "--cache-size", "400k", "--threads", "1"];
                    let mut command = command("bthc", path, &[&args, options[choice]].concat());
                    command.env_remove("BTH_NO_CACHE").env("BTH_CACHE_DIR", path.join("cache"));
                    command.env("TMPDIR", temporary);
                    let mut child = command.stderr(Stdio::piped()).spawn().unwrap();
                    if rng.below(2) == 0 {
                        std::thread::sleep(Duration::from_millis(rng.below(60)));
                        kills += u32::from(child.try_wait().unwrap().is_none());
                        child.kill().unwrap();
                    }
                    let done = child.wait_with_output().unwrap();
                    let said = String::from_utf8_lossy(&done.stderr);
                    assert!(!said.contains("damaged"), "{said}");
                    if done.status.success() {
                        whole += 1;
                        let bytes = std::fs::read(path.join(&output)).unwrap();
                        assert!(
                            bytes == expected[&(input.as_str(), choice)],
                            "{input} {:?}",
                            options[choice]
                        );
                    }
                    // A later compilation may reuse unchanged objects of an output that is left in place.
                    if rng.below(2) == 0 {
                        let _ = std::fs::remove_file(path.join(&output));
                    }
                }
                (kills, whole)
            }
        };
        let running: Vec<_> = (0..8).map(|number| scope.spawn(process(number))).collect();
        let ended = running.into_iter().map(|thread| thread.join().unwrap());
        ended.fold((0, 0), |a, b| (a.0 + b.0, a.1 + b.1))
    });
    println!("{whole} compilations ended, {kills} were killed");
    assert!(kills > 0 && whole > 0);
    assert_eq!(
        files(temporary),
        [""; 0],
        "killed compilers and their workers leave nothing, not even folders"
    );
    assert_eq!(std::fs::read_dir(temporary).unwrap().count(), 0);
    let partial = |name: &String| name.ends_with(".bth-part");
    let left = || files(&path.join("cache")).into_iter().filter(partial).collect::<Vec<_>>();
    // There are none on systems where files can be written without a name.
    println!("{} unfinished files before verification", left().len());
    let verdict = cached(path, &["cache", "verify", "--json"]).expect(0).json();
    assert_eq!(verdict["damaged"], serde_json::json!([]));
    assert_eq!(left(), [""; 0]);
    let size = cached(path, &["cache", "gc", "--cache-size", "400k", "--json"]).expect(0).json();
    assert!(size["left_bytes"].as_u64().unwrap() <= 400 << 10, "{size}");
}

#[test]
fn two_compilations_of_one_model_do_the_work_once() {
    let folder = crate::support::folder(&[("a.obj", &crate::support::sphere(96))]);
    let path = folder.path();
    let start = |output: &'static str| {
        let args = ["compile", "a.obj", "-o", output, "--json", "--quality", "best"];
        let mut command = command("bthc", path, &args);
        command.env_remove("BTH_NO_CACHE").env("BTH_CACHE_DIR", path.join("cache"));
        command
    };
    let runs = std::thread::scope(|scope| {
        let outputs = ["1.bth", "2.bth", "3.bth", "4.bth"];
        let running = outputs.map(|output| scope.spawn(move || run_with(start(output))));
        running.into_iter().map(|thread| thread.join().unwrap().expect(0).json()).collect::<Vec<_>>()
    });
    let built = runs.iter().filter(|json| json["cache"]["hit"] == false).count();
    assert_eq!(built, 1, "one worked, the others waited");
    let read = |name: &str| std::fs::read(path.join(name)).unwrap();
    assert!(
        read("1.bth") == read("2.bth") && read("3.bth") == read("4.bth") && read("1.bth") == read("4.bth")
    );
}

#[test]
fn two_scenes_with_an_object_in_common_build_it_once() {
    let manifest = |name: &str| {
        format!(
            "version = 1\n[[objects]]\nname = \"o\"\nmodel = \"a.obj\"\n[[nodes]]\nname = \"{name}\"\nobject = \"o\"\n"
        )
    };
    let scenes = ["1.manifest", "2.manifest", "3.manifest"];
    let folder = crate::support::folder(&[("a.obj", &crate::support::sphere(96))]);
    let path = folder.path();
    scenes.iter().for_each(|scene| std::fs::write(path.join(scene), manifest(scene)).unwrap());
    let compile = |scene| {
        let args = ["compile", scene, "--json", "--quality", "best"];
        cached(path, &args).expect(0).json()
    };
    let runs = std::thread::scope(|scope| {
        let running = scenes.map(|scene| scope.spawn(move || compile(scene)));
        running.map(|thread| thread.join().unwrap())
    });
    let missed = |json: &&serde_json::Value| {
        json["cache"]["misses"].as_array().unwrap().iter().any(|miss| miss["stage"] == "object")
    };
    assert_eq!(runs.iter().filter(missed).count(), 1, "one worked, the others waited");
}
