//! Material libraries of OBJ files: names, what is told of what is not kept, and how often they are
//! read.

use super::*;
use bth_import::import_images;
use std::path::Path;

/// The red parts of the materials of an OBJ file with one triangle of each of these materials, next
/// to a library of this text, and the warnings.
fn obj_materials(folder: &Path, statements: &str, library: &[u8]) -> (Vec<f32>, Vec<String>) {
    let path = folder.join("a.obj");
    std::fs::write(folder.join("a.mtl"), library).unwrap();
    std::fs::write(&path, format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{statements}")).unwrap();
    let heard = Listener::default();
    let (mesh, _) = import(&path, everything(), &heard).unwrap();
    let red = mesh.materials.unwrap().parameters.iter().map(|material| material.base_color[0]).collect();
    (red, heard.0.into_inner().unwrap())
}

#[test]
fn names_of_obj_materials_may_have_hashes_and_libraries_a_byte_order_mark() {
    let folder = tempfile::tempdir().unwrap();
    let library = b"\xEF\xBB\xBFnewmtl Material #1 # red\nKd 1 0 0\nnewmtl #2\nKd 0.5 # grey\n";
    let faces = "mtllib a.mtl # colours\nusemtl Material #1\nf 1 2 3\nusemtl #2 # darker\nf 1 2 3\n";
    assert_eq!(obj_materials(folder.path(), faces, library), (vec![1.0, 0.5], Vec::new()));
}

#[test]
fn maps_without_a_file_are_none_and_told() {
    let folder = tempfile::tempdir().unwrap();
    let library = b"newmtl red\nmap_Kd\nmap_Ke -s 1 1 1 # none\nmap_d \nKd 1 0 0\nnewmtl grey\nKd 0.5\n";
    let faces = "mtllib a.mtl\nusemtl red\nf 1 2 3\nusemtl grey\nf 1 2 3\n";
    let told = "materials: not kept are map_d without a file, map_kd without a file, map_ke without a file"
        .to_owned();
    assert_eq!(obj_materials(folder.path(), faces, library), (vec![1.0, 0.5], vec![told]));
}

#[test]
fn materials_whose_names_are_not_utf8_are_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    // Red and blue in GBK, which differ in bytes that are not UTF-8.
    let [red, blue] = [&b"\xBA\xEC\xC9\xAB"[..], b"\xC0\xB6\xC9\xAB"];
    let library = [b"newmtl ", red, b"\nKd 1 0 0\nnewmtl ", blue, b"\nKd 0 0 1\n"].concat();
    std::fs::write(folder.path().join("a.mtl"), library).unwrap();
    let path = folder.path().join("a.obj");
    let text = [
        b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl ",
        red,
        b"\nf 1 2 3\nusemtl ",
        blue,
        b"\nf 3 2 1\n",
    ]
    .concat();
    std::fs::write(&path, text).unwrap();
    let parameters = import(&path, everything(), &Silent).unwrap().0.materials.unwrap().parameters;
    let colors: Vec<_> = parameters.iter().map(|material| material.base_color).collect();
    assert_eq!(colors, [[1.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0]]);
}

#[test]
fn a_library_that_is_named_before_every_face_is_read_once() {
    let folder = tempfile::tempdir().unwrap();
    let mut library = b"newmtl red\nKd 1 0 0\n".to_vec();
    library.extend(b"# what takes long to read again and again\n".repeat(20_000));
    let faces = "mtllib a.mtl\nusemtl red\nf 1 2 3\nmtllib ./a.mtl a.mtl\n".repeat(20_000);
    let start = std::time::Instant::now();
    let (red, warnings) = obj_materials(folder.path(), &faces, &library);
    assert_eq!((red, warnings), (vec![1.0], Vec::new()));
    let path = folder.path().join("a.obj");
    let looks = bth_import::Looks { materials: true, ..Default::default() };
    let files = bth_import::source_files(&path, looks).unwrap();
    assert_eq!(files, [path.as_path(), &folder.path().join("a.mtl")]);
    assert!(import_images(&path, looks, &Silent).unwrap().is_empty());
    // Reading it 40,000 times would take minutes.
    assert!(start.elapsed().as_secs() < 20);
}
