//! The files that a glTF document refers to.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::cutout::AlphaMode;
use crate::error::Result;
use crate::gltf::container::split;
use crate::gltf::extensions::{MESHOPT, Use};
use crate::gltf::made::MadeFormat;
use crate::gltf::schema::{Buffer, GltfDocument, MeshoptFallback};
use crate::gltf::uri::beside;
use crate::materials::Looks;
use crate::monitor::Silent;
use crate::source::{Source, read_file};

/// Returns the files next to a glTF document that hold its buffers and the images that its looks
/// need, in order; none for what is no document, which reading it reports. Images count only if
/// they exist: reading them tells which are needed. So does the file of a fallback buffer, which is
/// not read where the compressed views are.
pub(crate) fn files(path: &Path, looks: Looks) -> Result<Vec<PathBuf>> {
    let data = read_file(path)?;
    let source = Source::new(path, &data, &Silent);
    let Some(document) = document(&source, looks) else { return Ok(Vec::new()) };
    let mut textures: Vec<usize> = document.cutout_textures(looks.alpha).collect();
    if looks.materials {
        textures.extend(document.kept_textures());
    }
    let mut images: Vec<PathBuf> = Vec::new();
    for uri in textures.into_iter().filter_map(|texture| document.texture_file(texture)) {
        images.extend(beside(path, &uri).filter(|file| file.is_file() && !images.contains(file)));
    }
    let file = |buffer: Buffer| {
        let uri = buffer.uri.as_deref().filter(|uri| !uri.starts_with("data:"))?;
        beside(path, uri).filter(|file| !is_fallback(&buffer) || file.exists())
    };
    Ok(document.buffers.into_iter().filter_map(file).chain(images).collect())
}

/// Returns the document, if there is one and it can name other files.
fn document(source: &Source<'_>, looks: Looks) -> Option<GltfDocument> {
    if let Some(format) = MadeFormat::of(source) {
        // Its meshes are in the file itself.
        let has_images = looks.materials || looks.alpha != AlphaMode::None;
        return has_images
            .then(|| (format.document)(source, Use::Parts, looks.polygons).ok())
            .flatten()
            .map(|made| made.document);
    }
    serde_json::from_slice(split(source).ok()?.0).ok()
}

fn is_fallback(buffer: &Buffer) -> bool {
    let mut values = MESHOPT.into_iter().filter_map(|name| buffer.extensions.get(name));
    values.any(|value| MeshoptFallback::deserialize(value).is_ok_and(|extension| extension.fallback))
}
