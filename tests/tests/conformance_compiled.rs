//! Files that the compiler writes satisfy the specification, as the reader, the verifier and the
//! reader in Python check it.
#![allow(clippy::print_stdout)] // Tests that cannot run print why.

use bth_compile::Silent;
use bth_compile::free::{FreeOptions, KeepFree};
use bth_compile::pipeline::{CompileOptions, Structure, compile};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Compiles a model; `None` where the structure needs a worker that does not exist.
fn compiled(model: &bth_scenes::Model, options: &CompileOptions) -> Option<Vec<u8>> {
    if options.structure != Structure::Bvh && bth_tests::worker().is_none() {
        return None;
    }
    let mut options = options.clone();
    options.tets.worker = bth_tests::worker().map(Into::into);
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("model.ply");
    bth_scenes::write::file(model, &source).unwrap();
    let (compiled, _) = compile(&source, &options, &Silent).unwrap();
    Some(compiled.bytes)
}

fn kinds() -> impl Iterator<Item = CompileOptions> {
    let structures = [Structure::Bvh, Structure::Bth, Structure::Tets];
    structures.into_iter().flat_map(|structure| {
        [KeepFree::None, KeepFree::All].map(|keep| CompileOptions {
            structure,
            // At this cost of a step the tetrahedra of the knot are chosen.
            free: FreeOptions { keep, ..FreeOptions::default() },
            costs: bth_compile::costs::CostOptions { c_tet: Some(1e-3), ..Default::default() },
            ..CompileOptions::default()
        })
    })
}

#[test]
fn compiled_files_verify() {
    for options in kinds() {
        for model in [bth_scenes::knot::torus_knot(3000), bth_scenes::hairball::hairball(3000)] {
            if options.structure == Structure::Tets && model == bth_scenes::hairball::hairball(3000) {
                // Its fibres intersect: it cannot be tetrahedralized whole.
                continue;
            }
            let Some(bytes) = compiled(&model, &options) else { return };
            let file = bth_format::File::from_bytes(&bytes).unwrap();
            let report =
                bth_format::verify::verify(&file).unwrap_or_else(|e| panic!("{options:?}: {}", e[0]));
            assert_eq!(report.triangles + report.dropped, model.triangles.len() as u64);
            assert_eq!(report.compared_with_source, 1);
            if options.structure == Structure::Tets {
                assert!(report.tet_leaves > 0 && report.tets > report.triangles, "{report:?}");
            }
        }
    }
}

#[test]
fn python_reader_accepts_compiled_files() {
    let folder = tempfile::tempdir().unwrap();
    let mut files: Vec<PathBuf> = Vec::new();
    for (i, options) in kinds().enumerate() {
        let Some(bytes) = compiled(&bth_scenes::knot::torus_knot(300), &options) else { continue };
        files.push(folder.path().join(format!("{i}.bth")));
        std::fs::write(&files[files.len() - 1], bytes).unwrap();
    }
    let tool = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tools/bth_dump/bth_dump.py");
    match Command::new("python3").arg("-B").arg(tool).args(&files).output() {
        Ok(output) => assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout)),
        Err(e) => println!("SKIPPED: python3 cannot be started: {e}"),
    }
}
