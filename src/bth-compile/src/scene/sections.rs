//! The sections of a scene's objects in memory or in the previous file, before they are added to
//! the new file.

use super::file_index::{Hash, SectionRow};
use super::previous::Previous;
use crate::error::{Error, Result};
use crate::tets::WorkerStatus;
use crate::write::{Bytes, FileBuilder, SectionHead, named_images};
use bth_format::file::{hash128, kind_stride};
use bth_format::layout::{Deformation, Object, kind};
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::sync::Arc;
use zerocopy::FromBytes;

/// Hash by which equal objects are found, and status of the worker.
pub(super) type Made = (Hash, Option<WorkerStatus>);

/// The sections of an object. Every index in them has been checked.
#[derive(Clone)]
pub(super) struct ObjectSections {
    /// Its OBJECT row.
    pub(super) row: Object,
    /// Absent for objects copied from compiled files, which are not trusted.
    pub(super) made: Option<Made>,
    sections: Vec<ObjectSection>,
}

#[derive(Clone)]
struct ObjectSection {
    kind: u32,
    stride: u32,
    hash: [u8; 16],
    bytes: Bytes<'static>,
}

impl ObjectSections {
    /// An object of a file in memory. Skips sections of unknown kinds, because their meaning could
    /// depend on other parts of the file. The hashes of an object that is not trusted are computed
    /// again.
    pub(super) fn in_file(file: &Arc<bth_format::File>, object: u32, made: Option<Made>) -> Self {
        let sections = file.sections().filter(|s| s.entry.object == object);
        let sections = sections.filter(|s| kind_stride(s.entry.kind).is_some()).map(|section| {
            let e = section.entry;
            let range = e.offset as usize..(e.offset + e.length) as usize;
            ObjectSection {
                kind: e.kind,
                stride: e.stride,
                hash: if made.is_some() { e.hash } else { hash128(section.bytes) },
                bytes: Bytes::InFile(file.clone(), range),
            }
        });
        let sections = sections.collect();
        Self { row: *file.object_header(object), made, sections }
    }

    /// An object of the previous file.
    pub(super) fn in_previous(previous: &Previous, object: u32) -> Self {
        let index = &previous.index;
        let row = &index.objects[object as usize];
        let section = |row: &SectionRow| ObjectSection {
            kind: row.kind,
            stride: row.stride,
            hash: row.hash,
            bytes: previous.bytes(row),
        };
        Self {
            row: row.object,
            made: Some((row.content, index.worker_of(object).clone())),
            sections: index.sections_of(object).iter().map(section).collect(),
        }
    }

    /// Adds its sections.
    pub(super) fn write(&self, number: u32, builder: &mut FileBuilder<'_>) -> Result<()> {
        for ObjectSection { kind, stride, hash, bytes } in &self.sections {
            let head = SectionHead { kind: *kind, object: number, stride: *stride, hash: *hash };
            let coordinates = (*kind == kind::OBJECT).then_some(self.row.coordinates);
            builder.hashed_section(head, coordinates, bytes.clone())?;
        }
        Ok(())
    }

    /// The bytes of a section; none if the object lacks it.
    ///
    /// # Errors
    /// `BTH-O001` when the previous file cannot be read.
    fn bytes(&self, kind: u32) -> Result<Cow<'_, [u8]>> {
        let section = self.sections.iter().find(|section| section.kind == kind);
        let bytes = section.map_or(Ok(Cow::default()), |section| section.bytes.read());
        bytes.map_err(|e| Error::File {
            code: "BTH-O001",
            path: "the file that was there".into(),
            message: format!("cannot read: {e}"),
        })
    }

    /// Names of the images that its textures refer to.
    ///
    /// # Errors
    /// When the previous file cannot be read.
    pub(super) fn image_names(&self) -> Result<BTreeSet<[u8; 16]>> {
        Ok(named_images(&self.bytes(kind::TEXTURES)?))
    }

    /// Its DEFORMATION row, if its vertices can be moved.
    ///
    /// # Errors
    /// When the previous file cannot be read.
    pub(super) fn deformation(&self) -> Result<Option<Deformation>> {
        Ok(Deformation::read_from_bytes(&self.bytes(kind::DEFORMATION)?).ok())
    }

    /// Bytes of the sections that tracing reads.
    pub(super) fn resident_bytes(&self) -> u64 {
        let traced = self.sections.iter().filter(|section| kind::is_traced(section.kind));
        traced.map(|section| section.bytes.length()).sum()
    }
}
