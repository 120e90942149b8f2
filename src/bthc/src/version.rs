//! `bthc --version`: what this build is and what it finds on the machine.

use crate::failure::Failure;
use crate::output;
use bth::Isa;
use bth_compile::Silent;
use bth_compile::tets::{TetOptions, worker};
use bth_format::layout::{MINIMUM_READER_VERSION, WRITER_VERSION};

/// What programs get from the target besides processor and system: the C library or compiler.
const ENVIRONMENT: &str = if cfg!(target_env = "musl") {
    "musl"
} else if cfg!(target_env = "gnu") {
    "gnu"
} else if cfg!(target_env = "msvc") {
    "msvc"
} else {
    ""
};

/// Prints the version; with `verbose` also what decides what this program can do here.
///
/// # Errors
/// If standard output cannot be written.
pub(crate) fn show(verbose: bool) -> Result<(), Failure> {
    let mut text = format!("bthc {}\n", env!("CARGO_PKG_VERSION"));
    if verbose {
        for (name, value) in details()? {
            text.push_str(&format!("{:<18} {value}\n", format!("{name}:")));
        }
    }
    Ok(output::text(&text)?)
}

fn details() -> Result<Vec<(&'static str, String)>, Failure> {
    let version = |code: u32| format!("{}.{}", code >> 16, code & 0xffff);
    let target = [std::env::consts::ARCH, std::env::consts::OS, ENVIRONMENT];
    let available: Vec<String> =
        Isa::ALL.iter().filter(|isa| isa.is_available()).map(Isa::to_string).collect();
    let features = [
        ("3mf", cfg!(feature = "3mf")),
        ("fbx", cfg!(feature = "fbx")),
        ("meshopt", cfg!(feature = "meshopt")),
        ("s3", cfg!(feature = "s3")),
    ];
    let features: Vec<&str> = features.iter().filter(|(_, on)| *on).map(|(name, _)| *name).collect();
    let tetgen = match worker(&TetOptions::default(), &Silent)? {
        Ok((program, version)) => format!("{version} in {}", program.display()),
        Err(why) => format!("none: {why}"),
    };
    Ok(vec![
        (
            "files",
            format!("{}, for readers from {}", version(WRITER_VERSION), version(MINIMUM_READER_VERSION)),
        ),
        ("target", target.iter().filter(|part| !part.is_empty()).copied().collect::<Vec<_>>().join("-")),
        ("linked", if cfg!(target_feature = "crt-static") { "statically" } else { "dynamically" }.to_owned()),
        ("instruction set", format!("{} of {}", Isa::chosen(), available.join(", "))),
        ("features", if features.is_empty() { "none".to_owned() } else { features.join(", ") }),
        ("TetGen", tetgen),
    ])
}
