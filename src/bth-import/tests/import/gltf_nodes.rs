//! Versions, matrices and visibility of nodes in glTF documents, and incomplete triangles.

use super::gltf::{assert_bad, binary, edited, glb, read};
use super::*;
use serde_json::{Value, json};

#[test]
fn refuses_what_readers_of_version_2_0_do_not_know() {
    for least in ["2.1", "3.0", "2.10", "newest"] {
        assert_bad(
            |d| d["asset"]["minVersion"] = least.into(),
            "BTH-I006",
            "asset",
            &format!("found minVersion \"{least}\""),
        );
    }
    for least in ["2.0", "1.1"] {
        assert_eq!(read(&edited(|d| d["asset"]["minVersion"] = least.into())).0.triangles.len(), 2);
    }
}

#[test]
fn refuses_matrices_that_are_not_affine() {
    let matrix =
        |last: [f64; 4]| json!([1, 0, 0, last[0], 0, 1, 0, last[1], 0, 0, 1, last[2], 0, 0, 0, last[3]]);
    for last in [[0.0, 0.0, 0.5, 1.0], [0.0, 0.0, 0.0, 2.0], [0.0; 4]] {
        let message = "expected a matrix whose last row is 0, 0, 0, 1, found [0.0, 0.0, ";
        assert_bad(|d| d["nodes"][0]["matrix"] = matrix(last), "BTH-I012", "node 0 matrix", message);
    }
    // A number that was rounded on the way is no projection.
    let rounded = edited(|d| d["nodes"][0]["matrix"] = matrix([0.0, 0.0, 0.0, 0.9999999]));
    assert_eq!(read(&rounded).0.positions, SQUARE);
}

#[test]
fn rotations_turn_and_do_not_scale_or_shear() {
    // Two digits of the square root of a half, as some programs write them: a quarter turn about z.
    let turned = edited(|d| d["nodes"][0]["rotation"] = json!([0.0, 0.0, 0.71, 0.71]));
    let quarter = SQUARE.map(|[x, y, z]| [-y, x, z]);
    for (found, expected) in read(&turned).0.positions.iter().zip(&quarter) {
        let off = found.iter().zip(expected).fold(0.0f32, |most, (a, b)| most.max((a - b).abs()));
        assert!(off <= f32::EPSILON, "{found:?} in the place of {expected:?}");
    }
    let none = |d: &mut Value| d["nodes"][0]["rotation"] = json!([0, 0, 0, 0]);
    assert_bad(none, "BTH-I012", "node 0", "expected a rotation that is not zero");
}

#[test]
fn hidden_nodes_are_left_out_with_all_below_them() {
    for key in ["extensionsUsed", "extensionsRequired"] {
        let hidden = edited(|d| {
            d[key] = json!(["KHR_node_visibility"]);
            d["nodes"] = json!([
                {"children": [1, 2, 4]},
                {"mesh": 0, "extensions": {"KHR_node_visibility": {"visible": true}}},
                {"mesh": 0, "children": [3], "extensions": {"KHR_node_visibility": {"visible": false}}},
                {"mesh": 0, "extensions": {"KHR_node_visibility": {"visible": true}}},
                {"mesh": 0, "translation": [0, 0, 1]}
            ]);
        });
        let listener = Listener::default();
        let (mesh, _) = import_with("a.glb", &glb(&hidden, &binary()), Keep::None, &listener).unwrap();
        assert_eq!((mesh.triangles.len(), mesh.positions.len()), (4, 8));
        assert!(listener.heard("2 nodes with meshes are left out: KHR_node_visibility hides them"));
    }
    let malformed =
        |d: &mut Value| d["nodes"][0]["extensions"] = json!({"KHR_node_visibility": {"visible": 1}});
    assert_bad(malformed, "BTH-I002", "node 0", "expected the properties that glTF defines");
}

#[test]
fn a_triangle_that_its_indices_leave_incomplete_counts_as_skipped_and_is_told() {
    let listener = Listener::default();
    let document = edited(|d| d["accessors"][1]["count"] = 5.into());
    let (mesh, report) = import_with("a.glb", &glb(&document, &binary()), Keep::None, &listener).unwrap();
    assert_eq!((mesh.triangles.len(), report.skipped), (1, 1));
    assert!(
        listener
            .heard("mesh 0 primitive 0: the last of its 5 indices form no whole triangle and are left out")
    );
}
