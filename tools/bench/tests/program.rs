//! The program as it is called, without any rival that must be installed; and what a user gets who
//! makes a mistake: a message and an exit code, never a backtrace.

use serde_json::Value;
use std::process::{Command, Output};

/// A path in this crate at which there is no file.
const NO_FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/no-such-library");

fn bench(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bth-bench"));
    command.env("RUST_BACKTRACE", "1").env("EMBREE_LIB", NO_FILE).env("TINYBVH_LIB", NO_FILE);
    command.env("TRUTH_ENGINES", NO_FILE);
    command.args(arguments).output().unwrap()
}

/// Runs a command that must succeed, with a report; returns the page and the rows.
fn report(arguments: &[&str]) -> (String, Vec<Value>) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let done = bench(&[arguments, &["--quick", "--out", out, "--name", "quick"]].concat());
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let text = |end: &str| {
        let mut files = std::fs::read_dir(folder.path()).unwrap().map(|f| f.unwrap().path());
        std::fs::read_to_string(files.find(|f| f.to_str().unwrap().ends_with(end)).expect(end)).unwrap()
    };
    let mut json: Value = serde_json::from_str(&text("-quick.json")).unwrap();
    let Value::Array(rows) = json["rows"].take() else { panic!("no rows") };
    (text("-quick.md"), rows)
}

/// The figure of an engine and set, in the first model.
fn figure(rows: &[Value], engine: &str, set: &str) -> f64 {
    let is_it = |row: &&Value| row["engine"] == engine && row["set"] == set;
    rows.iter().find(is_it).unwrap_or_else(|| panic!("{engine}, {set}"))["value"].as_f64().unwrap()
}

#[test]
fn a_quick_speed_run_needs_no_rival() {
    let (page, rows) = report(&["speed", "torus-knot:320", "--threads", "1,2"]);
    assert!(
        page.contains("## torus-knot, 2 threads") && page.contains("embree: not measured: EMBREE_LIB"),
        "{page}"
    );
    for engine in ["bth", "bth start", "bth single", "bvh", "bvh single", "obvhs cwbvh"] {
        assert!(figure(&rows, engine, "ao") > 0.0);
    }
}

#[test]
fn load_and_scenes_measure_ours() {
    let (_, rows) = report(&["load", "torus-knot:320", "objects:3", "--threads", "1", "--rays", "100"]);
    for start in ["bth map warm", "bth map cold", "bvh read warm"] {
        let times = ["ready", "first hit", "total"].map(|set| figure(&rows, start, set));
        assert!(times[0] > 0.0 && times.is_sorted(), "{start}: {times:?}");
    }
    let (_, rows) = report(&["scenes", "instances:30", "--frames", "2", "--threads", "1,2"]);
    for engine in ["bth", "bvh", "bth single", "bth placed"] {
        assert_eq!(figure(&rows, engine, "differ"), 0.0, "{engine}");
        assert!(figure(&rows, engine, "update") > 0.0 && figure(&rows, engine, "later") > 0.0);
    }
}

#[test]
fn truth_finds_no_wrong_answer_of_ours() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (page, json) = (path(""), path("truth.json"));
    let engines = "bth,bth f32,Embree,obvhs,CGAL";
    let done = bench(&[
        "truth",
        "--queries=300",
        "--rounds=1",
        "--engine",
        engines,
        "--page",
        &page,
        "--json",
        &json,
    ]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let Value::Array(rows) =
        serde_json::from_str::<Value>(&std::fs::read_to_string(json).unwrap()).unwrap()["rows"].take()
    else {
        panic!("no rows")
    };
    let single = ["camera", "bounces", "vertices and edges", "slivers", "tiles", "inside", "visibility"];
    let double = ["touching instances", "national coordinates"];
    assert!(single.iter().chain(&double).all(|set| figure(&rows, "bth", set) == 0.0));
    // Were there none here, nothing would be measured.
    assert!(figure(&rows, "obvhs", "tiles") > 0.0 && figure(&rows, "bth f32", "national coordinates") > 0.0);
    let page = std::fs::read_to_string(path("TRUTH.md")).unwrap();
    assert!(
        page.contains("| **bth** | f32 or f64 | **0**<br>") && page.contains("not to be had here"),
        "{page}"
    );
    assert!(
        page.contains("- obvhs, inside: has no such query\n") && page.matches('{').count() == 1,
        "{page}"
    );
    let chart = std::fs::read_to_string(path("truth.svg")).unwrap();
    assert!(chart.contains(">bth</text>") && chart.matches("<circle").count() > 14, "{chart}");
}

#[test]
fn a_report_that_cannot_be_saved_is_printed() {
    let inside_a_file = concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml/speed.json");
    let done = bench(&[
        "speed",
        "torus-knot:320",
        "--quick",
        "--tracer",
        "bvh",
        "--set",
        "ao",
        "--json",
        inside_a_file,
    ]);
    let (printed, said) = (String::from_utf8(done.stdout).unwrap(), String::from_utf8(done.stderr).unwrap());
    assert_eq!(done.status.code(), Some(1), "{said}");
    assert!(printed.contains("| bvh |") && said.contains("Cargo.toml"), "{printed}{said}");
}

#[test]
fn mistakes_are_named_with_an_exit_code() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let broken =
        [path("broken.ply", "ply\nformat none 1.0\n"), path("broken.stl", ""), path("broken.xyz", "1 2 3\n")];
    let words = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<String>>();
    // Exit code, command line, and the word that the message names.
    let cases = [
        (2, "speeds torus-knot", "speeds"),
        (2, "speed torus-knot --ray 5", "--ray"),
        (2, "speed torus-knot --rounds 0", "--rounds"),
        (2, "speed", "<MODEL>"),
        (2, "compare a.so b.so torus-knot --worse 1", "--worse"),
        (2, "stress --size 0", "--size"),
        (2, "speed torus-knot --name ../speed", "--name"),
        (1, "speed missing.ply", "missing.ply: neither a file nor a model"),
        (1, "speed torus-knot:0", "torus-knot:0"),
        (1, "speed torus-knot --set primarily", "primarily"),
        (1, "speed torus-knot --isa avx1024", "avx1024"),
        (1, "truth --engine Embre", "Embre"),
        (1, "load missing.manifest", "missing.manifest"),
        (1, "load objects:missing", "objects:missing"),
        (1, "scenes missing", "missing"),
        (1, "record missing", "missing"),
        (1, "compare missing.so missing.so torus-knot", "missing.so"),
    ];
    let mut cases: Vec<(i32, Vec<String>, String)> =
        cases.into_iter().map(|(code, line, word)| (code, words(line), word.to_owned())).collect();
    cases.extend(broken.map(|file| (1, vec!["speed".to_owned(), file.clone()], file)));
    for (code, arguments, word) in cases {
        let done = bench(&arguments.iter().map(String::as_str).collect::<Vec<_>>());
        let said = String::from_utf8(done.stderr).unwrap();
        assert_eq!(done.status.code(), Some(code), "{arguments:?}: {said}");
        assert!(said.contains(&word) && said.starts_with("error: "), "{arguments:?}: {said}");
        assert!(!said.contains("backtrace") && !said.contains("panicked"), "{arguments:?}: {said}");
        assert!(done.stdout.is_empty(), "{arguments:?} printed results");
    }
}
