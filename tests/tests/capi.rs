//! The C interface, used by C and C++ programs (`tests/c`) that include its headers and link its libraries only.

use bth::rays::{Hit, Ray};
use bth_compile::Silent;
use bth_compile::cached::Cache;
use bth_compile::memory::{self, Instance, TriangleMesh};
use bth_compile::pipeline::{CompileOptions, Structure, compile};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// Builds the library and the C program; `None` without a C compiler.
fn c_program(folder: &Path, name: &str) -> Option<PathBuf> {
    program(folder, &format!("{name}.c"), &["bth"])
}

/// Builds the libraries and a program of `tests/c` that uses them. Without a compiler prints why not, and returns `None`.
#[allow(clippy::print_stdout)]
fn program(folder: &Path, source: &str, libraries: &[&str]) -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let (variable, default, standard) = match source.ends_with(".cpp") {
        true => ("CXX", "c++", "-std=c++17"),
        false => ("CC", "cc", "-std=c11"),
    };
    let compiler = std::env::var(variable).unwrap_or_else(|_| default.into());
    if Command::new(&compiler).arg("--version").stdout(Stdio::null()).status().is_err() {
        println!("SKIPPED: no compiler {compiler}");
        return None;
    }
    let packages = [("bth", "bth-capi"), ("bth_compile", "bth-compile-capi")];
    let packages: Vec<_> = packages.iter().filter(|(library, _)| libraries.contains(library)).collect();
    let built = bth_tests::built(&packages.iter().map(|(_, package)| *package).collect::<Vec<_>>());
    let program = folder.join(source).with_extension("");
    let mut command = Command::new(compiler);
    command.args([standard, "-Wall", "-Wextra", "-Werror", "-O1"]);
    for (_, package) in packages {
        command.arg("-I").arg(root.join("src").join(package).join("include"));
    }
    command.arg(root.join("tests/c").join(source)).arg("-L").arg(&built);
    command.args(libraries.iter().map(|library| format!("-l{library}")));
    command.arg(format!("-Wl,-rpath,{}", built.display())).arg("-o").arg(&program);
    assert!(command.status().expect("the compiler runs").success(), "{source} compiles without a warning");
    Some(program)
}

fn run(program: &Path, arguments: &[&str], input: &str) -> Output {
    let mut child = Command::new(program)
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the C program starts");
    // It may end before it reads.
    let _ = child.stdin.take().expect("piped").write_all(input.as_bytes());
    child.wait_with_output().expect("the C program ends")
}

#[test]
fn a_c_program_opens_traces_and_reads_errors() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(program) = c_program(folder.path(), "trace") else { return };
    let model = folder.path().join("knot.obj");
    bth_scenes::write::file(&bth_scenes::knot::torus_knot(2880), &model).expect("a model");
    let options = CompileOptions {
        tets: bth_compile::tets::TetOptions {
            worker: bth_tests::worker().map(Into::into),
            ..CompileOptions::default().tets
        },
        ..CompileOptions::default()
    };
    let (compiled, _) = compile(&model, &options, &Silent).expect("the knot compiles");
    let file = folder.path().join("knot.bth");
    std::fs::write(&file, &compiled.bytes).expect("a file");
    let scene = bth::open(&file).expect("the knot opens");

    let corners: Vec<_> = {
        let model = bth_scenes::knot::torus_knot(2880);
        (0..model.triangles.len()).map(|i| model.corners(i)).collect()
    };
    let rays: Vec<Ray> = bth_tests::rays::assorted(&corners, 16, 21);
    let input: String = rays
        .iter()
        .map(|r| {
            let [a, b, c] = r.origin;
            let [x, y, z] = r.direction;
            format!("{a} {b} {c} {} {x} {y} {z} {}\n", r.tmin, r.tmax)
        })
        .collect();
    let hits: Vec<_> = rays.iter().map(|r| scene.nearest(r).unwrap_or(Hit::MISS)).collect();
    assert!(hits.iter().any(|h| h.is_hit()) && hits.iter().any(|h| !h.is_hit()));
    for flags in ["read", "map"] {
        let output = run(&program, &[file.to_str().expect("UTF-8"), flags], &input);
        assert!(output.status.success(), "{output:?}");
        let text = String::from_utf8(output.stdout).expect("text");
        let mut lines = text.lines();
        assert_eq!(lines.next(), Some(format!("resident {}", scene.resident_bytes()).as_str()));
        let mut answered = 0;
        for ((line, hit), ray) in lines.zip(&hits).zip(&rays) {
            let field: Vec<&str> = line.split(' ').collect();
            let number = |i: usize| field[i].parse::<f32>().expect("a number").to_bits();
            assert_eq!([number(0), number(1), number(2)], [hit.t, hit.u, hit.v].map(f32::to_bits), "{ray:?}");
            assert_eq!(field[3], hit.primitive.instance.to_string());
            assert_eq!(field[4], hit.primitive.triangle.to_string());
            assert_eq!(field[5], u8::from(scene.any_from(ray, hit.primitive)).to_string());
            answered += 1;
        }
        assert_eq!(answered, rays.len());
    }

    let mut damaged = compiled.bytes.clone();
    damaged[70] ^= 1;
    let bad = folder.path().join("bad.bth");
    std::fs::write(&bad, damaged).expect("a file");
    for (path, code, says) in
        [(bad.as_path(), "-3", "BTH-F004"), (folder.path().join("absent.bth").as_path(), "-2", "BTH-O001")]
    {
        let output = run(&program, &[path.to_str().expect("UTF-8")], "");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert_eq!(output.status.code(), Some(1));
        assert!(text.starts_with(&format!("error {code} null ")) && text.contains(says), "{text}");
    }
}

/// A wheel that turns, and stands on its edge without any depth in frame 3.
const SCENE: &str = r#"version = 1
frames = { first = -1, last = 4, rate = 2 }
objects = [{ name = "quad", model = "quad.obj" }]
nodes = [{ name = "hub", translation = [0, 1, 0] }, { name = "spoke", parent = "hub", object = "quad", translation = [1, 0, 0] }, { name = "floor", object = "quad", scale = [3, 1, 3] }]
tracks = [
    { node = "hub", property = "rotation", times = [0, 2], values = [{ axis = [0, 1, 0], degrees = 0 }, { axis = [0, 1, 0], degrees = 170 }] },
    { node = "spoke", property = "scale", interpolation = "step", times = [0, 1.5, 2], values = [[1, 1, 1], [1, 1e-30, 1], [1, 0, 1]] },
]
"#;

#[test]
fn a_c_program_moves_a_scene_and_sees_what_rust_sees() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(program) = c_program(folder.path(), "motion") else { return };
    let quad = "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nf 4 3 2 1\n";
    std::fs::write(folder.path().join("quad.obj"), quad).expect("a model");
    let manifest = bth_scene::parse(SCENE, Path::new("wheel.manifest")).expect("a manifest");
    let options = CompileOptions::default();
    let (compiled, _) =
        bth_compile::scene::compile(&manifest, folder.path(), Path::new("wheel"), &options, &Silent)
            .expect("the wheel compiles");
    let file = folder.path().join("wheel.bth");
    std::fs::write(&file, &compiled.bytes).expect("a file");

    let points = [[0.0f32, 0.0], [1.5, 0.2], [-0.4, -1.3], [9.0, 9.0]];
    let input: String = points.iter().map(|[x, z]| format!("{x} {z}\n")).collect();
    let output = run(&program, &[file.to_str().expect("UTF-8")], &input);
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).expect("text");
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("frames -1 4 2"));

    let mut scene = bth::open(&file).expect("the wheel opens");
    let mut seen = [0; 2];
    for frame in (-1..=4).map(Some).chain([None]) {
        let moved = match frame {
            Some(frame) => scene.set_frame(frame),
            None => scene.set_seconds(0.3),
        };
        if let Err(error) = moved {
            let line = lines.next().expect("an error");
            assert!(
                line.starts_with("error -6 ") && line.contains("node \"spoke\" at 1.5 s"),
                "{line}: {error}"
            );
            seen[0] += 1;
        }
        let time = lines.next().and_then(|line| line.strip_prefix("time ")?.parse::<f64>().ok());
        assert_eq!(time, Some(scene.seconds()));
        for i in 0..scene.instance_count() {
            let view = scene.instance(i);
            let line = lines.next().expect("an instance");
            let fields: Vec<&str> = line.split(' ').collect();
            let numbers = [view.object, view.node, view.visible.into()].map(|n| n.to_string());
            assert_eq!(fields[1..4], numbers, "{frame:?}");
            let rows: Vec<f64> = fields[4..].iter().map(|f| f.parse().expect("a number")).collect();
            assert_eq!(rows, view.to_world.as_flattened(), "{frame:?}");
            seen[1] += usize::from(!view.visible);
        }
        for [x, z] in points {
            let ray = Ray::new([x, 9.0, z], [0.0, -1.0, 0.0]);
            let hit = scene.nearest(&ray).unwrap_or(Hit::MISS);
            let line = lines.next().expect("a hit");
            let fields: Vec<&str> = line.split(' ').collect();
            assert_eq!(fields[1].parse::<f32>().expect("a number").to_bits(), hit.t.to_bits(), "{frame:?}");
            let surface = [hit.primitive.instance, hit.primitive.triangle].map(|n| n.to_string());
            assert_eq!(fields[2..], surface, "{frame:?}");
        }
    }
    assert_eq!((lines.next(), seen), (None, [1, 1]), "an error at frame 3, nothing to see at frame 4");
}

/// The mesh of `compile.c`.
fn hills() -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    const SIDE: u32 = 40;
    let grid = |side: u32| (0..side).flat_map(move |y| (0..side).map(move |x| (x, y)));
    let positions = grid(SIDE).map(|(x, y)| [x as f32, y as f32, (x * y % 7) as f32 / 8.0]).collect();
    let faces = grid(SIDE - 1).map(|(x, y)| y * SIDE + x);
    let triangles =
        faces.flat_map(|at| [[at, at + 1, at + SIDE], [at + 1, at + SIDE + 1, at + SIDE]]).collect();
    (positions, triangles)
}

#[test]
fn a_c_program_compiles_in_memory_and_gets_the_bytes_of_rust() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(program) = program(folder.path(), "compile.c", &["bth", "bth_compile"]) else { return };
    let [mesh, scene] = ["mesh.bth", "scene.bth"].map(|name| folder.path().join(name));
    let output = run(&program, &[&mesh, &scene].map(|path| path.to_str().expect("UTF-8")), "");
    assert!(output.status.success(), "{output:?}");

    let (positions, triangles) = hills();
    let hills = TriangleMesh { positions: &positions, triangles: &triangles };
    let mut options =
        CompileOptions { structure: Structure::Bvh, keep_subtrees: false, ..CompileOptions::default() };
    options.bvh.quality = bth_compile::bvh::Quality::Fast;
    let (compiled, _) = memory::compile(hills, &options, &Silent).expect("it compiles");
    assert!(std::fs::read(mesh).expect("a file") == compiled.bytes);
    let instance = |z| Instance { mesh: 0, to_world: [[1., 0., 0., 0.], [0., 1., 0., 0.], [0., 0., 1., z]] };
    let instances = [instance(0.0), instance(-50.0)];
    let outcome = memory::compile_scene(&[hills], &instances, &options, &Cache::none(), &Silent);
    let content = outcome.expect("it compiles").content.expect("the content");
    assert!(std::fs::read(scene).expect("a file") == content.bytes().expect("bytes").as_ref());
}

#[test]
fn a_cpp_program_uses_scenes_that_close_themselves() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(program) = program(folder.path(), "scene.cpp", &["bth", "bth_compile"]) else { return };
    let absent = folder.path().join("absent.bth");
    let output = run(&program, &[absent.to_str().expect("UTF-8")], "");
    assert!(output.status.success(), "{output:?}");
}
