//! The sections of the images of textures.

use super::FileBuilder;
use crate::error::Result;
use bth_format::layout::*;
use std::collections::{BTreeMap, BTreeSet};
use zerocopy::{FromBytes, IntoBytes};

/// Adds image files, each once; nothing without any.
///
/// # Errors
/// `BTH-X031` when they exist already.
pub fn images<'i>(
    builder: &mut FileBuilder<'_>,
    files: impl IntoIterator<Item = ([u8; 16], &'i [u8])>,
) -> Result<()> {
    let files: BTreeMap<[u8; 16], &[u8]> = files.into_iter().collect();
    let (mut rows, mut bytes) = (Vec::new(), Vec::new());
    for (name, file) in files {
        rows.push(Image { name, first: bytes.len() as u64, length: file.len() as u64 });
        bytes.extend_from_slice(file);
    }
    if !rows.is_empty() {
        builder.section(kind::IMAGES, NONE, size_of::<Image>() as u32, rows.as_bytes().to_vec())?;
        builder.section(kind::IMAGE_BYTES, NONE, 1, bytes)?;
    }
    Ok(())
}

/// The names of images in the bytes of a section of textures.
pub(crate) fn named_images(textures: &[u8]) -> BTreeSet<[u8; 16]> {
    let rows = textures.chunks_exact(size_of::<Texture>());
    rows.filter_map(|row| Texture::read_from_bytes(row).ok()).map(|texture| texture.image).collect()
}
