//! Which vector instructions our kernels use (`--isa`).

use anyhow::Result;
use bth::Isa;

/// Chooses what all tracing in this process uses, and returns its name: what is wanted, else what the
/// runtime library would take.
///
/// # Errors
/// If there is no such instruction set or this machine lacks it.
pub fn select(wanted: Option<&str>) -> Result<String> {
    match wanted {
        Some(name) => name.parse::<Isa>()?.choose()?,
        // A name that the library would pass over is a mistake here.
        None => {
            Isa::from_environment()?;
        }
    }
    Ok(Isa::chosen().to_string())
}
