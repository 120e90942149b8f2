//! Folders, files and small scenes for the tests.

use bth_compile::Silent;
use bth_compile::pipeline::{CompileOptions, Structure};
use bth_compile::scene::{self, SceneReport};
use bth_import::gltf::Chosen;
use bth_import::gltf::scene::{ImportOptions, ImportReport, import};
use bth_scene::Manifest;
use std::path::{Path, PathBuf};

/// A BVH only: tetrahedra are covered by other tests.
pub(crate) fn options() -> CompileOptions {
    CompileOptions { structure: Structure::Bvh, ..CompileOptions::default() }
}

/// Animated models next to the checkout, or a printed line.
pub(crate) fn animated() -> Vec<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let folder = std::env::var_os("BTH_DATA").map_or(beside, PathBuf::from).join("animated");
    let Ok(entries) = std::fs::read_dir(&folder) else {
        println!("SKIPPED: no animated models at {}", folder.display());
        return Vec::new();
    };
    let mut files: Vec<PathBuf> = entries.map(|e| e.unwrap().path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "glb"));
    files.sort();
    files
}

/// The scene of a glTF file with all its animations.
pub(crate) fn imported(path: &Path) -> (Manifest, ImportReport) {
    let name = path.file_name().unwrap().to_str().unwrap();
    let options = ImportOptions { animation: Chosen::All, ..ImportOptions::default() };
    import(path, name, &options, &Silent).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Compiles a manifest; its files count from `folder`.
pub(crate) fn compiled(manifest: &Manifest, folder: &Path) -> (bth::Scene, SceneReport) {
    let (compiled, report) = scene::compile(manifest, folder, Path::new("x"), &options(), &Silent)
        .unwrap_or_else(|e| panic!("{e}"));
    let file = bth_format::File::from_bytes(&compiled.bytes).unwrap();
    bth_format::verify::verify(&file).unwrap_or_else(|e| panic!("{}", e[0]));
    assert_eq!(report.resident_bytes, file.resident_bytes());
    (bth::from_bytes(&compiled.bytes).unwrap(), report)
}

/// A folder with a closed knot and a quad.
pub(crate) fn models() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    bth_scenes::write::file(&bth_scenes::knot::torus_knot(600), &folder.path().join("knot.ply")).unwrap();
    let quad = "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nf 1 2 3 4\n";
    std::fs::write(folder.path().join("quad.obj"), quad).unwrap();
    folder
}

/// The text of a manifest without its version.
pub(crate) fn manifest(text: &str) -> Manifest {
    bth_scene::parse(&format!("version = 1\n{text}"), Path::new("scene.manifest"))
        .unwrap_or_else(|e| panic!("{e}"))
}

/// Mirrored, sheared, stretched, turning, hidden and overlapping instances, some deep in a
/// hierarchy.
pub(crate) fn varied() -> Manifest {
    let mut text = r#"
frames = { first = 0, last = 40, rate = 10 }
objects = [{ name = "knot", model = "knot.ply" }, { name = "quad", model = "quad.obj" }]
nodes = [
    { name = "turntable" },
    { name = "floor", object = "quad", scale = [30, 1, 30], translation = [0, -3, 0] },
    { name = "mirrored", object = "knot", parent = "turntable", scale = [-1, 1, 1], translation = [4, 0, 0] },
    { name = "flat", object = "knot", parent = "mirrored", scale = [1, 0.01, 3], translation = [0, 6, 0] },
    { name = "sheared", object = "knot", matrix = [[1, 0.7, 0, -5], [0, 1, 0.3, 0], [0.2, 0, -2, 1]] },
    { name = "blinking", object = "knot", translation = [0, 5, 0] },
    { name = "shrinking", object = "knot", translation = [-6, 4, 2] },
    { name = "far", object = "knot", translation = [1000, 300, -700], scale = [40, 40, 40] },
"#
    .to_owned();
    for i in 0..30 {
        let (x, y) = (f64::from(i % 6) * 2.5 - 6.0, f64::from(i / 6) * 1.7 - 3.0);
        text.push_str(&format!(
            "    {{ name = \"k{i}\", object = \"knot\", parent = \"turntable\", translation = [{x}, {y}, -6], \
             rotation = {{ axis = [1, {i}, 3], degrees = {} }} }},\n",
            i * 37
        ));
    }
    text.push_str(
        r#"]
[[tracks]]
node = "turntable"
property = "rotation"
times = [0, 2, 4]
values = [{ axis = [0, 1, 0], degrees = 0 }, { axis = [0, 1, 0.2], degrees = 150 }, { axis = [0, 1, 0], degrees = 300 }]
[[tracks]]
node = "mirrored"
property = "translation"
interpolation = "cubic"
times = [0, 4]
values = [[[0, 0, 0], [4, 0, 0], [3, 3, 0]], [[0, -3, 0], [2, 1, 5], [0, 0, 0]]]
[[tracks]]
node = "blinking"
property = "visible"
times = [0, 1, 3]
values = [true, false, true]
[[tracks]]
node = "shrinking"
property = "scale"
times = [0, 3, 4]
values = [[1, 1, 1], [0, 0, 0], [2, 0.5, 1]]
"#,
    );
    manifest(&text)
}
