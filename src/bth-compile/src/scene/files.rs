//! The files that a scene is made from.

use super::moving::moving_files;
use crate::error::Result;
use crate::source;
use bth_import::Looks;
use bth_scene::Manifest;
use std::path::{Path, PathBuf};

/// All files that a scene is made from whose manifest was read from `path`: the manifest, then the
/// models and those to which they refer.
///
/// # Errors
/// `BTH-O001` when a model that is there cannot be read.
pub fn files(manifest: &Manifest, path: &Path, looks: Looks) -> Result<Vec<PathBuf>> {
    let mut files = vec![path.to_owned()];
    let folder = path.parent().unwrap_or(Path::new(""));
    for object in &manifest.objects {
        // The files of an object without visible instances may be missing.
        let moving = moving_files(&object.source, folder).unwrap_or_default();
        for file in moving.iter().filter(|file| file.exists()) {
            files.extend(source::files(file, looks)?);
        }
    }
    let mut models: Vec<&str> = manifest.objects.iter().map(|o| o.source.path()).collect();
    models.sort_unstable();
    models.dedup();
    for model in models {
        // Without a leading `./`, since build systems compare names.
        let model = folder.join(model);
        // The file of an object without visible instances may be missing.
        if model != *path && model.exists() && !files.contains(&model) {
            files.extend(source::files(&model, looks)?);
        }
    }
    Ok(files)
}
