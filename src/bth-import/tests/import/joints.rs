//! Skins of glTF scenes with many joints.

use super::gltf::Model;
use super::*;
use bth_import::gltf::scene::{self, ImportOptions};
use serde_json::json;
use std::path::Path;

/// A triangle whose skin has `joints` joints, each the child of the one before; the first turns,
/// and no node of the scene is one of them.
fn chain(joints: usize) -> Vec<u8> {
    let joint = |k: usize| if k < joints { json!({"children": [k + 1]}) } else { json!({}) };
    let nodes: Vec<_> =
        std::iter::once(json!({"mesh": 0, "skin": 0})).chain((1..=joints).map(joint)).collect();
    let document = json!({
        "scene": 0, "scenes": [{"nodes": [0]}], "nodes": nodes,
        "skins": [{"joints": (1..=joints).collect::<Vec<_>>()}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}}]}],
        "animations": [{"channels": [{"sampler": 0, "target": {"node": 1, "path": "rotation"}}],
            "samplers": [{"input": 3, "output": 4}]}],
    });
    Model::new(document)
        .rows(&[[0f32, 0., 0.], [1., 0., 0.], [0., 1., 0.]])
        .rows(&[[0u16; 4]; 3])
        .rows(&[[1f32, 0., 0., 0.]; 3])
        .rows(&[[0f32], [1.]])
        .rows(&[[0f32, 0., 0., 1.], [0., 0., 1., 0.]])
        .glb()
}

#[test]
fn many_joints_below_each_other_are_quick() {
    const JOINTS: usize = 30_000;
    let bytes = chain(JOINTS);
    let start = std::time::Instant::now();
    let path = Path::new("a.glb");
    let (manifest, _) =
        scene::import_bytes(path, &bytes, "a.glb", &ImportOptions::default(), &Silent).unwrap();
    // Following the ancestors of each joint up to the root takes longer.
    assert!(start.elapsed().as_secs() < 5);
    let joints = &manifest.skins[0].joints;
    assert_eq!((joints.len(), manifest.deformers.len()), (JOINTS, 1));
    assert_eq!(manifest.nodes.get(joints[0]).parent, None);
    assert!(joints.windows(2).all(|pair| manifest.nodes.get(pair[1]).parent == Some(pair[0])));
}

#[test]
fn animations_of_more_frames_than_there_may_be_are_told() {
    let bytes = chain(1);
    let imported = |rate: f64, strict: bool| {
        let options = ImportOptions { rate, strict, ..ImportOptions::default() };
        scene::import_bytes(Path::new("a.glb"), &bytes, "a.glb", &options, &Silent)
    };
    // The last key is at 1 s.
    let most = 1 << 24;
    let (manifest, report) = imported(f64::from(most), true).unwrap();
    assert_eq!((manifest.frames.last, report.ignored.len()), (most, 0));
    let (manifest, report) = imported(f64::from(most + 1), false).unwrap();
    assert_eq!(manifest.frames.last, most);
    assert!(report.ignored[0].contains("1 s are more than 16777216 frames"), "{:?}", report.ignored);
    assert!(imported(f64::from(most + 1), true).unwrap_err().to_string().contains("BTH-I015"));
}
