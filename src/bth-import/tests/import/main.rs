//! Import of models: what each format yields, what is refused and where, and the collected test
//! models.

mod compressed;
mod concave;
mod cutouts;
mod damaged_scenes;
mod data;
#[cfg(feature = "fbx")]
mod fbx;
mod gltf;
mod gltf_nodes;
mod groups;
mod joints;
mod lenient;
mod many_meshes;
mod materials;
mod memory;
mod mtl;
mod obj;
mod off;
mod ply;
mod quantized;
mod rest_pose;
mod rounding;
mod sequence;
mod stl;
mod textures;
#[cfg(feature = "3mf")]
mod threemf;

use std::sync::Mutex;

use bth_import::error::{Error, Place, Result};
use bth_import::{Keep, Mesh, Monitor, Report, Silent, Wanted, import};
use std::path::Path;

/// The outcome of importing bytes from a file of this name.
fn import_bytes(name: &str, bytes: &[u8], keep: Keep) -> Result<(Mesh, Report)> {
    import_with(name, bytes, keep, &Silent)
}

fn import_with(
    name: &str,
    bytes: &[u8],
    wanted: impl Into<Wanted>,
    monitor: &dyn Monitor,
) -> Result<(Mesh, Report)> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    import(&path, wanted, monitor)
}

/// Code, place (without the file's name) and message of the error that these bytes give.
#[track_caller]
fn refused(name: &str, bytes: &[u8]) -> (&'static str, String, String) {
    let error = import_bytes(name, bytes, Keep::All).expect_err("this should be refused");
    let Error::Input { code, place, message, hint } = &error else { panic!("{error:?}") };
    assert!(!hint.is_empty(), "{error}");
    let place = match place {
        Place::File(_) => "file".to_owned(),
        Place::Line(_, line) => format!("line {line}"),
        Place::Byte(_, byte) => format!("byte {byte}"),
        Place::Part(_, part) => part.clone(),
    };
    (code, place, message.clone())
}

#[track_caller]
fn assert_refused(name: &str, bytes: &[u8], code: &str, place: &str, message_part: &str) {
    let found = refused(name, bytes);
    assert_eq!((found.0, found.1.as_str()), (code, place), "{}", found.2);
    assert!(found.2.contains(message_part), "{}", found.2);
}

/// Checks that a text is refused after each edit: what is replaced by what, code, place, part of
/// the message.
#[track_caller]
fn assert_edits_refused(name: &str, text: &str, edits: &[[&str; 5]]) {
    for [from, to, code, place, message] in edits {
        let edited = text.replace(from, to);
        assert_ne!(edited, text, "{from} does not occur");
        assert_refused(name, edited.as_bytes(), code, place, message);
    }
}

/// Everything that a mesh can have, with polygons as fans.
fn everything() -> Wanted {
    Wanted { attributes: Keep::All, groups: true, materials: true, ..Wanted::default() }
}

/// Imports with these wishes; also returns the warnings.
fn told(path: &Path, wanted: impl Into<Wanted>) -> Result<(Mesh, Vec<String>)> {
    let listener = Listener::default();
    let (mesh, _) = import(path, wanted, &listener)?;
    Ok((mesh, listener.0.into_inner().unwrap()))
}

/// Collects warnings.
#[derive(Default)]
struct Listener(Mutex<Vec<String>>);

impl Monitor for Listener {
    fn warn(&self, message: &str) {
        self.0.lock().unwrap().push(message.to_owned());
    }
}

impl Listener {
    fn heard(&self, part: &str) -> bool {
        self.0.lock().unwrap().iter().any(|warning| warning.contains(part))
    }
}

/// Two triangles of a unit square in the plane z = 0.
const SQUARE: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

#[test]
fn a_missing_file_is_a_file_error() {
    let error = import(Path::new("no/such/model.obj"), Keep::None, &Silent).unwrap_err();
    assert!(matches!(error, Error::File { code: "BTH-O001", .. }), "{error}");
}

#[test]
fn content_of_no_format_is_refused() {
    assert_refused("model.bin", b"PK\x03\x04 something", "BTH-I001", "file", "found a ZIP archive");
}

#[test]
fn what_is_no_model_is_named() {
    let compiled = b"\x89BTH1\r\n\x1a\n\0\0\0\0\0\0\0and more";
    for name in ["model.bth", "model.obj"] {
        assert_refused(name, compiled, "BTH-I001", "file", "found a compiled file");
    }
    assert_refused("scene.manifest", b"version = 1\n", "BTH-I001", "file", "scene manifest");
}

#[test]
fn a_format_is_found_without_its_extension() {
    let (mesh, report) = import_bytes("model", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", Keep::None).unwrap();
    assert_eq!((mesh.triangles.len(), report.format.as_str()), (1, "obj"));
}

#[test]
fn a_cancelled_import_stops() {
    struct Stop;
    impl Monitor for Stop {
        fn cancelled(&self) -> bool {
            true
        }
    }
    let error = import_with("a.obj", b"v 0 0 0\n", Keep::None, &Stop).unwrap_err();
    assert!(matches!(error, Error::Cancelled));
}

#[test]
fn the_report_counts_what_was_read_and_found() {
    let text = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 -0\nv nan 0 0\n\
        f 1 2 3 4\nf 5 3 2\nf 1 2 2\nf 1 2\nl 1 2 3\np 1 2\n";
    let listener = Listener::default();
    let (mesh, report) = import_with("a.obj", text, Keep::None, &listener).unwrap();
    assert_eq!(mesh.positions, SQUARE);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 2, 1], [0, 1, 1]]);
    assert_eq!(
        report,
        Report {
            format: "obj".into(),
            triangles: 4,
            positions_read: 6,
            positions: 4,
            polygons: 1,
            skipped: 4,
            degenerate: 1,
            duplicate: 1,
            boundary_edges: 2,
            non_manifold_edges: 1,
            components: 1,
            non_finite_unused: 1,
            ..Report::default()
        }
    );
    assert!(listener.heard("1 positions are not finite"));
}

#[test]
fn a_byte_order_mark_before_text_is_passed_over() {
    let marked = |text: &str| [b"\xEF\xBB\xBF", text.as_bytes()].concat();
    let gltf = "{\"asset\": {\"version\": \"2.0\"}}";
    let corners = "0 0 0\n1 0 0\n0 1 0\n";
    let header = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    let ply = format!("ply\nformat ascii 1.0\n{header}{corners}3 0 1 2\n");
    let stl =
        "solid\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n";
    let off = format!("OFF\n3 1 0\n{corners}3 0 1 2\n");
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    for (name, text, triangles) in
        [("a.obj", obj, 1), ("a.off", &off, 1), ("a.stl", stl, 1), ("a.ply", &ply, 1), ("a.gltf", gltf, 0)]
    {
        for name in [name, "a"] {
            let (mesh, _) = import_bytes(name, &marked(text), Keep::None).expect(text);
            assert_eq!(mesh.triangles.len(), triangles, "{text}");
        }
    }
    // Places count from the start of the file: lines from the first one, bytes including the mark.
    assert_refused("a.obj", &marked("v 0 0 0\nf 1 2 3\n"), "BTH-I005", "line 2", "from 1 to 1");
    let mut binary = marked(&format!("ply\nformat binary_little_endian 1.0\n{header}"));
    let body = binary.len();
    binary.extend([f32::NAN; 9].iter().flat_map(|x| x.to_le_bytes()));
    binary.extend([3u8, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
    assert_refused("a.ply", &binary, "BTH-I004", &format!("byte {body}"), "NaN");
}
