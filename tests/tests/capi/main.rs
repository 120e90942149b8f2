//! The C interface, used by C and C++ programs (`tests/c`) that include its headers and link its
//! libraries only.

mod compile_double;
mod double;
mod queries;
mod scenes;
mod starts;

use crate::queries::hills;
use bth::rays::{Hit, Ray};
use bth_compile::Silent;
use bth_compile::cached::Cache;
use bth_compile::memory::{self, Instance, PositionRows, TriangleMesh};
use bth_compile::pipeline::{CompileOptions, compile};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// Builds the library and the C program; `None` without a C compiler.
pub(crate) fn c_program(folder: &Path, name: &str) -> Option<PathBuf> {
    program(folder, &format!("{name}.c"), &["bth"])
}

/// Builds the libraries and a program of `tests/c` that uses them. Without a compiler prints why
/// not, and returns `None`.
#[allow(clippy::print_stdout)]
pub(crate) fn program(folder: &Path, source: &str, libraries: &[&str]) -> Option<PathBuf> {
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

pub(crate) fn run(program: &Path, arguments: &[&str], input: &str) -> Output {
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

/// Rays as the C programs read them.
pub(crate) fn lines_of(rays: &[Ray]) -> String {
    let line = |ray: &Ray| {
        let ([a, b, c], [x, y, z]) = (ray.origin, ray.direction);
        format!("{a} {b} {c} {} {x} {y} {z} {}\n", ray.tmin, ray.tmax)
    };
    rays.iter().map(line).collect()
}

/// The declarations of functions in a text of C, with single blanks.
fn declarations(text: &str) -> std::collections::BTreeSet<String> {
    let code: String =
        text.split("/*").map(|part| part.split_once("*/").map_or(part, |(_, code)| code)).collect();
    let lines = code.lines().filter(|line| !line.starts_with(['#', '`', 'e', 'l']));
    let code = lines.collect::<Vec<_>>().join(" ");
    let words = code.split(';').map(|one| one.split_whitespace().collect::<Vec<_>>().join(" "));
    let found = words.map(|one| one.trim_start_matches(['}', ' ']).to_owned());
    found
        .filter(|one| one.contains(" bth_") || one.contains("*bth_"))
        .filter(|one| one.ends_with(')'))
        .collect()
}

#[test]
fn the_page_has_every_function_of_the_headers() {
    let read = |path: &str| {
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)).expect(path)
    };
    let headers = ["src/bth-capi/include/bth.h", "src/bth-compile-capi/include/bth_compile.h"];
    let mut of_headers: Vec<_> = headers.iter().flat_map(|path| declarations(&read(path))).collect();
    let page = read("docs/c.md");
    let blocks = page.split("\n```").skip(1).step_by(2).filter_map(|block| block.strip_prefix("text\n"));
    let mut of_page: Vec<_> = blocks.flat_map(declarations).collect();
    of_headers.sort();
    of_page.sort();
    of_headers.retain(|one| !one.starts_with("typedef"));
    assert!(of_page.len() > 80 && of_page == of_headers, "{of_page:#?}\n{of_headers:#?}");
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
    let input = lines_of(&rays);
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
            assert_eq!(field[5], u8::from(scene.any(ray)).to_string());
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

#[test]
fn a_c_program_reads_how_surfaces_look() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(program) = c_program(folder.path(), "materials") else { return };
    let model = folder.path().join("colored.obj");
    let text = "mtllib colored.mtl\nv 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nvt 0 0\nvt 1 0\nvt 0 1\n\
                usemtl lamp\nf 1/1 2/2 3/3\nusemtl glass\nf 1/1 3/3 2/2\n";
    std::fs::write(&model, text).expect("a model");
    let materials = "newmtl lamp\nKd 0.5 0.25 1\nKe 2 1 0\nmap_Kd grey.png\nnewmtl glass\nKd 1 1 1\nd 0.5\n";
    std::fs::write(folder.path().join("colored.mtl"), materials).expect("materials");
    let mut grey = Vec::new();
    let mut encoder = png::Encoder::new(&mut grey, 1, 1);
    encoder.set_color(png::ColorType::Rgba);
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(&[188, 188, 188, 255]).expect("a texel");
    drop(writer);
    std::fs::write(folder.path().join("grey.png"), &grey).expect("an image");
    let file = folder.path().join("colored.bth");
    let shown = |options: CompileOptions| {
        let (compiled, _) = compile(&model, &options, &Silent).expect("it compiles");
        std::fs::write(&file, &compiled.bytes).expect("a file");
        let output = run(&program, &[file.to_str().expect("UTF-8")], "");
        assert!(output.status.success(), "{output:?}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let attributes = bth_import::Keep::All;
    let kept =
        shown(CompileOptions { attributes, names: true, materials: true, ..CompileOptions::default() });
    // The rows of OBJ's images go up, the rows of the transform down.
    let expected = format!(
        "material 0.5 0.25 1 1 emissive 2 1 0 alpha 0 0 flags 1 textures 0 -1\n\
        material 1 1 1 0.5 emissive 0 0 0 alpha 2 0 flags 1 textures -1 -1\n\
        texture of image 0: {} bytes, 0, wrap 0 0 nearest 0 set 0 transform 1 0 0 0 -1 1\ncolor 1 0 0 1\nset 0: 0.25 0.25\n",
        grey.len()
    );
    assert_eq!(kept, expected);
    let second =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../format-spec/conformance/valid/second-uvs.bth");
    let output = run(&program, &[second.to_str().expect("UTF-8")], "");
    let found = String::from_utf8_lossy(&output.stdout);
    assert!(found.contains("nearest 0 set 0 ") && found.contains("nearest 0 set 1 "), "{found}");
    // A quarter of the way from (0.5, 0.25) to (-1, 2).
    assert!(found.ends_with("set 0: 0.25 0.25\nset 1: 0.125 0.688\n"), "{found}");
    let gloss = second.with_file_name("gloss.bth");
    let output = run(&program, &[gloss.to_str().expect("UTF-8")], "");
    let found = String::from_utf8_lossy(&output.stdout);
    assert!(found.starts_with("gloss 1 0.25 scale 1 strength 1 textures 1 0 -1\n"), "{found}");
    let names = shown(CompileOptions { names: true, ..CompileOptions::default() });
    let error =
        "error -7 bth_material: the file keeps only the names of materials; compile it with --materials\n";
    assert_eq!(
        names,
        format!("{error}{error}error -7 bth_vertex_color: the file keeps no vertex colors of the triangle\n")
    );
}

#[test]
fn a_c_program_reads_what_hits_lead_to() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(program) = c_program(folder.path(), "surface") else { return };
    let model = folder.path().join("corner.obj");
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0 0.6 0.8\ng floor\nusemtl wood\n\
                f 1/1/1 2/2/1 3/3/1\ng wall\nf 1/1/1 3/2/1 4/3/1\n";
    std::fs::write(&model, text).expect("a model");
    let attributes = bth_import::Keep::All;
    let options = CompileOptions { attributes, names: true, ..CompileOptions::default() };
    let (compiled, _) = compile(&model, &options, &Silent).expect("it compiles");
    let file = folder.path().join("corner.bth");
    std::fs::write(&file, &compiled.bytes).expect("a file");
    let input = "0.25 0.5 3 0 0 -1\n3 0.5 0.25 -1 0 0\n9 9 9 1 0 0\n";
    let output = run(&program, &[file.to_str().expect("UTF-8")], input);
    assert!(output.status.success(), "{output:?}");
    let expected = "bounds 0 0 0 1 1 1\nobject  groups 2 materials 1\n \
        at 0.25 0.5 0 plane 0 0 1 normal 0 0.60000000953674293 0.79999999284744272 corner 0 0 0 uv 0.25 0.5 object 0 group floor \
        material wood flags 1\n \
        at 0 0.5 0.25 plane 1 0 0 normal 0 0.60000000953674293 0.79999999284744272 corner 0 0 0 uv 0.5 0.25 object 0 group wall \
        material wood flags 1\nerror -1 bth_surface_at: there is no instance 4294967295\n";
    assert_eq!(String::from_utf8_lossy(&output.stdout), expected);

    let nothing = CompileOptions { geometry: false, ..CompileOptions::default() };
    let (compiled, _) = compile(&model, &nothing, &Silent).expect("it compiles");
    std::fs::write(&file, &compiled.bytes).expect("a file");
    let text = run(&program, &[file.to_str().expect("UTF-8")], "0.25 0.5 3 0 0 -1\n").stdout;
    let text = String::from_utf8_lossy(&text);
    assert!(text.contains("at 0.25 0.5 0 plane 0 0 1 normal 0 0 1 corner 0 0 0"), "{text}");
}

#[test]
fn a_c_program_compiles_in_memory_and_gets_the_bytes_of_rust() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(program) = program(folder.path(), "compile.c", &["bth", "bth_compile"]) else { return };
    let [mesh, scene] = ["mesh.bth", "scene.bth"].map(|name| folder.path().join(name));
    let output = run(&program, &[&mesh, &scene].map(|path| path.to_str().expect("UTF-8")), "");
    assert!(output.status.success(), "{output:?}");
    // No system has as much memory for the stack of a thread.
    let output = Command::new(&program).env("RUST_MIN_STACK", (1u64 << 47).to_string()).output();
    let output = output.expect("the C program ends");
    assert!(output.status.success(), "{output:?}");

    let (positions, triangles) = hills();
    let hills = TriangleMesh { positions: PositionRows::F32(&positions), triangles: &triangles };
    let options = CompileOptions::fast();
    let (compiled, _) = compile(hills, &options, &Silent).expect("it compiles");
    assert!(std::fs::read(mesh).expect("a file") == compiled.bytes);
    let instance = |z| Instance { mesh: 0, to_world: [[1., 0., 0., 0.], [0., 1., 0., 0.], [0., 0., 1., z]] };
    let instances = [instance(0.0), instance(-50.0)];
    let outcome = memory::compile_scene(&[hills], &instances, &options, &Cache::none(), &Silent);
    let content = outcome.expect("it compiles").content.expect("the content");
    assert!(std::fs::read(scene).expect("a file") == content.bytes().expect("bytes in memory").as_ref());
}

#[test]
fn a_cpp_program_uses_scenes_that_close_themselves() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(program) = program(folder.path(), "scene.cpp", &["bth", "bth_compile"]) else { return };
    let absent = folder.path().join("absent.bth");
    let output = run(&program, &[absent.to_str().expect("UTF-8")], "");
    assert!(output.status.success(), "{output:?}");
}
