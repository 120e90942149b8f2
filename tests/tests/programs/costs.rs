//! `bthc explain`: selection of nodes and budgets.

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
fn limits_and_weights_decide_what_is_tetrahedralized() {
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
    let few = triangles(&compile(&["--max-bytes-per-triangle", "80"]));
    assert!(few > 0 && few < all, "{few} of {all}");
    assert!(triangles(&compile(&["--set", "budget=0.005"])) < all);
    // Rays from outside and from surfaces walk through the tetrahedra.
    for setting in ["optimize-for=camera", "optimize-for=secondary", "select=paper"] {
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
fn tracing_reads_no_more_bytes_than_the_limit_and_what_cannot_be_held_is_said() {
    let folder = folder(&[("ball.obj", &sphere(24))]);
    let compile = |more: &[&str]| {
        let args = ["compile", "ball.obj", "-o", "out.bth", "--no-cache", "--set", "min-tet-triangles=64"];
        bthc(folder.path(), &[&args[..], more].concat()).expect(0)
    };
    let file = |more: &[&str]| compile(&[&["--json"], more].concat()).job()["report"]["file"].clone();
    let each = |file: &serde_json::Value| file["resident_bytes_per_triangle"].as_f64().unwrap();
    let plain = each(&file(&["--structure", "bvh"]));
    for select in ["select=best", "select=paper"] {
        for more in [&["--set", "c-tet=0.001"][..], &["--set", "c-tet=0.001", "--set", "probe=off"]] {
            let with = |limit: f64| {
                let limit = limit.to_string();
                file(&[&["--set", select, "--max-bytes-per-triangle", &limit], more].concat())
            };
            let all = file(&[&["--set", select], more].concat());
            if all["tet_leaves"] == 0 {
                println!("skipped: tetrahedra need the worker bth-tetgen");
                return;
            }
            let mut some = 0;
            for share in [0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99] {
                let limit = plain + share * (each(&all) - plain);
                let limited = with(limit);
                assert!(each(&limited) <= limit, "{select} {more:?}: {limited:#} beyond {limit}");
                some += u32::from(limited["tet_leaves"].as_u64() > Some(0));
            }
            assert!(some > 2, "{select} {more:?}: nothing is tetrahedralized within most limits");
            // Only the provenance record, which stores the options, may differ.
            let mut generous = with(1e4);
            generous["bytes"] = all["bytes"].clone();
            assert_eq!(generous, all);
        }
    }
    let run = compile(&["--max-bytes-per-triangle", "20"]);
    let figure = format!("{plain:.1} bytes a triangle");
    assert!(run.stderr.contains("warning") && run.stderr.contains(&figure), "{run:?}");
    assert!(!compile(&["--max-bytes-per-triangle", "1e4"]).stderr.contains("warning"));
}

#[test]
fn free_directions_are_kept_if_asked_for_where_they_pay_and_fit() {
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
    for (more, expected) in [(20.5, "directions"), (19.5, "distances"), (8.5, "distances"), (7.5, "none")] {
        let limit = plain + more;
        let (kept, each) = kept(&[&auto[..], &["--max-bytes-per-triangle", &limit.to_string()]].concat());
        assert_eq!(kept, expected, "{more}");
        assert!(each <= limit, "{each} {limit}");
    }
}
