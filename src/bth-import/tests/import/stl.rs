use super::*;

fn binary(header: &[u8], corners: &[[[f32; 3]; 3]]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, 0);
    bytes.extend((corners.len() as u32).to_le_bytes());
    for triangle in corners {
        bytes.extend([0; 12]);
        bytes.extend(triangle.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

fn square() -> [[[f32; 3]; 3]; 2] {
    [[0, 1, 2], [0, 2, 3]].map(|t| t.map(|v: usize| SQUARE[v]))
}

const TEXT: &str = "solid a square\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   \
    vertex 1 1 0\n  endloop\n endfacet\nFACET NORMAL 0 0 1\nOUTER LOOP\nVERTEX 0 0 0\nVERTEX 1 1 0\n\
    VERTEX 0 1 0\nENDLOOP\nENDFACET\nendsolid a square\n";

#[test]
fn binary_and_text_give_the_same_mesh() {
    for bytes in [binary(b"exported", &square()), TEXT.into(), TEXT.replace('\n', "\r\n").into()] {
        let (mesh, report) = import_bytes("a.STL", &bytes, Keep::All).unwrap();
        assert_eq!(mesh.positions, SQUARE);
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!((report.positions_read, report.boundary_edges), (6, 4));
    }
}

#[test]
fn a_binary_file_that_begins_with_solid_is_told_by_its_size() {
    let bytes = binary(b"solid not text", &square());
    assert_eq!(import_bytes("a.stl", &bytes, Keep::None).unwrap().0.triangles.len(), 2);
}

#[test]
fn several_solids_are_one_mesh_and_loops_of_four_corners_are_fans() {
    let four = "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\n\
        endloop\nendfacet\nendsolid\n";
    let (mesh, report) = import_bytes("a.stl", format!("{TEXT}{four}").as_bytes(), Keep::None).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 2], [0, 2, 3]]);
    assert_eq!((report.polygons, report.duplicate), (1, 2));
}

#[test]
fn a_solid_without_facets_is_an_empty_mesh() {
    for bytes in [&b"solid Empty\nendsolid Empty"[..], &binary(b"", &[])] {
        assert_eq!(import_bytes("a.stl", bytes, Keep::None).unwrap().0, Mesh::default());
    }
}

#[test]
fn bytes_after_the_last_facet_are_told() {
    let mut bytes = binary(b"", &square());
    bytes.extend([1, 2, 3]);
    let listener = Listener::default();
    assert_eq!(import_with("a.stl", &bytes, Keep::None, &listener).unwrap().0.triangles.len(), 2);
    assert!(listener.heard("3 bytes after the last facet"));
}

#[test]
fn refuses_files_that_are_cut_off() {
    let bytes = binary(b"", &square());
    assert_refused("a.stl", &bytes[..150], "BTH-I003", "byte 150", "expected 2 facets");
    assert_refused("a.stl", &bytes[..83], "BTH-I003", "byte 83", "expected a header of 84 bytes");
    assert_refused("a.stl", b"", "BTH-I003", "byte 0", "header");
    let cut = TEXT.find("endfacet").unwrap();
    assert_refused("a.stl", &TEXT.as_bytes()[..cut], "BTH-I003", "line 8", "expected endfacet");
}

#[test]
fn a_text_may_lack_its_last_line() {
    let (text, listener) = (TEXT.trim_end(), Listener::default());
    let cut = text.rfind('\n').unwrap();
    let whole = import_bytes("a.stl", text.as_bytes(), Keep::None).unwrap().0;
    let mesh = import_with("a.stl", &text.as_bytes()[..cut], Keep::None, &listener).unwrap().0;
    assert_eq!(mesh, whole);
    assert!(listener.heard("ends without endsolid"));
}

#[test]
fn refuses_a_count_of_facets_that_the_file_cannot_hold() {
    let mut bytes = binary(b"", &square());
    bytes[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    assert_refused("a.stl", &bytes, "BTH-I003", "byte 184", "expected 4294967295 facets");
}

#[test]
fn refuses_text_out_of_order() {
    assert_refused("a.stl", b"solid\nvertex 0 0 0\n", "BTH-I002", "line 2", "found \"vertex\"");
    assert_refused("a.stl", b"solid\nouter loop\nvertex 0 0\n", "BTH-I002", "line 3", "three numbers");
}

#[test]
fn refuses_coordinates_that_are_not_finite_where_they_stand() {
    let mut corners = square();
    corners[1][2][0] = f32::NAN;
    assert_refused("a.stl", &binary(b"", &corners), "BTH-I004", "byte 170", "NaN");
    assert_refused("a.stl", TEXT.replace("1 1 0", "1 inf 0").as_bytes(), "BTH-I004", "line 6", "inf");
}

#[test]
fn the_first_word_of_a_text_may_have_capital_letters() {
    for first in ["SOLID", "Solid", " sOLID"] {
        let text = TEXT.replacen("solid", first, 1);
        for name in ["a.stl", "a"] {
            assert_eq!(import_bytes(name, text.as_bytes(), Keep::None).unwrap().0.triangles.len(), 2);
        }
        // A binary header may begin so, too.
        let bytes = binary(first.as_bytes(), &square());
        assert_eq!(import_bytes("a.stl", &bytes, Keep::None).unwrap().0.triangles.len(), 2);
        assert_refused("a.stl", &bytes[..150], "BTH-I003", "byte 150", "expected 2 facets");
    }
}
