//! What the end-to-end, conformance and corruption tests share.

pub mod conformance;
pub mod oracle;
pub mod rays;
pub mod rng;

use std::path::PathBuf;

/// The folder into which cargo builds (`target/debug` or `target/release`).
pub fn target_folder() -> PathBuf {
    let test = std::env::current_exe().expect("the test's own path");
    let deps = test.parent().expect("a folder");
    if deps.ends_with("deps") { deps.parent().expect("a folder").into() } else { deps.into() }
}

/// Whether the tetrahedralization worker can be found: `BTH_TETGEN`, or built beside the tests. Says so when
/// not, since what needs it is skipped then.
#[allow(clippy::print_stderr)]
pub fn worker() -> bool {
    static FOUND: std::sync::OnceLock<bool> = std::sync::OnceLock::new();
    *FOUND.get_or_init(|| {
        let found = bth_compile::tets::find_worker().is_some();
        if !found {
            eprintln!("SKIPPED: everything with tetrahedra: no bth-tetgen (cargo build -p bth-tetgen)");
        }
        found
    })
}

/// Compiles the Rust code of the readme.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
pub struct Readme;
