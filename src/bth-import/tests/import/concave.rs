//! Polygons from whose first corner not all of them is seen.

use super::*;
use bth_import::{Polygons, import_bytes as import_named};
use std::path::Path;

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

/// An arrow head whose second corner is the notch, which a fan from the first corner covers twice.
const ARROW: &str = "v 2 -1 0\nv 1 0 0\nv 2 1 0\nv 0 0 0\n";

#[test]
fn concave_polygons_are_told_with_the_first_triangle() {
    let dart = "v 2 -1 0\nv 1 0 0\nv 2 1 0\n";
    let told = |name: &str, text: &str| {
        let listener = Listener::default();
        import_with(name, text.as_bytes(), Keep::None, &listener).unwrap();
        listener.0.into_inner().unwrap()
    };
    let obj = |faces: &str| told("a.obj", &format!("{SQUARE}{dart}{faces}"));
    let [one] = obj("f 1 2 3 4\nf 1 5 6 7\nf 5 6 7 1\n").try_into().unwrap();
    assert!(one.starts_with("1 polygon is concave: ") && one.contains("the first is triangle 4."), "{one}");
    let [two] = obj("f 7 1 5 6\nf 5 6 7 1\n").try_into().unwrap();
    assert!(two.starts_with("2 polygons are concave: ") && two.contains("the first is triangle 0."), "{two}");
    assert_eq!(obj("f 1 2 3 4\nf 1 5 6 7\nf 6 7 1 5\n"), [""; 0]);
    let [early] = told("a.obj", &format!("f 5 6 7 1\n{SQUARE}{dart}")).try_into().unwrap();
    assert!(early.starts_with("1 polygon is concave: "), "{early}");
    let rows = "0 0 0\n2 -1 0\n1 0 0\n2 1 0\n4 1 2 3 0\n";
    let properties = "property float x\nproperty float y\nproperty float z\n";
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex 4\n{properties}element face 1\n\
         property list uchar int vertex_indices\nend_header\n{rows}"
    );
    assert!(told("a.ply", &ply)[0].starts_with("1 polygon is concave"));
    assert!(told("a.off", &format!("OFF\n4 1 0\n{rows}"))[0].starts_with("1 polygon is concave"));
}

#[test]
fn concave_polygons_are_split_exactly_where_that_is_wanted() {
    let split = |name: &str, text: &str, polygons: Polygons| {
        let listener = Listener::default();
        let wanted = Wanted { polygons, ..everything() };
        let (mesh, report) = import_named(Path::new(name), text.as_bytes(), wanted, &listener).unwrap();
        (mesh, report.concave, listener.0.into_inner().unwrap())
    };
    // Convex polygons are fans either way. The corners of the arrow head have attributes and, in
    // one file, positions of later lines.
    let attributes = "vt 0 0\nvt 1 0\nvt 2 0\nvt 3 0\n";
    let faces = "f 5 6 7 8\nf 1/1 2/2 3/3 4/4\nf 5 6 7\n";
    let square = "v 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n";
    for text in [format!("{ARROW}{square}{attributes}{faces}"), format!("{attributes}{faces}{ARROW}{square}")]
    {
        let (fans, concave, told) = split("a.obj", &text, Polygons::Fans);
        assert_eq!((concave, told.len()), (1, 1));
        let (mesh, concave, told) = split("a.obj", &text, Polygons::Ears);
        assert_eq!((concave, told), (1, Vec::new()));
        let corners = |mesh: &Mesh, triangle: u32| {
            let uvs = mesh.attributes.as_ref().unwrap();
            let rows = uvs.corners[triangle as usize];
            [0, 1, 2].map(|k| (mesh.corners(triangle)[k], uvs.uvs[rows[k] as usize][0]))
        };
        for same in [0, 1, 4] {
            assert_eq!(mesh.corners(same), fans.corners(same));
        }
        let [a, b, c, d] =
            [([2.0, -1.0, 0.0], 0.0), ([1.0, 0.0, 0.0], 1.0), ([2.0, 1.0, 0.0], 2.0), ([0.0; 3], 3.0)];
        assert_eq!([2, 3].map(|triangle| corners(&fans, triangle)), [[a, b, c], [a, c, d]]);
        assert_eq!([2, 3].map(|triangle| corners(&mesh, triangle)), [[d, a, b], [b, c, d]]);
    }
    // A quadrilateral that crosses itself stays a fan, and is told.
    let (mesh, concave, told) =
        split("a.obj", "v 0 0 0\nv 3 3 0\nv 3 0 0\nv 0 2 0\nf 1 2 3 4\n", Polygons::Ears);
    assert_eq!((mesh.triangles, concave), (vec![[0, 1, 2], [0, 2, 3]], 1));
    assert!(
        told[0].starts_with(
            "1 polygon is concave and cannot be split, since the outline crosses itself or is far from flat: "
        ),
        "{told:?}"
    );
}

#[test]
fn concave_polygons_of_other_formats_are_split_too() {
    let rows = "2 -1 0\n1 0 0\n2 1 0\n0 0 0\n4 0 1 2 3\n";
    let colored = "2 -1 0 10\n1 0 0 20\n2 1 0 30\n0 0 0 40\n4 0 1 2 3\n";
    let properties = "property float x\nproperty float y\nproperty float z\nproperty uchar red\n";
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex 4\n{properties}element face 1\n\
         property list uchar int vertex_indices\nend_header\n{colored}"
    );
    let vertices = ARROW.lines().map(|line| format!("vertex{}\n", &line[1..])).collect::<String>();
    let stl = format!("solid\nfacet\nouter loop\n{vertices}endloop\nendfacet\nendsolid\n");
    for (name, text) in [("a.ply", ply), ("a.off", format!("OFF\n4 1 0\n{rows}")), ("a.stl", stl)] {
        let wanted = Wanted { polygons: Polygons::Ears, ..Keep::None.into() };
        let (mesh, _) = import_named(Path::new(name), text.as_bytes(), wanted, &Silent).unwrap();
        let [a, b, c, d] = [[2.0, -1.0, 0.0], [1.0, 0.0, 0.0], [2.0, 1.0, 0.0], [0.0; 3]];
        assert_eq!([0, 1].map(|k| mesh.corners(k)), [[d, a, b], [b, c, d]], "{name}");
    }
}
