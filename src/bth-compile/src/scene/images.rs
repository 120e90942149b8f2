//! The images of a scene's textures: each is stored once, whichever objects refer to it.

use super::context::Context;
use super::objects::Objects;
use super::sources::File;
use crate::error::Result;
use crate::source::changed;
use crate::write::{self, DiskFile, FileBuilder};
use bth_format::layout::kind;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Adds the images that textures of the objects refer to, from the files of their sources.
///
/// # Errors
/// `BTH-O002` where a file has changed since its materials were read, so that an image is not there
/// any more.
pub(super) fn write(
    builder: &mut FileBuilder<'_>,
    sources: &[File<'_>],
    objects: &Objects,
    context: &Context<'_>,
) -> Result<()> {
    let mut missing = objects.image_names();
    let mut found: BTreeMap<[u8; 16], Vec<u8>> = BTreeMap::new();
    for file in sources {
        if missing.is_empty() {
            break;
        }
        for (name, bytes) in images_of(file, context)? {
            if missing.remove(&name) {
                found.insert(name, bytes);
            }
        }
    }
    if !missing.is_empty() {
        let path = sources.first().map_or(std::path::Path::new(""), |file| file.full.as_path());
        return Err(changed(path));
    }
    write::images(builder, found.iter().map(|(name, bytes)| (*name, bytes.as_slice())))
}

/// The images of a source file, with their names.
fn images_of(file: &File<'_>, context: &Context<'_>) -> Result<Vec<([u8; 16], Vec<u8>)>> {
    if file.in_memory.is_some() {
        return Ok(Vec::new());
    }
    if !file.compiled {
        let images = bth_import::import_images(&file.full, file.digest.looks, context.monitor)?;
        return Ok(images.into_iter().map(|image| (image.name, image.bytes)).collect());
    }
    let table = bth_format::file::read_table(&file.full).map_err(|_| changed(&file.full))?;
    let disk = Arc::new(DiskFile::at(&file.full));
    let mut builder = FileBuilder::new();
    builder.copied(&disk, table.iter().filter(|e| matches!(e.kind, kind::IMAGES | kind::IMAGE_BYTES)))?;
    let compiled = write::assembled(&builder)?;
    if compiled.check_images().is_err() {
        return Ok(Vec::new());
    }
    let images = compiled.images();
    let one = |row: u32| Some((images.images.get(row as usize)?.name, images.file(row)?.to_vec()));
    Ok((0..images.images.len() as u32).filter_map(one).collect())
}
