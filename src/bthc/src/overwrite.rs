//! Outputs must not replace inputs, whatever their paths are spelled like.

use crate::failure::Failure;
use std::path::Path;

/// Fails if an output would replace one of these files.
///
/// # Errors
/// Wrong usage (exit code 2).
pub(crate) fn check<P: AsRef<Path>>(
    output: &Path,
    inputs: impl IntoIterator<Item = P>,
) -> Result<(), Failure> {
    // What is not there yet replaces nothing, and of devices and pipes nothing is lost.
    if !std::fs::metadata(output).is_ok_and(|found| found.is_file()) {
        return Ok(());
    }
    let Ok(real) = output.canonicalize() else { return Ok(()) };
    let same = |input: &P| input.as_ref().canonicalize().is_ok_and(|input| input == real);
    match inputs.into_iter().find(same) {
        Some(input) => Err(Failure::Usage {
            message: format!(
                "{} would replace {}, which is read",
                output.display(),
                input.as_ref().display()
            ),
            hint: "name another output",
        }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_the_same_by_any_of_its_names() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("a.ply"), "").unwrap();
        std::fs::create_dir(at("d")).unwrap();
        assert!(check(&at("b.ply"), [at("a.ply")]).is_ok());
        for name in ["a.ply", "./a.ply", "d/../a.ply"] {
            assert!(check(&at(name), [at("c.ply"), at("a.ply")]).is_err(), "{name}");
        }
        assert!(check(&at("d"), [at("d")]).is_ok());
        assert!(check(&at("a.ply"), [at("d")]).is_ok());
    }
}
