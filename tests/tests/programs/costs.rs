//! Selection of the nodes that are tetrahedralized, and of free directions.

use crate::support::{bthc, command, folder, run_with, sphere};

const CHEAP: [&str; 4] = ["--set", "c-tet=0.001", "--set", "min-tet-triangles=64"];

fn worker_is_there(json: &serde_json::Value) -> bool {
    let there = json["report"]["tets"]["worker"]["ready"].is_object();
    if !there {
        println!("skipped: tetrahedra need the worker bth-tetgen");
    }
    there
}

#[test]
fn weights_decide_what_is_tetrahedralized() {
    let folder = folder(&[("ball.obj", &sphere(24))]);
    let compile = |more: &[&str]| {
        let args = ["compile", "ball.obj", "-o", "out.bth", "--json"];
        bthc(folder.path(), &[&args[..], &CHEAP[..], more].concat()).expect(0).job()
    };
    let json = compile(&[]);
    if !worker_is_there(&json) {
        return;
    }
    let triangles = |json: &serde_json::Value| json["report"]["file"]["tet_triangles"].as_u64().unwrap();
    let all = triangles(&json);
    assert!(all > 1000, "{json:#}");
    assert_eq!(json["report"]["probe"]["leaves"][0]["kept"], true);
    // Rays from outside and from surfaces walk through the tetrahedra.
    for setting in ["optimize-for=camera", "optimize-for=secondary"] {
        assert_eq!(triangles(&compile(&["--set", setting])), all, "{setting}");
    }
}

#[test]
fn tetrahedra_need_no_folder_for_temporary_files() {
    let folder = folder(&[("ball.obj", &sphere(24))]);
    let args = [&["compile", "ball.obj", "-o", "out.bth", "--json"], &CHEAP[..]].concat();
    if !worker_is_there(&bthc(folder.path(), &args).expect(0).job()) {
        return;
    }
    let mut without = command("bthc", folder.path(), &args);
    without.env("TMPDIR", folder.path().join("missing"));
    let json = run_with(without).expect(0).job();
    assert!(
        worker_is_there(&json) && json["report"]["file"]["tet_triangles"].as_u64().unwrap() > 0,
        "{json:#}"
    );
}

#[test]
fn free_directions_are_kept_if_asked_for_where_they_pay() {
    let folder = folder(&[("ball.obj", &sphere(24))]);
    let kept = |more: &[&str]| {
        let args = ["compile", "ball.obj", "-o", "out.bth", "--no-cache", "--json", "--structure", "bvh"];
        let run = bthc(folder.path(), &[&args[..], more].concat()).expect(0);
        let report = run.job()["report"].clone();
        let each = report["file"]["resident_bytes_per_triangle"].as_f64().unwrap();
        (report["free"]["kept"].as_str().unwrap_or("none").to_owned(), each)
    };
    let auto = ["--free-directions", "auto"];
    let (none, plain) = kept(&[]);
    let (all, with) = kept(&auto);
    assert_eq!([&none[..], &all[..]], ["none", "directions"]);
    assert!(with > plain + 19.9 && with < plain + 20.1, "{plain} {with}");
    for small in [&["--quality", "fast"][..], &["--coordinates", "16"]] {
        assert_eq!(kept(small).0, none, "{small:?}");
        assert_eq!(kept(&[small, &auto].concat()).0, all, "{small:?}");
    }
}
