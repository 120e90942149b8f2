//! Compiles the shim against the system's TetGen, or against `TETGEN_DIR`: a folder with
//! `tetgen.h` and either TetGen's sources (1.5 or 1.6) or a library `libtet`.

use std::path::{Path, PathBuf};

fn main() {
    println!("cargo::rerun-if-changed=shim.cpp");
    println!("cargo::rerun-if-changed=tetgen_source.cpp");
    println!("cargo::rerun-if-env-changed=TETGEN_DIR");

    let folder = std::env::var_os("TETGEN_DIR").map(PathBuf::from);
    let system = ["/usr/include", "/usr/local/include", "/opt/homebrew/include"];
    let header = match &folder {
        Some(folder) => Some(folder.join("tetgen.h")).filter(|h| h.is_file()),
        None => system.iter().map(|f| Path::new(f).join("tetgen.h")).find(|h| h.is_file()),
    };
    let Some(header) = header else {
        let place = folder.map_or_else(|| "the system's include folders".into(), |f| f.display().to_string());
        println!(
            "cargo::error=no tetgen.h in {place}: install TetGen (Debian and Ubuntu: libtet1.5-dev) or let TETGEN_DIR name a \
             folder with tetgen.h and TetGen's sources or library"
        );
        return;
    };
    println!("cargo::rerun-if-changed={}", header.display());
    println!("cargo::rustc-env=BTH_TETGEN_VERSION={}", version(&header));

    let mut shim = cc::Build::new();
    shim.cpp(true).file("shim.cpp").define("TETLIBRARY", None).warnings(false).flag("-fno-fast-math");
    let sources =
        folder.as_ref().filter(|f| f.join("tetgen.cxx").is_file() && f.join("predicates.cxx").is_file());
    if let Some(folder) = sources {
        // Shewchuk's predicates need every operation rounded as written: no optimization at all.
        let mut predicates = cc::Build::new();
        predicates.cpp(true).file(folder.join("predicates.cxx")).include(folder).define("TETLIBRARY", None);
        predicates.opt_level(0).warnings(false).flag("-fno-fast-math").flag_if_supported("-ffp-contract=off");
        let mut mesher = cc::Build::new();
        mesher.cpp(true).file("tetgen_source.cpp").include(folder).define("TETLIBRARY", None).warnings(false);
        mesher.opt_level(2).flag("-fno-fast-math").flag_if_supported("-ffp-contract=off");
        shim.include(folder).compile("bth_tetgen_shim");
        mesher.compile("bth_tetgen_mesher");
        predicates.compile("bth_tetgen_predicates");
    } else {
        if let Some(folder) = &folder {
            shim.include(folder);
            println!("cargo::rustc-link-search=native={}", folder.display());
        }
        shim.compile("bth_tetgen_shim");
        println!("cargo::rustc-link-lib=tet");
    }
}

/// TetGen's version, from the comment at the head of its header.
fn version(header: &Path) -> String {
    let text = std::fs::read(header).unwrap_or_default();
    let text = String::from_utf8_lossy(&text);
    let line = text.lines().take(40).find_map(|l| l.split_once("Version ").map(|(_, rest)| rest));
    let digits: String = line.unwrap_or("").chars().take_while(|c| c.is_ascii_digit() || *c == '.').collect();
    if digits.is_empty() { "unknown".into() } else { digits }
}
