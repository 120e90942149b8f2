//! Outputs must not replace inputs, whatever their paths are spelled like.

use crate::failure::Failure;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Outputs that are files already, by their real paths.
pub(crate) struct Outputs<'a>(HashMap<PathBuf, &'a Path>);

impl<'a> Outputs<'a> {
    pub(crate) fn new(outputs: impl IntoIterator<Item = &'a Path>) -> Self {
        // What is not there yet replaces nothing, and of devices and pipes nothing is lost.
        let files = outputs.into_iter().filter(|output| output.is_file());
        Self(files.filter_map(|output| Some((output.canonicalize().ok()?, output))).collect())
    }

    /// Returns true if there are no outputs.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Fails if one of them would replace one of these files.
    ///
    /// # Errors
    /// Wrong usage (exit code 2).
    pub(crate) fn check<P: AsRef<Path>>(&self, inputs: impl IntoIterator<Item = P>) -> Result<(), Failure> {
        for input in inputs {
            let input = input.as_ref();
            if let Some(output) = input.canonicalize().ok().and_then(|real| self.0.get(&real)) {
                return Err(Failure::Usage {
                    message: format!("{} would replace {}, which is read", output.display(), input.display()),
                    hint: "name another output",
                });
            }
        }
        Ok(())
    }
}

/// Where a file of this path lies or would lie, the same for every spelling of its folder.
pub(crate) fn place(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match (folder.canonicalize(), path.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => path.to_owned(),
    }
}

/// Fails if an output would replace one of these files.
///
/// # Errors
/// Wrong usage (exit code 2).
pub(crate) fn check<P: AsRef<Path>>(
    output: &Path,
    inputs: impl IntoIterator<Item = P>,
) -> Result<(), Failure> {
    Outputs::new([output]).check(inputs)
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
        for name in ["new", "./new", "d/../new"] {
            assert_eq!(place(&at(name)), place(&at("new")));
        }
        assert_ne!(place(&at("new")), place(&at("d/new")));
    }
}
