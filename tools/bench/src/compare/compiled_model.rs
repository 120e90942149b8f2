//! A model as the builds open it: compiled here, or compiled files that are used as they are.

use crate::model::Model;
use crate::structures;
use anyhow::Result;
use bth::Scene;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A model and its compiled file.
pub(super) struct CompiledModel {
    pub(super) model: Model,
    /// The new build's file, opened by this program: it finds the surfaces that rays start on.
    pub(super) scene: Scene,
    /// The files that the old and the new build open.
    pub(super) files: [PathBuf; 2],
    /// Holds the file if it was compiled here.
    _folder: Option<TempDir>,
}

impl CompiledModel {
    /// Uses a `.bth` file, or two with a comma between them, as they are; compiles other models
    /// with the default options.
    pub(super) fn load(which: &str) -> Result<CompiledModel> {
        let is_compiled = |path: &Path| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("bth"));
        let two = which.split_once(',').filter(|(old, _)| is_compiled(Path::new(old)));
        let files = <[_; 2]>::from(two.unwrap_or((which, which))).map(PathBuf::from);
        if is_compiled(&files[1]) {
            let scene = bth::open(&files[1])?;
            let model = Model::of_compiled(&files[1], &scene)?;
            return Ok(CompiledModel { model, scene, files, _folder: None });
        }
        let model = Model::load(which)?;
        let bytes = structures::compile(&model, &structures::BTH)?.bytes;
        let folder = tempfile::tempdir()?;
        let file = folder.path().join("model.bth");
        std::fs::write(&file, &bytes)?;
        let scene = bth::from_bytes(&bytes)?;
        Ok(CompiledModel { model, scene, files: [file.clone(), file], _folder: Some(folder) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn compiled_files_are_used_as_they_are() {
        let made = CompiledModel::load("torus-knot:320").unwrap();
        let file = made.files[0].to_str().unwrap();
        let again = CompiledModel::load(file).unwrap();
        assert_eq!((&again.files, &again.model.mesh.triangles), (&made.files, &made.model.mesh.triangles));
        let two = CompiledModel::load(&format!("older.bth,{file}")).unwrap();
        assert_eq!(two.files, [PathBuf::from("older.bth"), made.files[1].clone()]);
    }
}
