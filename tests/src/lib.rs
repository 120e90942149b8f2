//! What the end-to-end, conformance and corruption tests share.

pub mod conformance;
pub mod crowd;
pub mod leaves;
pub mod meshes;
pub mod placed_soup;
pub mod rays;
pub mod stress;
pub mod structures;

pub use bth_oracle as oracle;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// The folder into which cargo builds (`target/debug`, `target/release`).
pub fn target_folder() -> PathBuf {
    let test = std::env::current_exe().expect("the test's own path");
    let deps = test.parent().expect("a folder");
    if deps.ends_with("deps") { deps.parent().expect("a folder").into() } else { deps.into() }
}

/// Builds packages of the workspace into [`target_folder`], and returns that folder. Cargo does not
/// build the programs of other packages for a test. Where `BTH_BUILT` is set, the programs exist
/// already: building a part of the workspace would rebuild dependencies with fewer features.
pub fn built(packages: &[&str]) -> PathBuf {
    let folder = target_folder();
    if std::env::var_os("BTH_BUILT").is_some() {
        return folder;
    }
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut build = Command::new(cargo);
    build.args(["build", "--quiet", "--target-dir"]).arg(folder.parent().expect("a folder"));
    build.args(packages.iter().flat_map(|p| ["-p", p]));
    match folder.file_name().and_then(|name| name.to_str()) {
        None | Some("debug") => {}
        Some(profile) => {
            build.args(["--profile", profile]);
        }
    }
    let status = build.current_dir(env!("CARGO_MANIFEST_DIR")).status().expect("cargo starts");
    assert!(status.success(), "{packages:?} do not build");
    folder
}

/// Returns how many rays, points or rounds a test takes: more by night, where `BTH_DEEP` is set.
pub fn by_day<T>(day: T, night: T) -> T {
    if std::env::var_os("BTH_DEEP").is_some() { night } else { day }
}

/// The tetrahedralization worker: `BTH_TETGEN`, or the one built with the tests. Prints a line
/// if there is no worker, since tests with tetrahedra are skipped then.
#[allow(clippy::print_stderr)]
pub fn worker() -> Option<&'static Path> {
    static FOUND: OnceLock<Option<PathBuf>> = OnceLock::new();
    let find = || {
        let named = std::env::var_os("BTH_TETGEN").map(PathBuf::from);
        let found = named.unwrap_or_else(|| target_folder().join("bth-tetgen"));
        if !found.is_file() {
            eprintln!("SKIPPED: everything with tetrahedra: no bth-tetgen (cargo build -p bth-tetgen)");
        }
        Some(found).filter(|f| f.is_file())
    };
    FOUND.get_or_init(find).as_deref()
}

/// Compiles the Rust code of the readme and the guide.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
#[doc = include_str!("../../docs/queries.md")]
#[doc = include_str!("../../docs/rust.md")]
#[doc = include_str!("../../docs/deforming.md")]
pub struct Pages;
