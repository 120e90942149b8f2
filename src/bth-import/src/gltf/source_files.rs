//! The files that a glTF document refers to.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::gltf::container::split;
use crate::gltf::extensions::MESHOPT;
use crate::gltf::schema::{Buffer, GltfDocument, MeshoptFallback};
use crate::gltf::uri::beside;
use crate::gltf::{cutout, materials};
use crate::materials::Looks;
use crate::monitor::Silent;
use crate::source::Source;

/// The files beside a glTF document that hold its buffers and images that its looks need, in order; none for what is no
/// document, which reading it reports. Images count only if they exist: which of them are needed, reading them tells. So does a file of a
/// fallback buffer: with the compressed views it is not read.
pub fn external_files(path: &Path, data: &[u8], looks: Looks) -> Vec<PathBuf> {
    let source = Source::new(path, data, &Silent);
    let json = split(&source).map_or(&[][..], |(json, _)| json);
    let document = serde_json::from_slice::<GltfDocument>(json).ok();
    let of_materials = if looks.materials { materials::files(json) } else { Vec::new() };
    let mut images: Vec<PathBuf> = Vec::new();
    for uri in cutout::files(json, looks.alpha).iter().chain(&of_materials) {
        images.extend(beside(path, uri).filter(|file| file.is_file() && !images.contains(file)));
    }
    let buffers = document.into_iter().flat_map(|document| document.buffers);
    let file = |buffer: Buffer| {
        let uri = buffer.uri.as_deref().filter(|uri| !uri.starts_with("data:"))?;
        beside(path, uri).filter(|file| !is_fallback(&buffer) || file.exists())
    };
    buffers.filter_map(file).chain(images).collect()
}

fn is_fallback(buffer: &Buffer) -> bool {
    let mut values = MESHOPT.into_iter().filter_map(|name| buffer.extensions.get(name));
    values.any(|value| MeshoptFallback::deserialize(value).is_ok_and(|extension| extension.fallback))
}
