//! The tets stage with a real worker, which `cargo build -p bth-tetgen` builds. Without it these
//! tests are skipped and print that.
#![allow(clippy::print_stdout, reason = "tests print what they skip and what they measured")]

mod faults;
mod meshes;
mod models;
mod oracle;
mod records;
mod shapes;

use std::path::PathBuf;

use bth_tets::TetOptions;

/// TetOptions with the worker that was built with these tests.
fn with_worker(test: &str) -> Option<TetOptions> {
    let named = std::env::var_os("BTH_TETGEN").map(PathBuf::from);
    let beside = || {
        let exe = std::env::current_exe().ok()?;
        Some(exe.parent()?.parent()?.join(if cfg!(windows) { "bth-tetgen.exe" } else { "bth-tetgen" }))
    };
    let worker = named.or_else(beside).filter(|p| p.is_file());
    if worker.is_none() {
        println!("{test}: skipped, there is no bth-tetgen (cargo build -p bth-tetgen)");
    }
    worker.map(|worker| TetOptions { worker: Some(worker), ..TetOptions::default() })
}
