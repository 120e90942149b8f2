//! The C interface, used by C and C++ programs (`tests/c`) that include its headers and link its libraries only.

use bth::Accept;
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

/// Rays as the C programs read them.
fn lines_of(rays: &[Ray]) -> String {
    let line = |ray: &Ray| {
        let ([a, b, c], [x, y, z]) = (ray.origin, ray.direction);
        format!("{a} {b} {c} {} {x} {y} {z} {}\n", ray.tmin, ray.tmax)
    };
    rays.iter().map(line).collect()
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
    // The rows of OBJ's images go up, those of the transform down.
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
    assert!(
        String::from_utf8_lossy(&text).contains("error -7 bth_surface_at: the file has no positions"),
        "{text:?}"
    );
}

#[test]
fn a_c_program_gets_several_hits_under_conditions() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(program) = c_program(folder.path(), "hits") else { return };
    let model = bth_scenes::knot::torus_knot(720);
    let corners: Vec<_> = (0..model.triangles.len()).map(|i| model.corners(i)).collect();
    let path = folder.path().join("knot.ply");
    bth_scenes::write::file(&model, &path).expect("a model");
    let options = bth_compile::pipeline::Structure::Bvh;
    let options = CompileOptions { structure: options, ..CompileOptions::default() };
    let (compiled, _) = compile(&path, &options, &Silent).expect("the knot compiles");
    let file = folder.path().join("knot.bth");
    std::fs::write(&file, &compiled.bytes).expect("a file");
    let scene = bth::open(&file).expect("the knot opens");

    let rays: Vec<Ray> = bth_tests::rays::assorted(&corners, 16, 22);
    let output = run(&program, &[file.to_str().expect("UTF-8")], &lines_of(&rays));
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).expect("text");
    let mut lines = text.lines();
    let even = |_: &Ray, hit: &Hit| hit.primitive.triangle.is_multiple_of(2);
    let everything = Accept::default();
    let mut counts = String::new();
    for accept in [everything, Accept { filter: Some(&even), ..everything }] {
        for ray in &rays {
            let mut hits = Vec::new();
            scene.all_hits(ray, &accept, &mut hits);
            let first = hits.first().copied().unwrap_or(Hit::MISS);
            let field: Vec<&str> = lines.next().expect("a line for each ray").split(' ').collect();
            let number = |i: usize| field[i].parse::<f32>().expect("a number").to_bits();
            assert_eq!(field[0], u8::from(!hits.is_empty()).to_string());
            assert_eq!(field[1], hits.len().to_string());
            assert_eq!(number(2), first.t.to_bits(), "{ray:?}");
            assert_eq!(field[3], first.primitive.triangle.to_string(), "{ray:?}");
            assert_eq!(field.len(), 4 + 5 * hits.len(), "{ray:?}");
            for (i, hit) in hits.iter().enumerate() {
                let at = 4 + 5 * i;
                assert_eq!(
                    [number(at), number(at + 1), number(at + 2)],
                    [hit.t, hit.u, hit.v].map(f32::to_bits)
                );
                assert_eq!(field[at + 3], hit.primitive.instance.to_string());
                assert_eq!(field[at + 4], hit.primitive.triangle.to_string());
            }
            if accept.filter.is_none() {
                counts += &format!("{} ", hits.len());
            }
        }
    }
    let none = "0 ".repeat(rays.len());
    assert_eq!(lines.collect::<Vec<_>>(), [none.as_str(), &counts, &counts]);
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

#[test]
fn a_c_program_builds_a_scene_of_two_files_as_rust_does() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(program) = c_program(folder.path(), "builder") else { return };
    let quad = "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nf 4 3 2 1\n";
    let model = folder.path().join("quad.obj");
    std::fs::write(&model, quad).expect("a model");
    let manifest = bth_scene::parse(SCENE, Path::new("wheel.manifest")).expect("a manifest");
    let options = CompileOptions::default();
    let (moving, _) =
        bth_compile::scene::compile(&manifest, folder.path(), Path::new("wheel"), &options, &Silent)
            .expect("the wheel compiles");
    let (still, _) = compile(&model, &options, &Silent).expect("the quad compiles");
    let files = [("still", &still.bytes), ("moving", &moving.bytes)].map(|(name, bytes)| {
        let file = folder.path().join(name);
        std::fs::write(&file, bytes).expect("a file");
        file.to_str().expect("UTF-8").to_owned()
    });
    let points: Vec<[f32; 2]> =
        (0..60).map(|i| [0.8 * i as f32 - 20.0, 0.3 * (i % 5) as f32 - 0.7]).collect();
    let input: String = points.iter().map(|[x, z]| format!("{x} {z}\n")).collect();
    let output = run(&program, &files.each_ref().map(String::as_str), &input);
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).expect("text");

    let mut expected = String::new();
    let mut builder = bth::SceneBuilder::new();
    let [quad, wheel] =
        [&still.bytes, &moving.bytes].map(|b| builder.add(&bth::from_bytes(b).expect("a file")));
    let at = |x: f32, y: f32, z: f32, s: f32| [s, 0.0, 0.0, x, 0.0, s, 0.0, y, 0.0, 0.0, s, z];
    let line = |i: u32, step: f32, z: f32| at(2.5 * i as f32 - 20.0, step * i as f32, z, 1.0);
    let ids: Vec<u32> =
        (0..20).map(|i| builder.instance(quad, &line(i, 0.1, 0.0)).expect("an object")).collect();
    let subscene = builder.subscene(wheel, &at(0.0, 3.0, 0.0, 0.5)).expect("a scene");
    let rays: Vec<Ray> = points.iter().map(|[x, z]| Ray::new([*x, 9.0, *z], [0.0, -1.0, 0.0])).collect();
    let mut commit = |builder: &mut bth::SceneBuilder| {
        expected += &match builder.commit() {
            Ok(u) => format!(
                "update {} {} {} {} {}\n",
                u.nodes,
                u.placed,
                u.visible,
                u32::from(u.rebuilt),
                u.cost_ratio
            ),
            Err(error) => format!("error -6 bth_builder_commit: {error}\n"),
        };
        let mut hits = vec![Hit::MISS; rays.len()];
        builder.scene().batch(&rays).nearest(&mut hits);
        for hit in &hits {
            expected += &format!("hit {} {} {}\n", hit.t, hit.primitive.instance, hit.primitive.triangle);
        }
        hits.iter().filter(|hit| hit.is_hit()).count()
    };
    assert!(commit(&mut builder) > 30);
    let many: Vec<_> = (0..20).map(|i| line(i, 0.2, 0.5)).collect();
    builder.set_transforms(&ids, &many).expect("instances");
    builder.set_subscene_seconds(subscene, 0.8).expect("a subscene");
    commit(&mut builder);
    builder.set_visible(ids[8], false).expect("an instance");
    builder.remove(ids[9]).expect("an instance");
    commit(&mut builder);
    builder.set_transform(ids[3], &at(0.0, 0.0, 0.0, 0.0)).expect("an instance");
    commit(&mut builder);
    builder.set_transform(ids[3], &at(-1.0, 1.0, 0.25, -2.0)).expect("an instance");
    commit(&mut builder);
    builder.set_subscene_transform(subscene, &at(4.0, 3.0, 0.0, 1.0)).expect("a subscene");
    commit(&mut builder);
    builder.set_subscene_visible(subscene, false).expect("a subscene");
    commit(&mut builder);
    builder.remove_subscene(subscene).expect("a subscene");
    commit(&mut builder);
    // C prints numbers in another way.
    let fields = |text: &str| -> Vec<Vec<String>> {
        let number = |field: &str| field.parse::<f32>().map_or(field.to_owned(), |x| x.to_string());
        text.lines().map(|line| line.split(' ').map(number).collect()).collect()
    };
    assert_eq!(fields(&text), fields(&expected));
}

#[test]
fn a_c_program_counts_crossings_and_finds_points_inside() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(program) = c_program(folder.path(), "inside") else { return };
    let mut model = bth_scenes::Model::default();
    // Two tetrahedra, one in the other, whose vertices lie on the grid.
    for size in [8.0, 2.0] {
        let first = model.positions.len() as u32;
        model.positions.extend([[0.0; 3], [size, 0.0, 0.0], [0.0, size, 0.0], [0.0, 0.0, size]]);
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        model.triangles.extend(faces.map(|face: [u32; 3]| face.map(|v| first + v)));
    }
    let path = folder.path().join("model.ply");
    bth_scenes::write::file(&model, &path).expect("a model");
    let options =
        CompileOptions { structure: bth_compile::pipeline::Structure::Bvh, ..CompileOptions::default() };
    let (compiled, _) = compile(&path, &options, &Silent).expect("the model compiles");
    let file = folder.path().join("model.bth");
    std::fs::write(&file, &compiled.bytes).expect("a file");
    let out = run(&program, &[file.to_str().expect("UTF-8")], "3 2 1\n0.5 0.5 0.5\n0 0 0\n8 0 0\n-1 2 2\n");
    assert!(out.status.success(), "{out:?}");
    let expected = "1 1 1 1\n2 1 2 2\n2 1 2 2\n0 0 0 0\n0 0 0 0\n";
    assert_eq!(String::from_utf8_lossy(&out.stdout), expected);
}

#[test]
fn a_c_program_finds_the_closest_points_that_rust_finds() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(program) = c_program(folder.path(), "closest") else { return };
    let model = bth_scenes::blob::blob(200);
    let corners: Vec<_> = (0..model.triangles.len()).map(|i| model.corners(i)).collect();
    let file = folder.path().join("blob.bth");
    std::fs::write(&file, bth_tests::placed_soup::placed_soup(&corners, &[])).expect("a file");
    let scene = bth::open(&file).expect("the blob opens");
    let mut points: Vec<[f32; 3]> = corners.iter().step_by(20).map(|t| t[0].map(|x| x * 0.5)).collect();
    points.extend([corners[0][1], [7.0, -2.0, 0.5], [0.0; 3]]);
    points.truncate(16);
    let input: String = points.iter().map(|[x, y, z]| format!("{x} {y} {z}\n")).collect();
    let output = run(&program, &[file.to_str().expect("UTF-8")], &input);
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).expect("text");
    assert_eq!(text.lines().count(), points.len());
    let mut found = Vec::new();
    for (line, point) in text.lines().zip(&points) {
        let c = scene.closest(*point, f32::INFINITY).expect("a closest point");
        let [x, y, z] = c.point;
        let signed = scene.signed_distance(*point);
        assert_eq!((signed.abs(), signed < 0.0), (c.distance, scene.contains(*point) && c.distance > 0.0));
        scene.triangles_in_sphere(*point, c.distance, &mut found);
        let (near, first) = (found.len(), found[0].triangle);
        scene.triangles_in_box(c.point, c.point, &mut found);
        let field: Vec<&str> = line.split(' ').collect();
        let numbers: Vec<f32> =
            [0, 1, 2, 3, 4, 5, 9].iter().map(|&i| field[i].parse().expect("a number")).collect();
        assert_eq!(numbers, [c.distance, x, y, z, c.u, c.v, signed], "{point:?}");
        let rest = [c.primitive.instance, c.primitive.triangle, c.feature.code(), near as u32, first];
        let rest = rest.into_iter().chain([found.len() as u32]).map(|n| n.to_string());
        assert!(rest.eq([6, 7, 8, 10, 11, 12].map(|i| field[i].to_owned())), "{line}");
    }
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
