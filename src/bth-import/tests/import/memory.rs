//! Triangles that are in memory already.

use bth_import::error::Result;
use bth_import::{Keep, Mesh, PositionRows, Report, Silent, Wanted, import_triangles};
use std::path::Path;

fn import(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Result<(Mesh, Report)> {
    let positions = PositionRows::F32(positions);
    import_triangles(Path::new("mesh"), positions, triangles, Wanted::default(), &Silent)
}

const CORNERS: [[f32; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, -0.0]];

#[test]
fn triangles_are_welded_and_counted_as_those_of_a_file() {
    let triangles = [[0, 1, 2], [0, 3, 2], [1, 1, 1]];
    let (mesh, report) = import(&CORNERS, &triangles).unwrap();
    let text = "OFF\n4 3 0\n0 0 0\n1 0 0\n0 1 0\n1 0 -0\n3 0 1 2\n3 0 3 2\n3 1 1 1\n";
    let keep = Keep::None;
    let (read, of_file) =
        bth_import::import_bytes(Path::new("a.off"), text.as_bytes(), keep, &Silent).unwrap();
    assert_eq!(mesh, read);
    assert_eq!(report, Report { format: "memory".to_owned(), ..of_file });
    assert_eq!((report.degenerate, report.duplicate, report.positions), (1, 1, 3));
}

#[test]
fn errors_name_the_row() {
    let outside = import(&CORNERS, &[[0, 1, 2], [1, 9, 4]]).unwrap_err().to_string();
    assert!(outside.starts_with("mesh: triangle 1: BTH-I005: index 9 of 4 positions"), "{outside}");
    let mut positions = CORNERS;
    positions[3][1] = f32::NAN;
    assert_eq!(import(&positions, &[[0, 1, 2]]).unwrap().1.non_finite_unused, 1);
    let bad = import(&positions, &[[0, 1, 2], [0, 3, 2]]).unwrap_err().to_string();
    assert!(
        bad.starts_with("mesh: triangle 1: BTH-I004: expected finite coordinates, found [1.0, NaN"),
        "{bad}"
    );
    assert!(import(&[], &[[0, 0, 0]]).unwrap_err().to_string().contains("index 0 of 0 positions"));
    assert!(import(&[], &[]).unwrap().0.triangles.is_empty());
}
