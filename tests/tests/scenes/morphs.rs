//! Morph targets of glTF files: animated weights, their defaults, and tracks.

use crate::made_gltf::{Document, assert_near, push, world};
use bth_scene::Property;
use serde_json::json;
use std::path::Path;

/// The square with two targets: one lifts its vertices, a sparse one moves the last.
pub(crate) fn morphed() -> Document {
    let mut document = Document::new();
    let lift = document.floats(&[[0.0f32, 0.0, 1.0], [0.0, 0.0, 2.0], [0.0, 0.0, 3.0], [0.0, 0.0, 4.0]]);
    let (places, news) = (document.view(&[3]), document.view(&(-7.0f32).to_le_bytes().repeat(3)));
    let sparse = json!({"componentType": 5126, "count": 4, "type": "VEC3", "sparse": {"count": 1,
        "indices": {"bufferView": places, "componentType": 5121}, "values": {"bufferView": news}}});
    let sparse = push(&mut document.json["accessors"], sparse);
    document.edit(|d| {
        d["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": lift}, {"POSITION": sparse}]);
        d["nodes"][0]["scale"] = json!([1, 1, 1]);
    })
}

#[test]
fn morph_targets_of_weights_that_are_animated_in_every_way() {
    let at = |a: f64, b: f64| {
        [
            [100.0, 0.0, a],
            [101.0, 0.0, 2.0 * a],
            [101.0, 1.0, 3.0 * a],
            [100.0 - 7.0 * b, 1.0 - 7.0 * b, 4.0 * a - 7.0 * b],
        ]
    };
    let keys: [[f32; 1]; 6] = [[0.0], [0.0], [1.0], [0.5], [0.5], [1.0]];
    // Keys at 1, 2 and 4 seconds; before and behind them the weights are constant.
    for (interpolation, times) in [("LINEAR", [0.0, 1.25, 3.0, 9.0]), ("STEP", [0.5, 1.75, 3.9, 4.0])] {
        let document = morphed().animate((0, "weights", interpolation), &[1.0, 2.0, 4.0], &keys);
        let expected = match interpolation {
            "LINEAR" => [at(0.0, 0.0), at(0.25, 0.125), at(0.75, 0.75), at(0.5, 1.0)],
            _ => [at(0.0, 0.0), at(0.0, 0.0), at(1.0, 0.5), at(0.5, 1.0)],
        };
        let mut scene = document.scene();
        for (seconds, expected) in times.into_iter().zip(expected) {
            scene.set_seconds(seconds).unwrap();
            assert_near(&world(&scene, 0), &expected);
        }
    }
    // In-tangents, values and out-tangents of both targets at each key.
    let cubic: [[f32; 2]; 6] = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [3.0, 0.0], [1.0, 0.0], [0.0, 0.0]];
    let cubic: Vec<[f32; 1]> = cubic.as_flattened().iter().map(|x| [*x]).collect();
    let document = morphed().animate((0, "weights", "CUBICSPLINE"), &[0.0, 2.0], &cubic);
    // At the middle, by halves of the values and an eighth of the duration times the difference of
    // the tangents.
    assert_near(&document.world(1.0), &at(0.5 + 2.0 / 8.0 * (1.0 - 3.0), 0.5));
    assert_near(&document.world(2.0), &at(1.0, 0.0));
}

#[test]
fn default_weights_are_those_of_the_node_or_else_of_the_mesh_and_come_before_the_skin() {
    let of_mesh = |document: Document| document.edit(|d| d["meshes"][0]["weights"] = json!([0.5, 0.0]));
    let still = of_mesh(morphed()).scene();
    assert!(still.vertex_count(0).is_none(), "what nothing moves does not deform");
    assert_near(&world(&still, 0)[2..3], &[[101.0, 1.0, 1.5]]);
    let of_node = of_mesh(morphed()).edit(|d| d["nodes"][0]["weights"] = json!([2.0, 0.0])).scene();
    assert_near(&world(&of_node, 0)[2..3], &[[101.0, 1.0, 6.0]]);
    // With a skin all is doubled by joint b, and moved by it.
    let mut both = of_mesh(morphed());
    let joints = both.integers(&[1; 16], "VEC4", 4);
    let weights = both.floats(&[[1.0f32, 0.0, 0.0, 0.0]; 4]);
    both.attribute("JOINTS_0", joints);
    both.attribute("WEIGHTS_0", weights);
    let both = both.edit(|d| {
        d["skins"] = json!([{"joints": [2, 3]}]);
        d["nodes"][0]["skin"] = 0.into();
    });
    assert_near(&both.moving().world(1.0)[2..3], &[[3.0, 12.0, 8.0]]);
}

#[test]
fn tracks_of_weights_need_a_deformer_with_weights() {
    let text = "version = 1\nnodes = [{ name = \"a\" }]\n[[tracks]]\nnode = \"a\"\nproperty = \"weights\"\ntimes = [0]\nvalues = [[1]]";
    let error = bth_scene::parse(text, Path::new("x")).unwrap_err().to_string();
    assert!(error.contains("BTH-M013") && error.contains("deformer"), "{error}");
    assert_eq!(Property::Weights.width(), None);
}
