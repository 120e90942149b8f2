//! The sections of a scene's objects before they are added to the file.

use crate::error::Result;
use crate::write::{Bytes, FileBuilder, SectionHead, named_images};
use bth_format::file::{hash128, kind_stride};
use bth_format::layout::{Deformation, Object, kind};
use std::collections::BTreeSet;
use std::sync::Arc;
use zerocopy::{FromBytes, Immutable, IntoBytes};

/// The sections of an object. Every index in them has been checked.
#[derive(Clone)]
pub(super) struct ObjectSections {
    /// Its OBJECT row.
    pub(super) row: Object,
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
    /// depend on other parts of the file. `trusted` takes the hashes of the section table;
    /// otherwise they are computed.
    pub(super) fn in_file(file: &Arc<bth_format::File>, object: u32, trusted: bool) -> Self {
        let sections = file.sections().filter(|s| s.entry.object == object);
        let sections = sections.filter(|s| kind_stride(s.entry.kind).is_some()).map(|section| {
            let e = section.entry;
            let range = e.offset as usize..(e.offset + e.length) as usize;
            ObjectSection {
                kind: e.kind,
                stride: e.stride,
                hash: if trusted { e.hash } else { hash128(section.bytes) },
                bytes: Bytes::InFile(file.clone(), range),
            }
        });
        let sections = sections.collect();
        Self { row: *file.object_header(object), sections }
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

    /// Puts rows in the place of a section; without rows the object has none.
    pub(super) fn replace<T: IntoBytes + Immutable>(&mut self, kind: u32, rows: &[T]) {
        self.sections.retain(|section| section.kind != kind);
        if !rows.is_empty() {
            let (stride, bytes) = (size_of::<T>() as u32, rows.as_bytes().to_vec());
            let hash = hash128(&bytes);
            self.sections.push(ObjectSection { kind, stride, hash, bytes: Bytes::Owned(bytes.into()) });
        }
    }

    /// The bytes of a section; none if the object lacks it.
    pub(super) fn bytes(&self, kind: u32) -> &[u8] {
        self.sections.iter().find(|section| section.kind == kind).map_or(&[], |section| &section.bytes)
    }

    /// Names of the images that its textures refer to.
    pub(super) fn image_names(&self) -> BTreeSet<[u8; 16]> {
        named_images(self.bytes(kind::TEXTURES))
    }

    /// Its DEFORMATION row, if its vertices can be moved.
    pub(super) fn deformation(&self) -> Option<Deformation> {
        Deformation::read_from_bytes(self.bytes(kind::DEFORMATION)).ok()
    }

    /// Bytes of the sections that tracing reads.
    pub(super) fn resident_bytes(&self) -> u64 {
        let traced = self.sections.iter().filter(|section| kind::is_traced(section.kind));
        traced.map(|section| section.bytes.len() as u64).sum()
    }
}
