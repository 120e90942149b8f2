//! A stage whose results change gets a new version in its file in `pipeline/`: otherwise caches
//! would serve the old results.
// Tests print what they skip.
#![allow(clippy::print_stdout)]

use bth_cache::Store;
use bth_compile::Shard;
use bth_compile::cached::Cache;
use bth_compile::costs::Select;
use bth_compile::pipeline::{CompileOptions, Structure, compile_cached, compile_parts};
use std::fmt::Write;
use std::path::Path;

/// What the stages made of the model below, as `stage version BLAKE3`. If this test fails because a
/// stage was changed on purpose, raise the stage's version and note what the test prints.
const NOTED: &str = "\
bvh 4 043679c3f848da987a52b08afe248852a63686e9ba7fe1f9f3f44a3c4b3a8de3
file 8.65536 109c22e97eb9e6999d125d18a6e098e03cfc392ab97ed88aa0e1e38c762289be
marks 1 f1700307c15a7f23fface5b89ee0ce399fac1b93c7dd43e36616475cc7f08b70
mesh 10 f9a832bfbe932ba0eec21e4aeddd484d9703aa6ac684d191644612e7ba299c39
part 2 33809ba4ea5b8e40ca6fb61dd6bdc42d7fc59c38c1f95e484c6bfd48fff858bc
";

/// As above for the tetrahedralization of a whole model, by the TetGen that made it: others make
/// others, as do other processors' floating-point instructions.
const NOTED_TETS: &str = "tets 1 by 1.5: 31de18e7856ad5bd3674f79c451457618bfa5c7f03af3f47b6363bcdfb702072";

/// All work.
const ONLY: Shard = Shard { number: 1, of: 1 };

/// A bumpy field of 32 by 32 squares and a triangle through it, in small whole numbers.
fn model() -> String {
    let mut text = String::new();
    for (y, x) in (0..33u32).flat_map(|y| (0..33u32).map(move |x| (y, x))) {
        writeln!(text, "v {x} {y} {}", (x * x * 7 + y * y * 13 + x * y * 5) % 11).unwrap();
    }
    text += "v 3 3 -9\nv 4 5 30\nv 9 4 30\n";
    for (y, x) in (0..32u32).flat_map(|y| (1..33u32).map(move |x| (y, x))) {
        let (a, b) = (33 * y + x, 33 * (y + 1) + x);
        writeln!(text, "f {a} {} {} {b}", a + 1, b + 1).unwrap();
    }
    text + "f 1090 1091 1092\n"
}

/// The stages' versions and what they made.
fn made(folder: &Path) -> String {
    let source = folder.join("model.obj");
    std::fs::write(&source, model()).unwrap();
    let store = Store::open(&folder.join("cache"), 1 << 30).unwrap();
    for structure in [Structure::Bvh, Structure::Bth] {
        let mut options = CompileOptions { structure, ..CompileOptions::default() };
        // No node is large enough: whether there is a worker makes no difference.
        options.costs.minimum_triangles = 1 << 20;
        // With given nodes all are marked, whatever they can gain.
        if structure == Structure::Bth {
            options.costs.select = Select::Nodes(Vec::new());
        }
        let cache = Cache::new(&store, "model");
        compile_cached(&source, &options, &cache, &|_| true, &bth_compile::Silent).unwrap();
        options.part_triangles = 1000;
        compile_parts(&source, &options, &cache, ONLY, &bth_compile::Silent).unwrap();
    }
    let mut text = String::new();
    for entry in store.list() {
        let of =
            |name: &str| entry.components.iter().find(|(n, _)| n == name).map(|(_, value)| value.as_str());
        let is_one = match &*entry.stage {
            "file" => of("structure") == Some("bvh"),
            "part" => of("part") == Some("2 of 16"),
            _ => true,
        };
        if !is_one {
            continue;
        }
        let version = of(&format!("{} version", entry.stage)).unwrap();
        writeln!(text, "{} {version} {}", entry.stage, entry.blob.hex()).unwrap();
    }
    text
}

#[test]
fn stages_that_make_something_else_have_another_version() {
    let folder = tempfile::tempdir().unwrap();
    let made = made(folder.path());
    assert_eq!(made, NOTED, "raise the version of the stage that changed, then note\n{made}");
}

/// A torus of 24 by 12 squares in whole numbers.
fn torus() -> String {
    let mut text = String::new();
    let point = |i: u32, j: u32| {
        let turn = |k: u32, of: u32| std::f64::consts::TAU * f64::from(k) / f64::from(of);
        let (a, b) = (turn(i, 24), turn(j, 12));
        let radius = 3000.0 + 1000.0 * b.cos();
        [radius * a.cos(), 1000.0 * b.sin(), radius * a.sin()].map(|x| x.round() as i32)
    };
    for (i, j) in (0..24).flat_map(|i| (0..12).map(move |j| (i, j))) {
        let [x, y, z] = point(i, j);
        writeln!(text, "v {x} {y} {z}").unwrap();
    }
    let at = |i: u32, j: u32| 12 * (i % 24) + j % 12 + 1;
    for (i, j) in (0..24).flat_map(|i| (0..12).map(move |j| (i, j))) {
        let corners = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
        writeln!(text, "f {} {} {} {}", corners[0], corners[1], corners[2], corners[3]).unwrap();
    }
    text
}

/// The worker that is built next to the tests, if there is one.
fn worker() -> Option<std::path::PathBuf> {
    let tests = std::env::current_exe().ok()?;
    let beside = tests.parent()?.parent()?.join("bth-tetgen");
    let named = std::env::var_os("BTH_TETGEN").map(std::path::PathBuf::from);
    named.or(Some(beside)).filter(|path| path.is_file())
}

#[test]
fn tetrahedralizations_that_are_other_ones_have_another_version() {
    let Some(worker) = worker() else {
        println!("skipped: there is no worker");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("model.obj");
    std::fs::write(&source, torus()).unwrap();
    let store = Store::open(&folder.path().join("cache"), 1 << 30).unwrap();
    let mut options = CompileOptions { structure: Structure::Tets, ..CompileOptions::default() };
    options.tets.worker = Some(worker);
    let cache = Cache::new(&store, "model");
    compile_cached(&source, &options, &cache, &|_| true, &bth_compile::Silent).unwrap();
    let entries = store.list();
    let tets: Vec<_> = entries.iter().filter(|entry| entry.stage == "tets").collect();
    assert_eq!(tets.len(), 1, "the whole model");
    let of = |name: &str| tets[0].components.iter().find(|(n, _)| n == name).map(|(_, value)| value.as_str());
    let by = format!("tets {} by {}: ", of("tets version").unwrap(), of("tetgen").unwrap());
    let made = format!("{by}{}", tets[0].blob.hex());
    let noted_by = NOTED_TETS.split(" by ").nth(1).and_then(|noted| noted.split(": ").next());
    if noted_by != of("tetgen") || !cfg!(target_arch = "x86_64") {
        println!("skipped: the noted one is of another TetGen than {made}");
        return;
    }
    assert_eq!(made, NOTED_TETS, "raise the version of the stage, then note this");
}
