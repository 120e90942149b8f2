//! Trees for rays that are known when a model is compiled: `--rays`.

use crate::support::{bthc, command, data, folder, run_with, sphere, wait};
use bth::rays::Ray;
use bth_random::Rng;
use bth_scenes::knot::torus_knot;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

/// Rays at the middle of a model from one side of it, a point and a direction apart for each seed.
fn view(count: usize, seed: u64) -> Vec<Ray> {
    let mut random = Rng::new(seed);
    let mut near = |x: f32, spread: f32| x + spread * (random.unit_f32() - 0.5);
    let ray = |_| {
        Ray::new([near(10.0, 0.2), near(0.0, 0.2), near(1.0, 0.2)], [-1.0, near(0.0, 0.7), near(-0.1, 0.7)])
    };
    (0..count).map(ray).collect()
}

fn write(path: &Path, rays: &[Ray]) {
    let header = [&b"RAYS"[..], &1u32.to_le_bytes(), &(rays.len() as u64).to_le_bytes()].concat();
    let rows = rays.iter().flat_map(|ray| {
        let ([ox, oy, oz], [dx, dy, dz]) = (ray.origin, ray.direction);
        [ox, oy, oz, ray.tmin, dx, dy, dz, ray.tmax].into_iter().flat_map(f32::to_le_bytes)
    });
    std::fs::write(path, header.into_iter().chain(rows).collect::<Vec<u8>>()).unwrap();
}

/// Steps of these rays through a compiled file, and their hits.
fn traced(path: &Path, rays: &[Ray]) -> (u64, Vec<bth::rays::Hit>) {
    let scene = bth::open(path).unwrap();
    let mut total = 0;
    let hits = rays.iter().map(|ray| {
        let (hit, steps) = scene.nearest_counted(ray);
        total += u64::from(steps.nodes + steps.leaves);
        hit
    });
    let hits = hits.collect();
    (total, hits)
}

#[test]
fn rays_take_fewer_steps_through_a_tree_that_is_made_for_such_rays() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    bth_scenes::write::file(&torus_knot(30_000), &at("knot.ply")).unwrap();
    write(&at("view.rays"), &view(20_000, 1));
    let compile = |output: &str, more: &[&str]| {
        let args = ["compile", "knot.ply", "-o", output];
        bthc(folder.path(), &[&args, more].concat()).expect(0)
    };
    compile("any.bth", &[]);
    let report = compile("view.bth", &["--rays", "view.rays"]).stdout;
    assert!(
        report.lines().any(|line| line.starts_with("known rays") && line.ends_with("20,000")),
        "{report}"
    );
    compile("again.bth", &["--rays", "view.rays", "--threads", "1"]);
    assert_eq!(std::fs::read(at("view.bth")).unwrap(), std::fs::read(at("again.bth")).unwrap());

    // Other rays of the same view.
    let others = view(20_000, 2);
    let ((steps, hits), (known_steps, known_hits)) =
        (traced(&at("any.bth"), &others), traced(&at("view.bth"), &others));
    assert_eq!(known_hits, hits);
    assert!(hits.iter().filter(|hit| hit.is_hit()).count() > 2000);
    assert!((known_steps as f64) < 0.97 * steps as f64, "{known_steps} of {steps}");
}

/// On a scan and a room: rays from everywhere in the box towards one corner of it.
#[test]
fn rays_take_fewer_steps_through_real_models() {
    let Some(data) = data() else { return };
    for (name, most) in [("nefertiti.ply", 0.98), ("living-room.ply", 0.98)] {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let model = data.join("static").join(name).to_string_lossy().into_owned();
        let compile = |output: &str, more: &[&str]| {
            let args = ["compile", &model, "-o", output];
            bthc(folder.path(), &[&args, more].concat()).expect(0);
        };
        compile("any.bth", &[]);
        let (lower, upper) = bth::open(at("any.bth")).unwrap().bounds().unwrap();
        let view = |seed| {
            let mut random = Rng::new(seed);
            let mut between = |share: [f32; 2]| -> [f32; 3] {
                std::array::from_fn(|k| {
                    let share = share[0] + (share[1] - share[0]) * random.unit_f32();
                    lower[k] + share * (upper[k] - lower[k])
                })
            };
            let ray = |_| {
                let (from, to) = (between([0.6, 1.0]), between([0.3, 0.7]));
                Ray::new(from, std::array::from_fn(|k| to[k] - from[k]))
            };
            (0..20_000).map(ray).collect::<Vec<Ray>>()
        };
        write(&at("view.rays"), &view(1));
        compile("known.bth", &["--rays", "view.rays"]);
        let others = view(2);
        let ((steps, hits), (known_steps, known_hits)) =
            (traced(&at("any.bth"), &others), traced(&at("known.bth"), &others));
        assert_eq!(known_hits, hits, "{name}");
        assert!((known_steps as f64) < most * steps as f64, "{name}: {known_steps} of {steps}");
    }
}

#[test]
fn the_cache_and_dependencies_tell_files_for_other_rays_apart() {
    let folder = folder(&[("ball.obj", &sphere(16))]);
    let path = folder.path();
    write(&path.join("a.rays"), &view(100, 1));
    write(&path.join("b.rays"), &view(100, 2));
    let run = |args: &[&str]| {
        let mut command = command("bthc", path, &[&["compile", "ball.obj"], args].concat());
        command.env("BTH_CACHE_DIR", path.join("cache")).env_remove("BTH_NO_CACHE");
        run_with(command).expect(0).stdout
    };
    for structure in ["bth", "bvh"] {
        let dry = |rays: &str| run(&["--structure", structure, "--rays", rays, "--dry-run"]);
        run(&["--structure", structure, "--rays", "a.rays", "--depfile", "ball.d"]);
        assert_eq!(dry("a.rays"), "ball.bth: nothing to do\n");
        assert!(dry("b.rays").starts_with("ball.bth: compile "), "{structure}");
        assert!(run(&["--structure", structure, "--dry-run"]).starts_with("ball.bth: compile "));
    }
    let dependencies = std::fs::read_to_string(path.join("ball.d")).unwrap();
    assert_eq!(dependencies, "ball.bth: \\\n  ball.obj \\\n  a.rays\n");
}

#[cfg(unix)]
#[test]
fn watching_heeds_new_rays() {
    let folder = folder(&[("ball.obj", &sphere(48))]);
    let path = folder.path();
    write(&path.join("a.rays"), &view(2000, 1));
    let args = ["compile", "ball.obj", "--rays", "a.rays"];
    let mut child = command("bthc", path, &[&args[..], &["--watch"]].concat());
    let mut child = child.stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    assert!(lines.next().unwrap().unwrap().starts_with("ball.bth  compiled"));
    let others: Vec<Ray> = view(3000, 2).into_iter().map(|ray| Ray { tmax: 9.0, ..ray }).collect();
    write(&path.join("a.rays"), &others);
    assert!(lines.next().unwrap().unwrap().starts_with("ball.bth  compiled"));
    let sent = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(sent.unwrap().success());
    assert_eq!(wait(&mut child, Duration::from_secs(20)).expect("Ctrl-C ends it").code(), Some(130));
    bthc(path, &[&args[..], &["-o", "expected.bth"]].concat()).expect(0);
    let read = |name: &str| std::fs::read(path.join(name)).unwrap();
    assert!(read("ball.bth") == read("expected.bth"));
}

#[test]
fn rays_that_cannot_be_traced_are_reported_and_none_are_refused() {
    let folder = folder(&[("ball.obj", &sphere(8)), ("a.manifest", "version = 1\n")]);
    let path = folder.path();
    let bad = Ray { direction: [0.0; 3], ..view(1, 1)[0] };
    write(&path.join("some.rays"), &[view(3, 1), vec![bad]].concat());
    write(&path.join("none.rays"), &[bad]);
    let some = bthc(path, &["compile", "ball.obj", "--rays", "some.rays"]).expect(0);
    assert!(some.stderr.contains("some.rays: 1 of 4 rays cannot be traced"), "{some:?}");
    let none = bthc(path, &["compile", "ball.obj", "--rays", "none.rays"]).expect(3);
    assert!(none.stderr.contains("BTH-I090") && none.stderr.contains("found none of 1"), "{none:?}");
    bthc(path, &["compile", "ball.obj", "--rays", "ball.obj"]).expect(3);
    let scene = bthc(path, &["compile", "a.manifest", "--rays", "some.rays"]).expect(2);
    assert!(scene.stderr.contains("compile its models one by one"), "{scene:?}");
    bthc(path, &["compile", "ball.obj", "ball.obj", "--rays", "some.rays", "-o", "."]).expect(2);
    let deformable = bthc(path, &["compile", "ball.obj", "--rays", "some.rays", "--deformable"]);
    assert!(deformable.stderr.contains("BTH-L033"), "{deformable:?}");
}
