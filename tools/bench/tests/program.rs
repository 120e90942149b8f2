//! The program as it is called, without any rival that has to be installed.

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

/// A path in this crate at which there is no file.
const NO_FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/no-such-library");

fn bench(arguments: &[&str]) -> Output {
    // Whatever is installed on this machine is not there.
    let mut command = Command::new(env!("CARGO_BIN_EXE_bth-bench"));
    command.env("EMBREE_LIB", NO_FILE).env("TINYBVH_LIB", NO_FILE).args(arguments).output().unwrap()
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

#[test]
fn a_quick_speed_run_needs_no_rival() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let done =
        bench(&["speed", "torus-knot:320", "--quick", "--threads", "1,2", "--out", out, "--name", "quick"]);
    let (printed, said) = (String::from_utf8(done.stdout).unwrap(), String::from_utf8(done.stderr).unwrap());
    assert!(done.status.success(), "{said}");
    assert!(printed.contains("| k-d tree |") && printed.contains("2 threads"), "{printed}");
    assert!(said.contains("embree: not measured: EMBREE_LIB names no file"), "{said}");

    let files: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|f| f.unwrap().path()).collect();
    let find = |end: &str| files.iter().find(|f| f.to_str().unwrap().ends_with(end)).expect(end);
    let results = json(find("-quick.json"));
    let tracers = results["models"][0]["runs"][0]["tracers"].as_array().unwrap();
    let names: Vec<&str> = tracers.iter().map(|t| t["name"].as_str().unwrap()).collect();
    for name in ["bth", "bth start", "bth single", "bvh", "bvh single", "obvhs cwbvh", "k-d tree"] {
        assert!(names.contains(&name), "{names:?}");
    }
    for tracer in tracers.iter().filter(|t| t["ours"] == true) {
        assert!(tracer["differ"].as_object().unwrap().values().all(|n| n == 0), "{tracer}");
        assert!(tracer["mrays_per_s"]["ao"].as_f64().unwrap() > 0.0, "{tracer}");
    }
    let page = std::fs::read_to_string(find("-quick.md")).unwrap();
    assert!(page.contains("-quick-torus-knot-2-threads.svg"), "{page}");
    find("-quick-torus-knot-1-thread.svg");
}

#[test]
fn what_cannot_be_saved_is_printed() {
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
fn load_measures_our_files_where_embree_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("load.json");
    let done = bench(&[
        "load",
        "torus-knot:320",
        "--rounds",
        "1",
        "--threads",
        "1",
        "--rays",
        "100",
        "--json",
        path.to_str().unwrap(),
    ]);
    let said = String::from_utf8(done.stderr).unwrap();
    assert!(done.status.success(), "{said}");
    assert!(said.contains("embree: not measured"), "{said}");
    let results = json(&path);
    let starts = results["models"][0]["runs"][0]["starts"].as_array().unwrap();
    let names: Vec<&str> = starts.iter().map(|s| s[0].as_str().unwrap()).collect();
    assert_eq!(names[..4], ["bth map warm", "bth map cold", "bth read warm", "bth read cold"]);
    for start in starts {
        let times = ["ready_s", "first_hit_s", "total_s"].map(|k| start[1][k].as_f64().unwrap());
        assert!(times[0] > 0.0 && times.is_sorted(), "{start}");
    }
}

#[test]
fn hits_do_not_depend_on_the_size_of_a_model() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scales.json");
    let done =
        bench(&["scales", "torus-knot:320", "--rays", "256", "--quick", "--json", path.to_str().unwrap()]);
    let said = String::from_utf8(done.stderr).unwrap();
    assert!(done.status.success(), "{said}");
    let results = json(&path);
    let rows = results["rows"].as_array().unwrap();
    for row in rows {
        assert!(row["ns"].as_array().unwrap().iter().all(|ns| ns.as_f64().unwrap() > 0.0), "{row}");
    }
    let differ = |size: i32| {
        let is_it = |row: &&Value| row["size"] == size && row["vertex"].is_null();
        rows.iter().find(is_it).unwrap()["differ"].as_u64()
    };
    assert!([-75, -50, 0, 42, 96].into_iter().all(|size| differ(size) == Some(0)), "{rows:?}");
    assert_eq!(differ(-126), None, "coordinates are denormal");
    for (what, count) in [("vertex", 9), ("moved", 5)] {
        assert_eq!(rows.iter().filter(|row| !row[what].is_null()).count(), count, "{what}");
    }
}

#[test]
fn every_variation_of_the_builder_gives_the_same_answers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("quality.json");
    let done = bench(&["quality", "hall:1500", "--quick", "--json", path.to_str().unwrap()]);
    assert!(done.status.success(), "{}", String::from_utf8(done.stderr).unwrap());
    let results = json(&path);
    let rows = results["models"][0]["rows"].as_array().unwrap();
    let row = |name: &str| rows.iter().find(|r| r["name"] == name).expect(name);
    let number = |name: &str, key: &str| row(name)[key].as_f64().unwrap();
    for row in rows {
        assert_eq!(row["differ"], 0, "{row}");
        assert!(row["nanoseconds"]["primary"].as_f64().unwrap() > 0.0, "{row}");
    }
    assert!(number("spatial splits", "references") > 1.0, "some triangles are in several leaves");
    assert!(number("8 children", "children") <= 8.0 && number("8 triangles", "triangles") <= 8.0);
    let plain = row("as in files");
    for same in ["the same again", "leaves beside nodes", "breadth first", "random order"] {
        for key in ["wide_visits", "bytes", "steps"] {
            assert_eq!(row(same)[key], plain[key], "{same}: {key}");
        }
    }
}

#[test]
fn misspelled_names_are_refused_before_anything_is_measured() {
    for (option, name) in [("--tracer", "embre"), ("--set", "primarily"), ("--isa", "avx1024")] {
        let done = bench(&["speed", "torus-knot", option, name]);
        assert!(!done.status.success());
        let said = String::from_utf8(done.stderr).unwrap();
        assert!(said.contains(name), "{said}");
    }
    let done = bench(&["speed", "no-such-model"]);
    assert!(String::from_utf8(done.stderr).unwrap().contains("neither a file nor a model"));
}

#[test]
fn accuracy_compares_ours_and_the_crates_without_any_installed_rival() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let tracers = "bvh,bvh scalar,bvh 21 bits,bth,obvhs bvh2,k-d tree,f32 moller-trumbore,embree compact";
    let done = bench(&[
        "accuracy",
        "torus-knot:320",
        "blob:400",
        "--quick",
        "--tracer",
        tracers,
        "--out",
        out,
        "--name",
        "quick",
    ]);
    let (printed, said) = (String::from_utf8(done.stdout).unwrap(), String::from_utf8(done.stderr).unwrap());
    assert!(done.status.success(), "{said}");
    assert!(printed.contains("## All models") && said.contains("embree compact: not measured"), "{said}");

    let files: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|f| f.unwrap().path()).collect();
    let find = |end: &str| files.iter().find(|f| f.to_str().unwrap().ends_with(end)).expect(end);
    let results = json(find("-quick.json"));
    for model in results["models"].as_array().unwrap() {
        for tracer in model["tracers"].as_array().unwrap() {
            assert_eq!(tracer["aimed"]["rays"], 4000, "{tracer}");
            assert!(tracer["nanoseconds"]["vertices"].as_f64().unwrap() > 0.0, "{tracer}");
            let defects = ["false_misses", "leaks", "ghosts", "wrong_neighbours"].map(|kind| {
                tracer["aimed"][kind].as_u64().unwrap() + tracer["ordinary"][kind].as_u64().unwrap()
            });
            let name = tracer["name"].as_str().unwrap();
            let exact = ["bvh", "bth"].contains(&tracer["group"].as_str().unwrap());
            // Rays exactly at vertices are lost by those that are not exact: were none, nothing would be measured.
            assert_eq!(exact, defects == [0; 4], "{tracer}");
            if exact && name != "bvh 21 bits" {
                assert!(tracer["t_ulp"]["max"].as_f64().unwrap() < 0.51, "{tracer}");
                assert_eq!(tracer["rmse"], 0.0, "{tracer}");
            }
        }
    }
    for chart in ["wrong-against-time", "t-against-time", "t-against-bytes", "picture-against-bytes"] {
        find(&format!("-quick-{chart}.svg"));
    }
}
