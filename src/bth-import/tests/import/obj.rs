use super::*;

const CORNERS: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn faces_are_fans_in_file_order() {
    for (faces, expected) in [
        ("f 1 2 3 4\nf 4 2 1\n", vec![[0, 1, 2], [0, 2, 3], [3, 1, 0]]),
        // Negative indices count back from the last vertex so far.
        ("f -4 -3 -2\nv 9 9 9\nf 1 2 -1\n", vec![[0, 1, 2], [0, 1, 3]]),
        // Corners may leave parts empty.
        ("vt 0 0\nvn 0 0 1\nf 1/1/1 2//1 3/1\nf 1// 2/ 3\n", vec![[0, 1, 2], [0, 1, 2]]),
        // Lines go on after a backslash, and comments end them, also with a backslash.
        ("f 1 2 \\\r\n 3 \\\n 4 # four corners\n", vec![[0, 1, 2], [0, 2, 3]]),
        ("# C:\\models\\\nf 1 2 3\n  # again \\\nf 1 3 4\n", vec![[0, 1, 2], [0, 2, 3]]),
        ("f 1 2 \\\n 3 \\\n# inside \\\nf 1 3 4\n", vec![[0, 1, 2], [0, 2, 3]]),
    ] {
        let text = format!("{CORNERS}{faces}");
        let mesh = import_bytes("a.obj", text.as_bytes(), Keep::All).unwrap().0;
        assert_eq!(mesh.triangles, expected, "{faces}");
    }
}

#[test]
fn faces_may_come_before_their_vertices() {
    let mesh = import_bytes("a.obj", b"f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0", Keep::None).unwrap().0;
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
}

#[test]
fn colours_weights_materials_and_groups_are_ignored() {
    let text = "mtllib absent.mtl\ng a b\nusemtl \u{e9}t\u{e9}\ns off\nv 0 0 0 1 nan 0\nv 1 0 0 1\nv 0 1 0\nf 1 2 3\n";
    let listener = Listener::default();
    let (mesh, _) = import_with("a.obj", text.as_bytes(), Keep::None, &listener).unwrap();
    assert_eq!(mesh.triangles.len(), 1);
    assert!(listener.0.lock().unwrap().is_empty());
}

#[test]
fn vertices_of_two_coordinates_lie_at_z_0() {
    let listener = Listener::default();
    let text = "v 9000000 0 # corner\nv 9000000.25 0\nv 9000000 1 0\nf 1 2 3\n";
    let (mesh, _) = import_with("a.obj", text.as_bytes(), Keep::None, &listener).unwrap();
    assert!(listener.heard("2 vertices have two coordinates; the third is taken as 0"));
    let exact = mesh.exact.unwrap().positions;
    assert_eq!(exact, [[9e6, 0.0, 0.0], [9_000_000.25, 0.0, 0.0], [9e6, 1.0, 0.0]]);
}

#[test]
fn unknown_keywords_are_told_once() {
    let listener = Listener::default();
    import_with("a.obj", b"v 0 0 0\nvw 1 2\nt 1\n", Keep::None, &listener).unwrap();
    assert!(listener.heard("2 lines with unknown keywords are ignored; the first is \"vw\" in line 2"));
}

#[test]
fn attributes_are_indexed_by_pairs() {
    let text = format!("{CORNERS}vt 0 0\nvt 1\nvn 0 0 1\nvn 0 1 0\nf 1/1/1 2/2/1 3/1/1\nf 1/1/2 3/1/1 4\n");
    let mesh = import_bytes("a.obj", text.as_bytes(), Keep::All).unwrap().0;
    let attributes = mesh.attributes.unwrap();
    assert_eq!(attributes.corners, [[0, 1, 0], [2, 0, 3]]);
    assert_eq!(attributes.uvs, [[0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [0.0, 0.0]]);
    assert_eq!(attributes.normals, [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0; 3]]);
    assert!(import_bytes("a.obj", text.as_bytes(), Keep::None).unwrap().0.attributes.is_none());
}

#[test]
fn a_file_without_faces_is_an_empty_mesh() {
    for text in ["", "# nothing\n", CORNERS] {
        let (mesh, report) = import_bytes("a.obj", text.as_bytes(), Keep::All).unwrap();
        assert_eq!((mesh, report.triangles), (Mesh::default(), 0));
    }
}

#[test]
fn refuses_what_is_wrong_at_its_line() {
    for [faces, code, place, message] in [
        ["f 0 1 2\n", "BTH-I005", "line 5", "from 1 to 4, found 0"],
        ["f 1 2 3\nf 1 2 5\nf 1 2 9\n", "BTH-I005", "line 6", "found 5"],
        ["f -5 1 2\n", "BTH-I005", "line 5", "found -5"],
        ["vt 0 0\nf 1/1 2/2 3/1\n", "BTH-I005", "line 6", "vt line, from 1 to 1, found 2"],
        ["vn 0 0 1\nf 1//1 2//1 3//3\n", "BTH-I005", "line 6", "vn line, from 1 to 1, found 3"],
        ["v 1 2,5 3\n", "BTH-I002", "line 5", "found \"2,5\""],
        ["v 1\n", "BTH-I002", "line 5", "expected 2 or more numbers, found \"\""],
        ["f 1 x 3\n", "BTH-I002", "line 5", "found \"x\""],
        ["v 0 nan 0\nf 1 2 5\n", "BTH-I004", "line 5", "NaN"],
        ["# c\nv 0 1.#INF 0\nf 1 2 5\n", "BTH-I004", "line 6", "NaN"],
        ["v 0 1e39 0\nf 1 2 5\n", "BTH-I004", "line 5", "inf"],
        ["vn 0 0 1\nvn 0 inf 1\nf 1//1 2//2 3//1\n", "BTH-I008", "line 6", "finite normal"],
        ["\0\0", "BTH-I006", "byte 32", "expected text"],
        ["# \\\nv nan 0 0\nf 1 2 5\n", "BTH-I004", "line 6", "NaN"],
    ] {
        assert_refused("a.obj", format!("{CORNERS}{faces}").as_bytes(), code, place, message);
    }
}
