//! The C interface, used by a C program (`tests/c/trace.c`) that knows `bth.h` and `libbth` only.

use bth::rays::{Ray, Surface};
use bth_compile::Silent;
use bth_compile::pipeline::{Options, compile};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

#[allow(clippy::print_stdout)]
/// Builds the library and the C program; none, with a line that says why, without a C compiler.
fn c_program(folder: &Path) -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".into());
    if Command::new(&compiler).arg("--version").stdout(Stdio::null()).status().is_err() {
        println!("SKIPPED: no C compiler {compiler}");
        return None;
    }
    let library = bth_tests::built(&["bth-capi"]);
    let program = folder.join("trace");
    let compiled = Command::new(compiler)
        .args(["-std=c11", "-Wall", "-Wextra", "-Werror", "-O1", "-I"])
        .arg(root.join("src/bth-capi/include"))
        .arg(root.join("tests/c/trace.c"))
        .arg("-L")
        .arg(&library)
        .arg("-lbth")
        .arg(format!("-Wl,-rpath,{}", library.display()))
        .arg("-o")
        .arg(&program)
        .status()
        .expect("the C compiler runs");
    assert!(compiled.success(), "trace.c compiles without a warning");
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
    let Some(program) = c_program(folder.path()) else { return };
    let model = folder.path().join("knot.obj");
    bth_scenes::write::file(&bth_scenes::knot::torus_knot(2880), &model).expect("a model");
    let options = Options {
        tets: bth_compile::tets::Options {
            worker: bth_tests::worker().map(Into::into),
            ..Options::default().tets
        },
        ..Options::default()
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
    let hits: Vec<_> = rays.iter().map(|r| scene.nearest(r, Surface::NONE)).collect();
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
            assert_eq!(field[3], hit.surface.instance.to_string());
            assert_eq!(field[4], hit.surface.triangle.to_string());
            assert_eq!(field[5], u8::from(scene.any(ray, hit.surface)).to_string());
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
