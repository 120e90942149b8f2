use super::*;

#[track_caller]
fn square(text: &str) {
    let (mesh, report) = import_bytes("a.off", text.as_bytes(), Keep::All).unwrap();
    assert_eq!(mesh.positions, SQUARE);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(report.polygons, 1);
}

#[test]
fn comments_colours_and_counts_on_the_first_line_are_read() {
    square("OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n");
    square("OFF 4 1 0\r\n0 0 0\r\n1 0 0\r\n1 1 0\r\n0 1 0\r\n4 0 1 2 3\r\n");
    square(
        "# made by hand\nCOFF # coloured\n\n4 1 0\n0 0 0 1 0 0 1\n1 0 0\n# c\n1 1 0\n0 1 0\n4 0 1 2 3 255 0 0\n",
    );
    square("4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n");
}

#[test]
fn numbers_may_run_over_line_ends() {
    square("OFF4 1 0\n0 0 0\n1 0\n0\n1 1 0\n0 1 0\n4 0 1\n2 3\n");
    square("OFF\n4\n1\n0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n");
    square("OFF\n4 1 0\n0 0 0 1 0 0\n1 1 0 0 1 0 4 0 1 2 3\n");
    let long = format!("OFF 4 1 0\n{}4 0 1 2 3", "0 0 0 1 0 0 1 1 0 0 1 0 ".replace("1 1", "1 1.0000000001"));
    let (mesh, _) = import_bytes("a.off", long.as_bytes(), Keep::None).unwrap();
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (4, 2));
}

#[test]
fn faces_of_fewer_than_three_corners_are_skipped() {
    let text = b"OFF\n3 3 0\n0 0 0\n1 0 0\n1 1 0\n2 0 1\n3 0 1 2\n1 0\n";
    let (mesh, report) = import_bytes("a.off", text, Keep::None).unwrap();
    assert_eq!((mesh.triangles.len(), report.skipped), (1, 2));
}

#[test]
fn refuses_what_is_wrong_at_its_line() {
    let text = "OFF\n3 1 0\n0 0 0\n1 0 0\n1 1 0\n";
    for (text, code, place, message) in [
        ("4OFF\n0 0 0\n", "BTH-I006", "line 1", "4OFF"),
        ("nOFF\n0 0 0\n", "BTH-I006", "line 1", "nOFF"),
        ("OFF BINARY\n0 0 0\n", "BTH-I006", "line 1", "OFF BINARY"),
        ("hello\n", "BTH-I002", "line 1", "number of vertices"),
        ("OFF8a\n", "BTH-I002", "line 1", "number of vertices"),
        ("OFF\n4000000000 1 0\n0 0 0\n", "BTH-I003", "line 3", "vertex 1 of 4000000000"),
        ("OFF\n1 4000000000 0\n0 0 0\n1 0\n", "BTH-I003", "line 4", "face 1 of"),
        ("", "BTH-I003", "line 0", "number of vertices"),
        (&format!("{text}3 0 1 3\n"), "BTH-I005", "line 6", "below 3, found 3"),
        (&format!("{text}3 0 1 -1\n"), "BTH-I005", "line 6", "found -1"),
        (&format!("{text}3 0 1\n"), "BTH-I003", "line 6", "expected 3 indices"),
        ("OFF\n1 0 0\n0 zero 0\n", "BTH-I002", "line 3", "found \"zero\""),
        ("OFF\n3 1 0\n0 0 0\n\n# c\n1 nan 0\n1 1 0\n3 0 1 2\n", "BTH-I004", "line 6", "NaN"),
        ("OFF 3 1 0\n0 0 0\n1 nan 0\n1 1 0\n3 0 1 2\n", "BTH-I004", "line 3", "NaN"),
        ("NnOFF\n0 0 0\n", "BTH-I006", "line 1", "NnOFF"),
        ("CCOFF\n0 0 0\n", "BTH-I002", "line 1", "number of vertices"),
    ] {
        assert_refused("a.off", text.as_bytes(), code, place, message);
    }
}

#[test]
fn the_letters_of_variants_may_have_any_order() {
    for keyword in ["NCOFF", "CNOFF", "STCNOFF", "CSTOFF", "NSTOFF"] {
        for name in ["a.off", "a"] {
            let text = format!("{keyword}\n3 1 0\n0 0 0 1 1\n1 0 0 1 1\n1 1 0 1 1\n3 0 1 2\n");
            assert_eq!(import_bytes(name, text.as_bytes(), Keep::None).unwrap().0.triangles, [[0, 1, 2]]);
        }
    }
}
