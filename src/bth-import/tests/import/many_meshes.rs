//! Documents of many meshes, each imported as a separate model: what they share is read once.

use super::gltf::{binary, edited};
use super::*;
use bth_import::{GltfPart, import_gltf_parts};
use serde_json::json;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};

/// Removes a file once a mesh has been read.
struct Remover {
    file: PathBuf,
    /// How often it was asked whether the import is cancelled: twice for a mesh of one primitive
    /// before its vertices are read.
    asked: AtomicU32,
}

impl Monitor for Remover {
    fn cancelled(&self) -> bool {
        if self.asked.fetch_add(1, Ordering::Relaxed) == 2 {
            std::fs::remove_file(&self.file).unwrap();
        }
        false
    }
}

#[test]
fn a_buffer_beside_the_document_is_read_once_for_all_meshes() {
    let folder = tempfile::tempdir().unwrap();
    let (path, file) = (folder.path().join("a.gltf"), folder.path().join("a.bin"));
    let document = edited(|d| {
        d["buffers"][0]["uri"] = "a.bin".into();
        d["meshes"] = vec![d["meshes"][0].clone(); 20].into();
    });
    std::fs::write(&path, document.to_string()).unwrap();
    std::fs::write(&file, binary()).unwrap();
    let parts: Vec<_> = (0..20).map(GltfPart::Mesh).collect();
    let monitor = Remover { file, asked: AtomicU32::new(0) };
    let meshes = import_gltf_parts(&path, &parts, Keep::All, &monitor).unwrap();
    assert!(!monitor.file.exists());
    assert!(meshes.iter().all(|(mesh, _)| mesh.positions == SQUARE));
}

#[test]
fn a_material_for_each_of_many_meshes_is_quick() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    let document = edited(|d| {
        let mesh =
            |k: u32| json!({"primitives": [{"attributes": {"POSITION": 0}, "mode": 5, "material": k}]});
        let material = |k: u32| json!({"pbrMetallicRoughness": {"baseColorFactor": [k, 0, 0, 1]}});
        d["meshes"] = (0..4000).map(mesh).collect();
        d["materials"] = (0..4000).map(material).collect();
    });
    std::fs::write(&path, gltf::glb(&document, &binary())).unwrap();
    let parts: Vec<_> = (0..4000).map(GltfPart::Mesh).collect();
    let wanted = everything();
    let start = std::time::Instant::now();
    let meshes = import_gltf_parts(&path, &parts, wanted, &Silent).unwrap();
    // Reading the document again for each mesh takes longer.
    assert!(start.elapsed().as_secs() < 8);
    let last = meshes[3999].0.materials.as_ref().unwrap();
    assert_eq!(last.parameters[0].base_color, [3999.0, 0.0, 0.0, 1.0]);
}
