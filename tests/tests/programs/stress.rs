//! Many processes and one store, with random kills: no damaged entry is used, no partial file
//! stays, and the store verifies.

use crate::cache::{cached, scene};
use crate::support::{command, run_with};
use bth_random::Rng;
use std::collections::HashMap;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

/// Seconds that the processes run; a minute for the full measure.
fn seconds() -> f64 {
    let set = std::env::var("BTH_STRESS_SECONDS").ok();
    set.map_or(4.0, |text| text.parse().expect("BTH_STRESS_SECONDS is a number"))
}

/// Names of all files below a folder.
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

/// A scene with its models, the options to compile them with, and the outputs without a cache.
struct Corpus {
    folder: tempfile::TempDir,
    inputs: Vec<String>,
    /// The file for each input and each row of [`OPTIONS`].
    expected: HashMap<(String, usize), Vec<u8>>,
}

const OPTIONS: [&[&str]; 3] =
    [&["--set", "min-tet-triangles=64"], &["--structure", "bvh"], &["--quality", "best"]];

impl Corpus {
    fn new() -> Corpus {
        let folder = scene(6);
        let inputs: Vec<String> = (0..6).map(|i| format!("{i}.obj")).chain(["s.manifest".into()]).collect();
        let mut expected = HashMap::new();
        for input in &inputs {
            for (row, options) in OPTIONS.iter().enumerate() {
                let args = [&["compile", input, "-o", "expected.bth", "-q", "--no-cache"], *options].concat();
                cached(folder.path(), &args).expect(0);
                let bytes = std::fs::read(folder.path().join("expected.bth")).unwrap();
                expected.insert((input.clone(), row), bytes);
            }
        }
        std::fs::create_dir(folder.path().join("temporary")).unwrap();
        Corpus { folder, inputs, expected }
    }

    /// Compiles inputs of a seeded sequence one after another until `end`, kills the compiler in
    /// about half of the runs, and checks every output. Returns the numbers of runs that were
    /// killed and that ended.
    fn compile_until(&self, end: Instant, number: u64) -> (u32, u32) {
        let path = self.folder.path();
        let output = format!("out-{number}.bth");
        let mut rng = Rng::new(number);
        let (mut killed, mut ended) = (0, 0);
        while Instant::now() < end {
            let input = &self.inputs[rng.below(self.inputs.len() as u64) as usize];
            let row = rng.below(3) as usize;
            // The store is small, so that entries are evicted while other processes read them.
            let args = ["compile", input, "-o", &output, "-q", "--cache-size", "400k", "--threads", "1"];
            let mut command = command("bthc", path, &[&args, OPTIONS[row]].concat());
            command.env_remove("BTH_NO_CACHE").env("BTH_CACHE_DIR", path.join("cache"));
            command.env("TMPDIR", path.join("temporary"));
            let mut child = command.stderr(Stdio::piped()).spawn().unwrap();
            if rng.below(2) == 0 {
                std::thread::sleep(Duration::from_millis(rng.below(60)));
                killed += u32::from(child.try_wait().unwrap().is_none());
                child.kill().unwrap();
            }
            let done = child.wait_with_output().unwrap();
            let stderr = String::from_utf8_lossy(&done.stderr);
            assert!(!stderr.contains("damaged"), "{stderr}");
            if done.status.success() {
                ended += 1;
                let bytes = std::fs::read(path.join(&output)).unwrap();
                assert!(bytes == self.expected[&(input.clone(), row)], "{input} {:?}", OPTIONS[row]);
            }
            // A later compilation may reuse unchanged objects of an output that is left in place.
            if rng.below(2) == 0 {
                let _ = std::fs::remove_file(path.join(&output));
            }
        }
        (killed, ended)
    }
}

#[test]
fn eight_processes_with_random_kills_leave_a_store_that_verifies() {
    let corpus = &Corpus::new();
    let path = corpus.folder.path();
    let end = Instant::now() + Duration::from_secs_f64(seconds());
    let (killed, ended) = std::thread::scope(|scope| {
        let running: Vec<_> =
            (0..8).map(|number| scope.spawn(move || corpus.compile_until(end, number))).collect();
        let counts = running.into_iter().map(|thread| thread.join().unwrap());
        counts.fold((0, 0), |a, b| (a.0 + b.0, a.1 + b.1))
    });
    println!("{ended} compilations ended, {killed} were killed");
    assert!(killed > 0 && ended > 0);
    let temporary = path.join("temporary");
    assert_eq!(
        files(&temporary),
        [""; 0],
        "killed compilers and their workers leave nothing, not even folders"
    );
    assert_eq!(std::fs::read_dir(&temporary).unwrap().count(), 0);
    let partial = |name: &String| name.ends_with(".bth-part");
    let left = || files(&path.join("cache")).into_iter().filter(partial).collect::<Vec<_>>();
    // Systems on which files can be written without a name leave no unfinished ones.
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
        running.into_iter().map(|thread| thread.join().unwrap().expect(0).job()).collect::<Vec<_>>()
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
        cached(path, &args).expect(0).job()
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
