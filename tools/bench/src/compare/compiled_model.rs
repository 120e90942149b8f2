//! A model as both builds open it: compiled here, or a compiled file that is used as it is.

use crate::model::Model;
use crate::structures;
use anyhow::Result;
use bth::Scene;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A model and its compiled file.
pub(super) struct CompiledModel {
    pub(super) model: Model,
    /// The file, opened by this program: it finds the surfaces that rays start on.
    pub(super) scene: Scene,
    /// The file that both builds open.
    pub(super) file: PathBuf,
    /// Holds the file if it was compiled here.
    _folder: Option<TempDir>,
}

impl CompiledModel {
    /// Uses a `.bth` file as it is; compiles other models with the default options.
    ///
    /// # Errors
    /// If the model cannot be read or compiled; see also [`Model::of_compiled`].
    pub(super) fn load(which: &str) -> Result<CompiledModel> {
        let path = Path::new(which);
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("bth")) {
            let scene = bth::open(path)?;
            let model = Model::of_compiled(path, &scene)?;
            return Ok(CompiledModel { model, scene, file: path.to_owned(), _folder: None });
        }
        let model = Model::load(which)?;
        let bytes = structures::compile(&model, &structures::BTH)?.bytes;
        let folder = tempfile::tempdir()?;
        let file = folder.path().join("model.bth");
        std::fs::write(&file, &bytes)?;
        let scene = bth::from_bytes(&bytes)?;
        Ok(CompiledModel { model, scene, file, _folder: Some(folder) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_compiled_file_is_used_as_it_is() {
        let made = CompiledModel::load("torus-knot:320").unwrap();
        let again = CompiledModel::load(made.file.to_str().unwrap()).unwrap();
        assert_eq!(again.file, made.file);
        assert_eq!(again.model.mesh.positions, made.model.mesh.positions);
        assert_eq!(again.model.mesh.triangles, made.model.mesh.triangles);
    }
}
