//! Skins and morph targets of glTF models at rest (glTF 2.0 specification, §3.7.2.2 and §3.7.3).

use super::gltf::Model;
use super::*;
use serde_json::{Value, json};
use std::path::Path;
use std::process::Command;

/// A triangle whose vertices follow different joints: positions, joints (u8), weights, one morph
/// target, inverse bind matrices.
struct SkinnedTriangle {
    weights: [[f32; 4]; 3],
    joints: [[u8; 4]; 3],
    inverse_binds: Option<[[f32; 3]; 2]>,
}

const POSITIONS: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
const MORPH: [[f32; 3]; 3] = [[0.0, 0.0, 1.0], [0.0, 0.0, 2.0], [0.0, 0.0, 4.0]];

impl SkinnedTriangle {
    /// A file whose skinned node is moved and scaled, which must have no effect, and whose joints
    /// hang below a moved ancestor.
    fn file(&self, edit: impl FnOnce(&mut Value)) -> Vec<u8> {
        let translation = |[x, y, z]: [f32; 3]| [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., x, y, z, 1.];
        let binds = self.inverse_binds.unwrap_or_default().map(translation);
        let mut model = Model::new(json!({
            "scene": 0,
            "scenes": [{"nodes": [0, 1]}],
            "nodes": [
                {"mesh": 0, "skin": 0, "translation": [100.0, 0.0, 0.0], "scale": [3.0, 3.0, 3.0]},
                {"children": [2], "translation": [0.0, 10.0, 0.0]},
                {"children": [3], "translation": [0.0, 0.0, 5.0]},
                {"scale": [2.0, 2.0, 2.0]}
            ],
            "skins": [{"joints": [2, 3], "inverseBindMatrices": 4, "skeleton": 0}],
            "meshes": [{"primitives": [{
                "attributes": {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2},
                "targets": [{"POSITION": 3}]
            }]}],
        }))
        .rows(&POSITIONS)
        .rows(&self.joints)
        .rows(&self.weights)
        .rows(&MORPH)
        .rows(&binds);
        if self.inverse_binds.is_none() {
            model.document["skins"][0].as_object_mut().unwrap().remove("inverseBindMatrices");
        }
        edit(&mut model.document);
        model.glb()
    }

    fn corners(&self, edit: impl FnOnce(&mut Value)) -> [[f32; 3]; 3] {
        import_bytes("a.glb", &self.file(edit), Keep::None).unwrap().0.corners(0)
    }
}

/// Vertex 0 follows the first joint, 1 the second, 2 both.
fn triangle() -> SkinnedTriangle {
    SkinnedTriangle {
        weights: [[1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.5, 0.5, 0.0, 0.0]],
        joints: [[0, 0, 0, 0], [1, 0, 0, 0], [0, 1, 0, 0]],
        inverse_binds: None,
    }
}

#[test]
fn vertices_follow_their_joints_and_all_ancestors_of_these_but_not_their_own_node() {
    let expected = [[0.0, 10.0, 5.0], [2.0, 10.0, 5.0], [0.0, 11.5, 5.0]];
    assert_eq!(triangle().corners(|_| ()), expected);
    let inverse_binds = Some([[0.0, -1.0, 0.0], [0.5, 0.0, 0.0]]);
    let expected = [[0.0, 9.0, 5.0], [3.0, 10.0, 5.0], [0.5, 11.0, 5.0]];
    assert_eq!(SkinnedTriangle { inverse_binds, ..triangle() }.corners(|_| ()), expected);
}

#[test]
fn weights_are_divided_by_their_sum_and_a_vertex_without_weights_follows_its_first_joint() {
    let weights = [[4.0, 0.0, 0.0, 0.0], [0.0; 4], [2.0, 2.0, 0.0, 0.0]];
    let expected = [[0.0, 10.0, 5.0], [2.0, 10.0, 5.0], [0.0, 11.5, 5.0]];
    assert_eq!(SkinnedTriangle { weights, ..triangle() }.corners(|_| ()), expected);
}

#[test]
fn a_second_set_of_joints_counts() {
    let weights = [[0.25, 0.25, 0.0, 0.0]; 3];
    let joints = [[0, 1, 0, 0]; 3];
    let both = |d: &mut Value| {
        let attributes = &mut d["meshes"][0]["primitives"][0]["attributes"];
        attributes["JOINTS_1"] = 1.into();
        attributes["WEIGHTS_1"] = 2.into();
    };
    let expected = [[0.0, 10.0, 5.0], [1.5, 10.0, 5.0], [0.0, 11.5, 5.0]];
    assert_eq!(SkinnedTriangle { weights, joints, ..triangle() }.corners(both), expected);
}

#[test]
fn morph_targets_move_vertices_before_the_skin_by_the_weights_of_the_node_or_else_of_the_mesh() {
    let expected = [[0.0, 10.0, 5.5], [2.0, 10.0, 7.0], [0.0, 11.5, 8.0]];
    assert_eq!(triangle().corners(|d| d["meshes"][0]["weights"] = json!([0.5])), expected);
    let of_node = |d: &mut Value| {
        d["meshes"][0]["weights"] = json!([7.0]);
        d["nodes"][0]["weights"] = json!([0.5]);
    };
    assert_eq!(triangle().corners(of_node), expected);
    let unskinned = |d: &mut Value| {
        d["nodes"][0].as_object_mut().unwrap().remove("skin");
        d["meshes"][0]["weights"] = json!([0.5]);
    };
    assert_eq!(triangle().corners(unskinned), [[100.0, 0.0, 1.5], [103.0, 0.0, 3.0], [100.0, 3.0, 6.0]]);
}

#[test]
fn refuses_skins_that_do_not_exist_or_do_not_fit() {
    let bad = |edit: fn(&mut Value), code: &str, place: &str, message: &str| {
        assert_refused("a.glb", &triangle().file(edit), code, place, message);
    };
    bad(|d| d["nodes"][0]["skin"] = 7.into(), "BTH-I012", "skin 7", "does not exist");
    bad(|d| d["skins"][0]["joints"] = json!([2, 9]), "BTH-I012", "node 9", "does not exist");
    bad(|d| d["skins"][0]["joints"] = json!([2]), "BTH-I005", "mesh 0 primitive 0", "below 1, found 1");
    bad(
        |d| {
            d["skins"][0]["inverseBindMatrices"] = 4.into();
            d["accessors"][4]["count"] = 1.into();
        },
        "BTH-I012",
        "skin 0",
        "found 1",
    );
    // Joints outside of the scene whose nodes are their own ancestors.
    let circle = |d: &mut Value| {
        d["scenes"][0]["nodes"] = json!([0]);
        d["nodes"][3]["children"] = json!([1]);
    };
    bad(circle, "BTH-I012", "node 2", "ancestor of itself");
    bad(
        |d| {
            d["meshes"][0]["weights"] = json!([1.0]);
            d["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": "x"}]);
        },
        "BTH-I002",
        "mesh 0 primitive 0",
        "morph target",
    );
}

#[test]
fn animations_of_what_deforms_are_told() {
    let listener = Listener::default();
    let file = triangle().file(|d| d["animations"] = json!([{"channels": [], "samplers": []}]));
    import_with("a.glb", &file, Keep::None, &listener).unwrap();
    assert!(listener.heard("at rest"));
    let listener = Listener::default();
    import_with("a.glb", &triangle().file(|_| ()), Keep::None, &listener).unwrap();
    assert!(!listener.heard("at rest"));
}

/// Compares the sample models that deform with `tools/crosscheck/gltf_rest.py`, to 1e-5 of their
/// size.
#[test]
#[allow(clippy::print_stdout, reason = "a skipped test says so")]
fn sample_models_are_where_an_independent_evaluation_puts_them() {
    let Some(folder) = super::data::folder() else { return };
    let tool = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tools/crosscheck/gltf_rest.py");
    let names = [
        "RiggedSimple",
        "RecursiveSkeletons",
        "MorphStressTest",
        "SimpleMorph",
        "SimpleSkin",
        "RiggedFigure",
    ];
    for name in names {
        let model = folder.join(format!("animated/khr_{name}.glb"));
        let output = match Command::new("python3").arg("-B").arg(&tool).arg(&model).output() {
            Ok(output) => output,
            Err(e) => return println!("SKIPPED: python3 cannot be started: {e}"),
        };
        assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        let expected: Vec<[f64; 3]> = serde_json::from_slice(&output.stdout).unwrap();
        let (mesh, _) = import(&model, Keep::None, &Silent).unwrap();
        assert_eq!(3 * mesh.triangles.len(), expected.len(), "{name}");
        let size = expected.as_flattened().iter().fold(0.0f64, |m, x| m.max(x.abs()));
        for (t, expected) in expected.as_chunks::<3>().0.iter().enumerate() {
            let found = mesh.corners(t as u32);
            for (a, b) in found.as_flattened().iter().zip(expected.as_flattened()) {
                assert!(
                    (f64::from(*a) - b).abs() <= 1e-5 * size,
                    "{name}: triangle {t}: {found:?}, {expected:?}"
                );
            }
        }
    }
}
