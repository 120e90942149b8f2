//! The files that a glTF document refers to.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::error::Result;
use crate::gltf::container::split;
use crate::gltf::extensions::MESHOPT;
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
    let json = split(&source).map_or(&[][..], |(json, _)| json);
    let Ok(document) = serde_json::from_slice::<GltfDocument>(json) else { return Ok(Vec::new()) };
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

fn is_fallback(buffer: &Buffer) -> bool {
    let mut values = MESHOPT.into_iter().filter_map(|name| buffer.extensions.get(name));
    values.any(|value| MeshoptFallback::deserialize(value).is_ok_and(|extension| extension.fallback))
}
