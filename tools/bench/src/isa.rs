//! Which vector instructions our kernels use (`--isa`).

use anyhow::Result;
use bth::Isa;

/// Chooses the vector instructions that all tracing in this process uses, and returns their name:
/// those that are wanted, else those that the runtime library takes by default.
pub(crate) fn select(wanted: Option<&str>) -> Result<String> {
    match wanted {
        Some(name) => name.parse::<Isa>()?.choose()?,
        // The library ignores an unknown name in the environment; here it is an error.
        None => {
            Isa::from_environment()?;
        }
    }
    Ok(Isa::chosen().to_string())
}

/// As [`select`], for libraries of ours that are loaded later: they read the environment variable
/// `BTH_ISA`.
#[allow(unsafe_code)]
pub(crate) fn select_for_libraries(wanted: &str) -> Result<()> {
    select(Some(wanted))?;
    // SAFETY: called at the start of the program, while no other thread runs anything that could
    // read the environment.
    unsafe { std::env::set_var("BTH_ISA", wanted) };
    Ok(())
}
