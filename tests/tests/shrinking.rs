//! A file that is truncated while it is in use gives an error.
#![cfg(target_os = "linux")]

use bth::Scene;
use bth::rays::{Hit, Ray};
use bth_compile::pipeline::{CompileOptions, Structure};
use bth_tests::structures::compiled;
use std::fs::OpenOptions;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};

/// Names the file to the child process.
const CHILD: &str = "BTH_TEST_TRUNCATES";
/// POSIX: access to an undefined portion of a memory object.
const SIGBUS: i32 = 7;

/// A compiled model of many pages in a new folder.
fn model() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let options = CompileOptions { structure: Structure::Bvh, ..CompileOptions::default() };
    let scene = compiled(&bth_scenes::blob::blob(3000), &options);
    let path = folder.path().join("model.bth");
    std::fs::write(&path, scene.file().bytes()).unwrap();
    assert!(scene.file().bytes().len() > 1 << 16);
    (folder, path)
}

fn hits(scene: &Scene) -> Vec<Hit> {
    let ray = |i: i32| Ray {
        origin: [i as f32 / 40.0 - 1.0, 0.1, 9.0],
        tmin: 0.0,
        direction: [0.0, 0.0, -1.0],
        tmax: f32::INFINITY,
    };
    (0..80).map(|i| scene.nearest(&ray(i)).unwrap_or(Hit::MISS)).collect()
}

fn truncate(path: &Path) {
    OpenOptions::new().write(true).open(path).unwrap().set_len(0).unwrap();
}

#[test]
fn an_opened_file_is_immune_to_truncation() {
    let (_folder, path) = model();
    let scene = bth::open(&path).unwrap();
    let before = hits(&scene);
    assert!(before.iter().any(Hit::is_hit));
    truncate(&path);
    assert_eq!(hits(&scene), before);
    assert!(bth::open(&path).is_err());
}

#[test]
fn truncating_a_mapped_file_ends_the_process_that_traces_it_with_sigbus() {
    if let Some(path) = std::env::var_os(CHILD) {
        // SAFETY: the test breaks the contract on purpose by truncating the file; the documented
        // signal ends this child process.
        #[allow(unsafe_code)]
        let scene = unsafe { bth::map(&path) }.unwrap();
        truncate(Path::new(&path));
        hits(&scene);
        // Not reached.
        std::process::exit(0);
    }
    let (_folder, path) = model();
    let name = "truncating_a_mapped_file_ends_the_process_that_traces_it_with_sigbus";
    let child = std::process::Command::new(std::env::current_exe().unwrap())
        .args(["--exact", name, "--test-threads", "1"])
        .env(CHILD, &path)
        .output()
        .unwrap();
    assert_eq!(child.status.signal(), Some(SIGBUS), "{child:?}");
}
