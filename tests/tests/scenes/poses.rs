//! World matrices agree with an independent reader of glTF.

use crate::support::{animated, compiled, imported};
use bth_scene::Property;
use serde_json::Value;
use std::path::Path;
use std::process::Command;

const TIMES: usize = 50;

#[test]
fn world_matrices_are_those_of_an_independent_reader() {
    let tool = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tools/crosscheck/gltf_poses.py");
    let mut compared = 0;
    for path in animated() {
        let (manifest, report) = imported(&path);
        let (mut scene, _) = compiled(&manifest, path.parent().unwrap());
        let length = f64::from(manifest.frames.last) / manifest.frames.rate;
        // Beyond both ends too, and never exactly at a key.
        let times: Vec<f64> =
            (0..TIMES).map(|i| (i as f64 + 0.37) / 46.0 * (length + 0.1) - 0.03 * (length + 0.1)).collect();
        let arguments = times.iter().map(f64::to_string);
        let output = match Command::new("python3").arg("-B").arg(&tool).arg(&path).args(arguments).output() {
            Ok(output) => output,
            Err(e) => return println!("SKIPPED: python3 cannot be started: {e}"),
        };
        assert!(output.status.success(), "{}: {}", path.display(), String::from_utf8_lossy(&output.stderr));
        let said: Value = serde_json::from_slice(&output.stdout).unwrap();
        let (mut moved, mut first) = (false, Vec::new());
        for time in &times {
            scene.set_seconds(*time).unwrap();
            let (mut all, said) = (Vec::new(), &said[time.to_string()]);
            for (node, row) in report.node_rows.iter().enumerate() {
                let expected = &said[node];
                let Some(row) = row else {
                    assert!(expected.is_null(), "{}: node {node} is not in the scene", path.display());
                    continue;
                };
                let found = scene.node(*row as u32).0;
                let expected: Vec<f64> = (0..12).map(|i| expected[i / 4][i % 4].as_f64().unwrap()).collect();
                let size = expected.iter().fold(0.0f64, |m, x| m.max(x.abs()));
                for (a, b) in found.as_flattened().iter().zip(&expected) {
                    let place = || format!("{} node {node} at {time}", path.display());
                    assert!((a - b).abs() <= 1e-6 * size, "{}: {found:?}, {expected:?}", place());
                }
                all.push(found);
                compared += 1;
            }
            moved |= !first.is_empty() && first != all;
            first = all;
        }
        // Weights of morph targets move vertices, not nodes.
        let moves = manifest.tracks.iter().any(|track| track.property != Property::Weights);
        assert_eq!(moved, moves, "{} moves", path.display());
    }
    println!("{compared} matrices compared");
}
