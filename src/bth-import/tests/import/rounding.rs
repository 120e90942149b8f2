//! What rounding to f32 moves and drops is counted, and told where a picture would show it. In f64
//! nothing moves.

use super::*;
use bth_import::{Mesh, Polygons, Positions, Rounding, Wanted};

/// Corners of a grid of 8 by 8 squares of 0.125, `away` from the origin along x and y.
fn grid(away: f64) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let at = |i: u32| away + f64::from(i) * 0.125;
    let corners = (0..81).map(|i| [at(i % 9), at(i / 9), 0.0]).collect();
    let square = |i: u32| {
        let a = i / 8 * 9 + i % 8;
        [[a, a + 1, a + 10], [a, a + 10, a + 9]]
    };
    (corners, (0..64).flat_map(square).collect())
}

/// A name with bytes of each format that keeps more than f32.
fn in_formats(corners: &[[f64; 3]], triangles: &[[u32; 3]]) -> Vec<(&'static str, Vec<u8>)> {
    let line = |prefix: &str, [x, y, z]: [f64; 3]| format!("{prefix}{x} {y} {z}\n");
    let lines = |prefix: &str| corners.iter().map(|p| line(prefix, *p)).collect::<String>();
    let faces = |prefix: &str, first: u32| {
        triangles
            .iter()
            .map(|t| format!("{prefix}{} {} {}\n", t[0] + first, t[1] + first, t[2] + first))
            .collect::<String>()
    };
    let header = |encoding: &str| {
        let axes = ["x", "y", "z"].map(|k| format!("property double {k}\n")).concat();
        let lists = format!("element face {}\nproperty list uchar int vertex_indices\n", triangles.len());
        format!("ply\nformat {encoding} 1.0\nelement vertex {}\n{axes}{lists}end_header\n", corners.len())
    };
    let mut binary = header("binary_little_endian").into_bytes();
    binary.extend(corners.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
    for triangle in triangles {
        binary.push(3);
        binary.extend(triangle.iter().flat_map(|row| row.to_le_bytes()));
    }
    let facet = |t: &[u32; 3]| {
        let corners = t.map(|row| line("vertex ", corners[row as usize])).concat();
        format!("facet normal 0 0 1\nouter loop\n{corners}endloop\nendfacet\n")
    };
    vec![
        ("a.obj", format!("# far away\n{}{}", lines("v "), faces("f ", 1)).into_bytes()),
        (
            "a.off",
            format!("OFF\n{} {} 0\n{}{}", corners.len(), triangles.len(), lines(""), faces("3 ", 0))
                .into_bytes(),
        ),
        ("text.ply", format!("{}{}{}", header("ascii"), lines(""), faces("3 ", 0)).into_bytes()),
        ("binary.ply", binary),
        (
            "a.stl",
            format!("solid a\n{}endsolid a\n", triangles.iter().map(facet).collect::<String>()).into_bytes(),
        ),
    ]
}

/// Positions in f32.
fn in_f32() -> Wanted {
    Wanted { positions: Positions::F32, ..Wanted::default() }
}

/// What was counted, and whether a warning says so.
fn rounding(name: &str, bytes: &[u8]) -> (Option<Rounding>, bool) {
    let said = Listener::default();
    let (_, report) = import_with(name, bytes, in_f32(), &said).unwrap();
    (report.rounding, said.heard("rounding to 32-bit numbers moves"))
}

#[test]
fn far_models_lose_what_f32_cannot_hold_and_say_so() {
    // Steps of f32 are 0.5 there: of nine coordinates 0, 0.5 and 1 stay, and the others move.
    let (corners, triangles) = grid(5_000_000.0);
    for (name, bytes) in in_formats(&corners, &triangles) {
        let (found, warned) = rounding(name, &bytes);
        let Rounding { positions, farthest, triangles } = found.expect(name);
        // Each triangle of a text STL has its own corners.
        let (moved, all) = if name == "a.stl" { (360, 384) } else { (72, 81) };
        assert_eq!((positions, farthest, warned), (moved, 0.25, true), "{name}: of {all}");
        assert!((96..128).contains(&triangles), "{name}: {triangles}");
    }
}

#[test]
fn what_a_picture_cannot_show_is_counted_only() {
    let (mut corners, triangles) = grid(20.0);
    corners[40][0] += 1e-6;
    for (name, bytes) in in_formats(&corners, &triangles) {
        let (found, warned) = rounding(name, &bytes);
        assert!(
            found.is_some_and(|found| found.triangles == 0 && found.farthest < 1e-6),
            "{name}: {found:?}"
        );
        assert!(!warned, "{name}");
    }
}

#[test]
fn models_in_f32_and_models_near_the_origin_lose_nothing() {
    for away in [0.0, -0.5, 4096.0] {
        let (corners, triangles) = grid(away);
        for (name, bytes) in in_formats(&corners, &triangles) {
            assert_eq!(rounding(name, &bytes), (None, false), "{name}, {away}");
        }
    }
}

#[test]
fn what_the_transforms_of_nodes_move_is_counted() {
    let document = gltf::edited(|d| d["nodes"][0]["translation"] = serde_json::json!([5e6 + 0.2, 0, 0]));
    let (found, warned) = rounding("a.glb", &gltf::glb(&document, &gltf::binary()));
    assert!(warned && found.is_some_and(|found| (found.farthest - 0.2).abs() < 1e-6), "{found:?}");
}

/// The mesh with positions in these numbers, what rounding did, and what it would have done. No
/// warning is given.
fn kept(name: &str, bytes: &[u8], positions: Positions) -> (Mesh, [Option<Rounding>; 2]) {
    let said = Listener::default();
    let wanted = Wanted { positions, ..Wanted::default() };
    let (mesh, report) = import_with(name, bytes, wanted, &said).unwrap();
    assert!(said.0.into_inner().unwrap().is_empty(), "{name}");
    (mesh, [report.rounding, report.avoided_rounding])
}

/// The corners of all triangles as the source has them.
fn exact_corners(mesh: &Mesh) -> Vec<[[f64; 3]; 3]> {
    let exact = mesh.exact.as_ref().unwrap();
    mesh.triangles.iter().map(|t| t.map(|v| exact.positions[v as usize])).collect()
}

#[test]
fn positions_in_f64_keep_what_the_source_has() {
    let (mut corners, triangles) = grid(5_000_000.0);
    for (i, corner) in corners.iter_mut().enumerate() {
        corner[2] = 300.0 + 1e-9 * i as f64;
    }
    let expected: Vec<_> = triangles.iter().map(|t| t.map(|v| corners[v as usize])).collect();
    for (name, bytes) in in_formats(&corners, &triangles) {
        let as_f32 = import_with(name, &bytes, in_f32(), &Listener::default()).unwrap().1;
        for positions in [Positions::Auto, Positions::F64] {
            let (mesh, [rounding, avoided]) = kept(name, &bytes, positions);
            assert_eq!((rounding, avoided), (None, as_f32.rounding), "{name}");
            assert_eq!(exact_corners(&mesh), expected, "{name}");
            let anchor = mesh.exact.as_ref().unwrap().anchor;
            assert_eq!(anchor, [5_000_000.5, 5_000_000.5, 300.0], "{name}");
            // Differences in x and y are f32, and z is rounded.
            assert!(mesh.positions.iter().all(|p| p[0].abs() <= 0.5 && (0.0..1e-7).contains(&p[2])));
            assert_eq!(mesh.positions.len(), 81, "{name}: equal positions are merged, others are not");
        }
    }
}

#[test]
fn positions_stay_f32_where_f64_keeps_no_more() {
    // All numbers are f32; and a model that is near, which only an explicit choice keeps.
    let (corners, triangles) = grid(4096.0);
    for (name, bytes) in in_formats(&corners, &triangles) {
        assert_eq!(kept(name, &bytes, Positions::F64).0.exact, None, "{name}");
    }
    let (mut corners, triangles) = grid(-0.5);
    corners[40][0] += 1e-9;
    for (name, bytes) in in_formats(&corners, &triangles) {
        let (near, found) = kept(name, &bytes, Positions::Auto);
        assert_eq!((near.exact, found), (None, [None; 2]), "{name}");
        let (exact, [_, avoided]) = kept(name, &bytes, Positions::F64);
        assert_eq!(exact.exact.as_ref().unwrap().anchor, [0.0; 3], "{name}");
        assert_eq!(exact.positions, near.positions, "{name}");
        assert!(avoided.is_some_and(|avoided| avoided.positions == 0 && avoided.farthest > 0.0), "{name}");
    }
}

#[test]
fn vertices_that_move_stay_f32() {
    let (corners, triangles) = grid(5_000_000.0);
    let wanted = Wanted { positions: Positions::F64, vertices: true, ..Wanted::default() };
    for (name, bytes) in in_formats(&corners, &triangles) {
        let (mesh, report) = import_with(name, &bytes, wanted, &Listener::default()).unwrap();
        assert!(mesh.exact.is_none() && report.rounding.is_some(), "{name}");
    }
}

#[test]
fn polygons_far_away_are_split_by_their_exact_corners() {
    // The letter C of 4 cm, seen from no corner; and a convex polygon. In f32 each is one point.
    let c = [[0, 0], [3, 0], [3, 1], [1, 1], [1, 2], [3, 2], [3, 3], [0, 3]];
    let obj = |away: f64| {
        let corner =
            |[x, y]: [i32; 2]| format!("v {} {} 0\n", away + 0.01 * f64::from(x), 0.01 * f64::from(y));
        let corners: String = c.into_iter().chain([[5, 0], [6, 0], [6, 1], [5, 1]]).map(corner).collect();
        format!("{corners}v {} 0 0\nf 1 2 3 4 5 6 7 8\nf 9 10 11 12\nf 1 2 13\n", away + 100.0)
    };
    let split = |text: &str, polygons, positions| {
        let wanted = Wanted { polygons, positions, ..Wanted::default() };
        import_with("a.obj", text.as_bytes(), wanted, &Listener::default()).unwrap()
    };
    let (near, report) = split(&obj(0.0), Polygons::Ears, Positions::F32);
    assert_eq!(report.concave, 1);
    let (far, report) = split(&obj(5e6), Polygons::Ears, Positions::Auto);
    assert!(far.exact.is_some() && report.concave == 1, "{report:?}");
    assert_eq!(far.triangles, near.triangles);
    let (_, report) = split(&obj(5e6), Polygons::Fans, Positions::Auto);
    assert_eq!(report.concave, 1);
}
