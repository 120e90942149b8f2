//! Messy files of other people's test suites: every one ends with a clear answer.

use crate::support::{command, data, wait};
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::Duration;

fn models(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_lowercase();
        if path.is_dir() {
            models(&path, found);
        } else if ["obj", "ply", "stl", "off", "glb", "gltf"].contains(&extension.as_str()) {
            found.push(path);
        }
    }
}

#[test]
fn messy_files_compile_or_are_refused_with_a_reason() {
    let Some(data) = data() else { return };
    let mut files = Vec::new();
    models(&data.join("messy"), &mut files);
    files.sort();
    assert!(!files.is_empty());
    let folder = tempfile::tempdir().unwrap();
    let mut compiled = 0;
    for file in &files {
        let model = file.to_str().unwrap();
        let args = ["compile", model, "-o", "out.bth", "--quiet", "--tet-deadline", "20"];
        let stderr = std::fs::File::create(folder.path().join("stderr")).unwrap();
        let mut child = command("bthc", folder.path(), &args).stderr(Stdio::from(stderr)).spawn().unwrap();
        let status = wait(&mut child, Duration::from_secs(300)).unwrap_or_else(|| panic!("{model}: no end"));
        let message = std::fs::read_to_string(folder.path().join("stderr")).unwrap();
        match status.code() {
            Some(0) => {
                compiled += 1;
                let bytes = std::fs::read(folder.path().join("out.bth")).unwrap();
                let file = bth::File::from_bytes(&bytes).unwrap();
                bth::verify::verify(&file).unwrap_or_else(|e| panic!("{model}: {e:?}"));
            }
            Some(3 | 5) => {
                assert!(message.starts_with("error: ") && message.contains("BTH-"), "{model}: {message}")
            }
            _ => panic!("{model}: {status:?}: {message}"),
        }
        let _ = std::fs::remove_file(folder.path().join("out.bth"));
    }
    println!("{compiled} of {} messy files compiled, the others were refused", files.len());
    assert!(compiled * 2 > files.len(), "only {compiled} of {} compiled", files.len());
}
