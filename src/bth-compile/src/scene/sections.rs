//! The sections of a scene's objects in memory or in the previous file, before they are added to the new file.

use super::file_index::Hash;
use super::previous::Previous;
use crate::error::Result;
use crate::tets;
use crate::write::{Bytes, FileBuilder, SectionHead, named_images};
use bth_format::layout::{self, SectionEntry, kind};
use std::collections::BTreeSet;
use std::sync::Arc;
use zerocopy::FromBytes;

/// The sections of an object, of which every index has been checked.
#[derive(Clone)]
pub(super) enum ObjectSections {
    /// In a file in memory.
    InFile {
        file: Arc<bth_format::File>,
        object: u32,
        /// Hash by which equal objects are found and status of the worker. Absent for objects copied from compiled files,
        /// which are untrusted, so that the hashes of their sections are computed again.
        made: Option<(blake3::Hash, Option<tets::WorkerStatus>)>,
    },
    /// In the previous file.
    InPrevious { file: Arc<Previous>, object: u32 },
}

impl ObjectSections {
    /// Its sections in a file in memory. Sections of unknown kinds are left out, because their meaning could depend on
    /// other parts of the file.
    fn sections(
        file: &bth_format::File,
        object: u32,
    ) -> impl Iterator<Item = bth_format::file::SectionView<'_>> {
        let known = |e: &SectionEntry| bth_format::file::kind_stride(e.kind).is_some();
        file.sections().filter(move |s| s.entry.object == object && known(s.entry))
    }

    /// Adds its sections.
    pub(super) fn write(&self, number: u32, builder: &mut FileBuilder<'_>) -> Result<()> {
        match self {
            Self::InFile { file, object, made } => {
                for section in Self::sections(file, *object) {
                    let e = section.entry;
                    let hash = if made.is_some() { e.hash } else { bth_format::file::hash128(section.bytes) };
                    let head = SectionHead { kind: e.kind, object: number, stride: e.stride, hash };
                    let range = e.offset as usize..(e.offset + e.length) as usize;
                    builder.hashed_section(
                        head,
                        self.coordinates(e.kind),
                        Bytes::InFile(file.clone(), range),
                    )?;
                }
            }
            Self::InPrevious { file, object } => {
                for row in file.index.sections_of(*object) {
                    let head =
                        SectionHead { kind: row.kind, object: number, stride: row.stride, hash: row.hash };
                    builder.hashed_section(head, self.coordinates(row.kind), file.bytes(row))?;
                }
            }
        }
        Ok(())
    }

    /// Names of the images that its textures refer to.
    ///
    /// # Errors
    /// When the previous file cannot be read.
    pub(super) fn image_names(&self) -> Result<BTreeSet<[u8; 16]>> {
        match self {
            Self::InFile { file, object, .. } => {
                Ok(file.materials(*object).textures.iter().map(|texture| texture.image).collect())
            }
            Self::InPrevious { file, object } => {
                let rows = file.index.sections_of(*object);
                let bytes = rows.iter().find(|row| row.kind == kind::TEXTURES).map(|row| file.read(row));
                Ok(named_images(&bytes.transpose()?.unwrap_or_default()))
            }
        }
    }

    /// Its OBJECT row.
    pub(super) fn row(&self) -> Option<layout::Object> {
        match self {
            Self::InFile { file, object, .. } => {
                layout::Object::read_from_bytes(file.section(*object, kind::OBJECT)?.bytes).ok()
            }
            Self::InPrevious { file, object } => Some(file.index.objects[*object as usize].object),
        }
    }

    /// Its DEFORMATION row, if its vertices can be moved.
    ///
    /// # Errors
    /// When the previous file cannot be read.
    pub(super) fn deformation(&self) -> Result<Option<layout::Deformation>> {
        match self {
            Self::InFile { file, object, .. } => Ok(file.deformation(*object).rows.first().copied()),
            Self::InPrevious { file, object } => {
                let rows = file.index.sections_of(*object);
                let bytes = rows.iter().find(|row| row.kind == kind::DEFORMATION).map(|row| file.read(row));
                Ok(bytes.transpose()?.and_then(|bytes| layout::Deformation::read_from_bytes(&bytes).ok()))
            }
        }
    }

    fn coordinates(&self, kind: u32) -> Option<u32> {
        (kind == kind::OBJECT).then(|| self.row().map(|row| row.coordinates)).flatten()
    }

    /// Hash by which equal objects are found, and the status of the worker.
    pub(super) fn made(&self) -> Option<(Hash, &Option<tets::WorkerStatus>)> {
        match self {
            Self::InFile { made, .. } => made.as_ref().map(|(content, worker)| (*content.as_bytes(), worker)),
            Self::InPrevious { file, object } => {
                Some((file.index.objects[*object as usize].content, file.index.worker_of(*object)))
            }
        }
    }

    /// Bytes of the sections that tracing reads.
    pub(super) fn resident_bytes(&self) -> u64 {
        let resident = |kind: u32, length: u64| if kind::is_traced(kind) { length } else { 0 };
        match self {
            Self::InFile { file, object, .. } => {
                Self::sections(file, *object).map(|s| resident(s.entry.kind, s.entry.length)).sum()
            }
            Self::InPrevious { file, object } => {
                file.index.sections_of(*object).iter().map(|s| resident(s.kind, s.length)).sum()
            }
        }
    }
}
