//! The sections of a scene's objects before they are added to the file.

use crate::error::Result;
use crate::write::{Bytes, DiskFile, FileBuilder, SectionHead, assembled, named_images};
use bth_format::file::{hash128, kind_stride};
use bth_format::layout::{Deformation, Object, SectionEntry, kind};
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

/// Sections that are read again while a scene is compiled.
const IN_MEMORY: [u32; 4] = [kind::OBJECT, kind::GROUPS, kind::TEXTURES, kind::DEFORMATION];

impl ObjectSections {
    /// The first object of a file in memory, whose hashes are right.
    pub(super) fn in_file(file: bth_format::File) -> Self {
        let file = &Arc::new(file);
        let bytes =
            |e: &SectionEntry| Bytes::InFile(file.clone(), e.offset as usize..(e.offset + e.length) as usize);
        Self { row: *file.object_header(0), sections: sections(file.table(), 0, bytes) }
    }

    /// An object of a file on disk, with its table. Checks the hashes of the sections that are read
    /// here. The other sections are checked when they are read.
    ///
    /// # Errors
    /// The file cannot be read, or is damaged.
    pub(super) fn on_disk(
        file: &Arc<DiskFile>,
        table: &[SectionEntry],
        object: u32,
    ) -> std::io::Result<Self> {
        let bytes = |e: &SectionEntry| Bytes::OnDisk(file.clone(), e.offset..e.offset + e.length);
        let mut sections = sections(table, object, bytes);
        let mut row = None;
        for section in sections.iter_mut().filter(|section| IN_MEMORY.contains(&section.kind)) {
            let mut bytes = Vec::new();
            section.bytes.read(section.hash, &mut |piece| {
                bytes.extend_from_slice(piece);
                Ok(())
            })?;
            if section.kind == kind::OBJECT {
                row = Object::read_from_bytes(&bytes).ok();
            }
            section.bytes = Bytes::Owned(bytes.into());
        }
        let row = row.ok_or_else(|| std::io::Error::other("the object has no row"))?;
        Ok(Self { row, sections })
    }

    /// Bytes of all sections.
    pub(super) fn bytes_in_all(&self) -> u64 {
        self.sections.iter().map(|section| section.bytes.len()).sum()
    }

    /// Moves the bytes of sections elsewhere, but for those that are read again.
    ///
    /// # Errors
    /// Errors of `to`.
    pub(super) fn move_to(&mut self, to: &mut dyn FnMut(&[u8]) -> Result<Bytes<'static>>) -> Result<()> {
        for section in &mut self.sections {
            let Some(bytes) = section.bytes.in_memory() else { continue };
            section.bytes = match IN_MEMORY.contains(&section.kind) {
                true => Bytes::Owned(bytes.to_vec().into()),
                false => to(bytes)?,
            };
        }
        Ok(())
    }

    /// A file with this object only. Its header and table have been checked.
    ///
    /// # Errors
    /// The errors of [`assembled`].
    pub(super) fn file(&self) -> Result<bth_format::File> {
        let mut builder = FileBuilder::new();
        self.write(0, &mut builder)?;
        assembled(&builder)
    }

    /// A hash of the contents of all sections.
    pub(super) fn content(&self) -> blake3::Hash {
        let mut hasher = blake3::Hasher::new();
        hasher.update(b"compiled");
        for ObjectSection { kind, stride, hash, .. } in &self.sections {
            hasher.update(&kind.to_le_bytes()).update(&stride.to_le_bytes()).update(hash);
        }
        hasher.finalize()
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

    /// The bytes of a section that is in memory; none if the object lacks it.
    pub(super) fn bytes(&self, kind: u32) -> &[u8] {
        self.sections
            .iter()
            .find(|section| section.kind == kind)
            .and_then(|section| section.bytes.in_memory())
            .unwrap_or_default()
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
        traced.map(|section| section.bytes.len()).sum()
    }
}

/// The sections of an object in a table. Skips unknown kinds, because their meaning could
/// depend on other parts of the file.
fn sections(
    table: &[SectionEntry],
    object: u32,
    bytes: impl Fn(&SectionEntry) -> Bytes<'static>,
) -> Vec<ObjectSection> {
    let first = table.partition_point(|e| e.object < object);
    let sections = table[first..].iter().take_while(|e| e.object == object);
    let known = sections.filter(|e| kind_stride(e.kind).is_some());
    known.map(|e| ObjectSection { kind: e.kind, stride: e.stride, hash: e.hash, bytes: bytes(e) }).collect()
}
