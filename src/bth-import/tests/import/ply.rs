use super::*;

const HEAD: &str = "comment made by hand\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
    property uchar red\nelement face 2\nproperty list uchar int vertex_indices\nproperty short flags\nend_header\n";

fn ascii() -> String {
    format!("ply\nformat ascii 1.0\n{HEAD}0 0 0 9\n1 0 0 9\n1 1 0 9\n0 1 0 9\n4 0 1 2 3 -7\n3 3 1 0 -7\n")
}

/// The same in binary.
fn binary(big: bool) -> Vec<u8> {
    let order = if big { "big" } else { "little" };
    let mut bytes = format!("ply\nformat binary_{order}_endian 1.0\n{HEAD}").into_bytes();
    let mut push = |little: &[u8]| match big {
        true => bytes.extend(little.iter().rev()),
        false => bytes.extend(little),
    };
    for vertex in SQUARE {
        vertex.iter().for_each(|x| push(&x.to_le_bytes()));
        push(&[9]);
    }
    for face in [&[0i32, 1, 2, 3][..], &[3, 1, 0]] {
        push(&[face.len() as u8]);
        face.iter().for_each(|index| push(&index.to_le_bytes()));
        push(&(-7i16).to_le_bytes());
    }
    bytes
}

#[test]
fn text_and_both_byte_orders_give_the_same_fans_in_file_order() {
    for bytes in [ascii().into_bytes(), ascii().replace('\n', "\r\n").into(), binary(false), binary(true)] {
        let (mesh, report) = import_bytes("a.ply", &bytes, Keep::None).unwrap();
        assert_eq!(mesh.positions, SQUARE);
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [3, 1, 0]]);
        assert_eq!(report.polygons, 1);
    }
}

#[test]
fn a_body_may_begin_with_a_line_feed_behind_a_header_of_carriage_returns() {
    // The coordinate whose smallest byte is an LF.
    let first = f32::from_bits(0x3f80_000a);
    for end in ["\r", "\n", "\r\n"] {
        let head = "ply|format binary_little_endian 1.0|element vertex 3|property float x|property float y|property float z|\
            element face 1|property list uchar uchar vertex_indices|end_header|";
        let mut bytes = head.replace('|', end).into_bytes();
        for x in [first, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
            bytes.extend(x.to_le_bytes());
        }
        bytes.extend([3, 0, 1, 2]);
        let (mesh, _) = import_bytes("a.ply", &bytes, Keep::None).unwrap();
        assert_eq!(mesh.positions, [[first, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]], "{end:?}");
    }
}

#[test]
fn double_coordinates_are_rounded_and_other_elements_passed_over() {
    let head = "element junk 2\nproperty list uchar double many\nproperty char c\nelement edge 1\n\
        property int vertex1\nproperty int vertex2\nelement vertex 3\nproperty double x\nproperty double y\n\
        property double z\nelement nothing 4000000000\nelement face 1\nproperty list int uint vertex_index\nend_header\n";
    let mut bytes = format!("ply\nformat binary_little_endian 1.0\n{head}").into_bytes();
    bytes.push(2);
    bytes.extend([0; 16]);
    bytes.extend([0, 0, 0]);
    bytes.extend([0; 8]);
    for x in [0.1, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0f64] {
        bytes.extend(x.to_le_bytes());
    }
    for word in [3u32, 0, 1, 2] {
        bytes.extend(word.to_le_bytes());
    }
    let (mesh, report) = import_bytes("a.ply", &bytes, Keep::None).unwrap();
    assert_eq!((mesh.positions[0], mesh.triangles.as_slice()), ([0.1, 0.0, 0.0], &[[0, 1, 2]][..]));
    assert_eq!(report.skipped, 1);
    let text =
        format!("ply\nformat ascii 1.0\n{head}2 0.5 0.5 0\n0 0\n0 1\n\n0.1 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    assert_eq!(import_bytes("a.ply", text.as_bytes(), Keep::None).unwrap().0, mesh);
}

#[test]
fn strips_turn_every_second_triangle_and_restart_at_minus_one() {
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        element tristrips 1\nproperty list int int vertex_indices\nend_header\n\
        0 0 0\n1 0 0\n1 1 0\n0 1 0\n11 0 1 3 2 -1 0 1 -1 2 3 0\n";
    let (mesh, report) = import_bytes("a.ply", text.as_bytes(), Keep::None).unwrap();
    let corners: Vec<_> = (0..3).map(|t| mesh.corners(t)).collect();
    let expected = [[0, 1, 3], [1, 2, 3], [2, 3, 0]].map(|t| t.map(|v: usize| SQUARE[v]));
    let turned = |[a, b, c]: [[f32; 3]; 3]| [[a, b, c], [b, c, a], [c, a, b]];
    for (found, expected) in corners.into_iter().zip(expected) {
        assert!(turned(expected).contains(&found), "{found:?} {expected:?}");
    }
    assert_eq!((report.triangles, report.skipped), (3, 1));
}

#[test]
fn attributes_of_vertices_are_kept_when_asked_for() {
    let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        property float nx\nproperty float ny\nproperty float nz\nproperty float s\nproperty float t\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0 0 0 1 .5 .25\n1 0 0 0 0 1 1 1\n0 1 0 0 1 0 0 1\n3 2 1 0\n";
    let all = import_bytes("a.ply", text.as_bytes(), Keep::All).unwrap().0.attributes.unwrap();
    assert_eq!(all.corners, [[0, 1, 2]]);
    assert_eq!(all.normals, [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]]);
    assert_eq!(all.uvs, [[0.0, 1.0], [1.0, 1.0], [0.5, 0.25]]);
    let normals = import_bytes("a.ply", text.as_bytes(), Keep::Normals).unwrap().0.attributes.unwrap();
    assert_eq!((normals.normals, normals.uvs.len()), (all.normals, 0));
}

#[test]
fn every_cut_of_a_file_is_refused() {
    for bytes in [ascii().trim_end().as_bytes(), &binary(false), &binary(true)] {
        for end in 0..bytes.len() {
            // A cut inside the last number of a text leaves a shorter number.
            let text = std::str::from_utf8(bytes).is_ok() && bytes[..9] != *b"ply\nformat binary";
            if text && end + 2 > bytes.len() {
                continue;
            }
            let found = import_bytes("a.ply", &bytes[..end], Keep::None);
            assert!(matches!(found, Err(Error::Input { .. })), "cut at {end}: {found:?}");
        }
    }
    let cut = binary(false);
    let place = format!("byte {}", cut.len() - 1);
    assert_refused("a.ply", &cut[..cut.len() - 1], "BTH-I003", &place, "2 rows of element face");
}

#[test]
fn refuses_counts_that_the_file_cannot_hold_without_allocating_for_them() {
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let text = format!("ply\nformat {encoding} 1.0\n{HEAD}");
        for (what, huge) in [("vertex 4", "vertex 4000000000"), ("vertex 4", "vertex 999999999999999999")] {
            let error = import_bytes("a.ply", text.replace(what, huge).as_bytes(), Keep::None).unwrap_err();
            assert!(matches!(error, Error::Input { code: "BTH-I003", .. } | Error::Limit { .. }), "{error}");
            assert!(error.to_string().contains("a.ply:"), "{error}");
        }
    }
    let mut bytes = binary(false);
    let list = bytes.len() - 3 * 4 - 2 - 1;
    bytes[list] = 255;
    let place = format!("byte {}", bytes.len());
    assert_refused("a.ply", &bytes, "BTH-I003", &place, "end of the file");
}

#[test]
fn a_stray_line_of_the_header_is_ignored_unless_the_body_may_depend_on_it() {
    let with = |line: &str| ascii().replacen("element vertex", &format!("{line}\nelement vertex"), 1);
    let whole = import_bytes("a.ply", ascii().as_bytes(), Keep::None).unwrap().0;
    for line in ["TextureFile wood.png", "author: somebody else"] {
        let listener = Listener::default();
        let (mesh, _) = import_with("a.ply", with(line).as_bytes(), Keep::None, &listener).unwrap();
        assert_eq!(mesh, whole);
        assert!(listener.heard(&format!("line 4: \"{line}\" is ignored")));
    }
    for line in ["elemnt edge 4", "propety float w", "prop list uchar int more", "9 lives"] {
        assert_refused("a.ply", with(line).as_bytes(), "BTH-I002", "line 4", line);
    }
}

#[test]
fn refuses_headers_and_rows_at_their_line() {
    assert_refused("a.ply", b"plywood\n", "BTH-I002", "line 1", "expected ply");
    let edits = [
        ["ascii", "base64", "BTH-I002", "line 2", "expected ascii"],
        ["ascii 1.0", "ascii 2.0", "BTH-I006", "line 2", "version 1.0"],
        ["vertex 4", "vertex four", "BTH-I002", "line 4", "number of rows"],
        ["float y", "real y", "BTH-I002", "line 6", "a PLY type"],
        ["float y", "float x", "BTH-I002", "line 6", "each property once"],
        ["float y", "float q", "BTH-I002", "line 12", "x, y and z"],
        ["int vertex_indices", "int v", "BTH-I002", "line 12", "vertex_indices"],
        ["uchar int", "uchar float", "BTH-I002", "line 10", "integer type"],
        ["format ascii 1.0\n", "", "BTH-I002", "line 11", "format"],
        ["end_header\n", "", "BTH-I002", "line 12", "end_header"],
        ["1 1 0 9", "1 1 0", "BTH-I002", "line 15", "more values"],
        ["1 1 0 9", "1 one 0 9", "BTH-I002", "line 15", "found \"one\""],
        ["3 3 1 0", "-1 3 1 0", "BTH-I002", "line 18", "count of a list"],
        ["3 3 1 0", "3 4 1 0", "BTH-I005", "line 18", "below 4, found 4"],
        ["3 3 1 0", "3 3 -1 0", "BTH-I005", "line 18", "found -1"],
        ["1 1 0 9", "\n1 nan 0 9", "BTH-I004", "line 16", "NaN"],
    ];
    assert_edits_refused("a.ply", &ascii(), &edits);
}

#[test]
fn refuses_indices_and_coordinates_of_binary_files_at_their_byte() {
    let mut bytes = binary(true);
    let last = bytes.len() - 3;
    bytes[last] = 4;
    let place = format!("byte {}", bytes.len() - 15);
    assert_refused("a.ply", &bytes, "BTH-I005", &place, "found 4 in row 1 of element face");
    let mut bytes = binary(false);
    let row = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11 + 2 * 13;
    bytes[row + 4..row + 8].copy_from_slice(&f32::INFINITY.to_le_bytes());
    assert_refused("a.ply", &bytes, "BTH-I004", &format!("byte {row}"), "inf");
}

#[test]
fn values_after_the_end_of_a_row_are_told() {
    let text = ascii().replace("1 1 0 9", "1 1 0 9 9").replace("0 1 0 9", "0 1 0 9 9");
    let listener = Listener::default();
    let (mesh, _) = import_with("a.ply", text.as_bytes(), Keep::None, &listener).unwrap();
    assert_eq!(mesh.positions, SQUARE);
    assert!(
        listener
            .heard("2 rows have more values than the header tells, which are ignored; the first is line 15")
    );
}

/// A triangle, with these properties of vertices and values behind each position, and with these
/// lines of other elements.
fn triangle(properties: &str, values: &str, elements: &str, rows: &str) -> String {
    let corners = ["0 0 0", "1 0 0", "0 1 0"].map(|corner| format!("{corner} {values}\n")).concat();
    format!(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n{properties}\
         {elements}end_header\n{corners}{rows}"
    )
}

#[test]
fn polygons_of_other_elements_are_told() {
    for (element, list) in
        [("polygon", "vertex_indices"), ("range_grid", "vertex_indices"), ("fan", "vertex_index")]
    {
        let elements = format!(
            "element face 1\nproperty list uchar int vertex_indices\nelement {element} 2\nproperty list uchar int {list}\n"
        );
        let listener = Listener::default();
        let text = triangle("", "", &elements, "3 0 1 2\n3 0 1 2\n0\n");
        let (mesh, _) = import_with("a.ply", text.as_bytes(), Keep::None, &listener).unwrap();
        assert_eq!(mesh.triangles.len(), 1);
        assert!(listener.heard(&format!("2 rows of element {element}: {list} is not read")));
        assert_eq!(listener.0.lock().unwrap().len(), 1);
    }
}

#[test]
fn texture_coordinates_of_faces_are_told_where_they_are_wanted() {
    let elements =
        "element face 1\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n";
    let text = triangle("", "", elements, "3 0 1 2 6 0 0 1 0 0 1\n");
    for (keep, told) in [(Keep::All, true), (Keep::Normals, false), (Keep::None, false)] {
        let listener = Listener::default();
        import_with("a.ply", text.as_bytes(), keep, &listener).unwrap();
        assert_eq!(
            listener.heard("1 rows of element face: the texture coordinates texcoord are not kept"),
            told
        );
        assert_eq!(listener.0.lock().unwrap().len(), usize::from(told));
    }
}

#[test]
fn of_two_pairs_of_texture_coordinates_the_first_counts() {
    let properties = "property float u\nproperty float v\nproperty float s\nproperty float t\n";
    let elements = "element face 1\nproperty list uchar int vertex_indices\n";
    let text = triangle(properties, "0.25 0.5 7 8", elements, "3 0 1 2\n");
    assert!(import_bytes("a.ply", text.as_bytes(), Keep::None).is_ok());
    let listener = Listener::default();
    let (mesh, _) = import_with("a.ply", text.as_bytes(), Keep::All, &listener).unwrap();
    assert_eq!(mesh.attributes.unwrap().uvs[0], [0.25, 0.5]);
    assert!(listener.heard("3 rows of element vertex: the texture coordinates s, t are not kept"));
}
