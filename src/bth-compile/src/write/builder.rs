//! Lays sections out behind header and table. The same sections give the same bytes in whatever
//! order they are added.

use super::{Bytes, DiskFile};
use crate::error::{Error, Result};
use bth_format::file::{content_id, hash128};
use bth_format::layout::*;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;
use zerocopy::IntoBytes;

/// Bytes that one task copies.
const COPIED_AT_ONCE: usize = 4 << 20;

/// Bytes of a section that is not copied in memory.
const LARGE: usize = 1 << 20;

/// Collects the sections of a file.
#[derive(Clone, Debug, Default)]
pub struct FileBuilder<'a> {
    /// Keyed by (object, kind), which is the order of the table.
    sections: BTreeMap<(u32, u32), Section<'a>>,
    /// Features that a reader needs for the objects.
    required_features: u64,
}

#[derive(Clone, Debug)]
struct Section<'a> {
    flags: u32,
    stride: u32,
    hash: [u8; 16],
    bytes: Bytes<'a>,
}

impl<'a> FileBuilder<'a> {
    /// A file without sections.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a section of elements of `stride` bytes; `object` is `NONE` for sections of the whole
    /// file. Sections that tracing reads or that describe the scene are flagged as required.
    ///
    /// # Errors
    /// `BTH-X031` when the bytes are not whole elements or the section exists already.
    pub fn section(
        &mut self,
        kind: u32,
        object: u32,
        stride: u32,
        bytes: impl Into<Cow<'a, [u8]>>,
    ) -> Result<&mut Self> {
        let bytes = bytes.into();
        if stride == 0 || !bytes.len().is_multiple_of(stride as usize) {
            return Err(defect(format!(
                "section {kind}: {} bytes are not whole elements of {stride}",
                bytes.len()
            )));
        }
        let hash = hash128(&bytes);
        let coordinates = coordinates_of(kind, &bytes);
        self.hashed_section(SectionHead { kind, object, stride, hash }, coordinates, Bytes::Owned(bytes))
    }

    /// Adds a section whose hash is known already, like [`Self::section`]. `coordinates` is this
    /// field of the row if it is an OBJECT section.
    ///
    /// # Errors
    /// The errors of [`Self::section`].
    pub(crate) fn hashed_section(
        &mut self,
        SectionHead { kind, object, stride, hash }: SectionHead,
        coordinates: Option<u32>,
        bytes: Bytes<'a>,
    ) -> Result<&mut Self> {
        let flags = if kind::is_required(kind) { SECTION_REQUIRED } else { 0 };
        self.required_features |= coordinates.map_or(0, features);
        let before = self.sections.insert((object, kind), Section { flags, stride, hash, bytes });
        match before {
            None => Ok(self),
            Some(_) => Err(defect(format!("section {kind} of object {object} twice"))),
        }
    }

    /// Adds sections of a file on disk. OBJECT sections only where no feature is needed for them.
    ///
    /// # Errors
    /// The errors of [`Self::section`].
    pub(crate) fn copied<'e>(
        &mut self,
        file: &Arc<DiskFile>,
        entries: impl IntoIterator<Item = &'e SectionEntry>,
    ) -> Result<()> {
        for &SectionEntry { kind, object, stride, hash, offset, length, .. } in entries {
            let bytes = Bytes::OnDisk(file.clone(), offset..offset + length);
            self.hashed_section(SectionHead { kind, object, stride, hash }, None, bytes)?;
        }
        Ok(())
    }

    /// Adds a section of structures; skips one without elements.
    ///
    /// # Errors
    /// The errors of [`Self::section`].
    pub fn rows<T: IntoBytes + zerocopy::Immutable>(
        &mut self,
        kind: u32,
        object: u32,
        rows: &'a [T],
    ) -> Result<&mut Self> {
        if rows.is_empty() {
            return Ok(self);
        }
        self.section(kind, object, size_of::<T>() as u32, rows.as_bytes())
    }

    /// Adds the provenance, UTF-8 JSON that is no part of the content id. No times, no paths.
    ///
    /// # Errors
    /// The errors of [`Self::section`].
    pub fn provenance(&mut self, json: String) -> Result<&mut Self> {
        self.section(kind::PROVENANCE, NONE, 1, json.into_bytes())
    }

    /// The content id of the file.
    pub fn content_id(&self) -> [u8; 32] {
        content_id(&self.entries())
    }

    /// Notes a feature that a reader needs.
    pub fn require(&mut self, feature: u64) {
        self.required_features |= feature;
    }

    /// Checks the number of sections.
    ///
    /// # Errors
    /// `BTH-L032` with more sections than the format allows.
    pub fn check_limits(&self) -> Result<()> {
        let (count, most) = (self.sections.len(), bth_format::limits::MAX_SECTIONS);
        if count <= most as usize {
            return Ok(());
        }
        let message = format!("the file has {count} sections; the format allows {most}");
        Err(Error::Limit { code: "BTH-L032", message })
    }

    /// Bytes of the file.
    pub fn file_length(&self) -> u64 {
        self.end(&self.entries())
    }

    /// The whole file in memory.
    pub fn finish(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(self.file_length() as usize);
        let take = &mut |piece: &[u8]| {
            bytes.extend_from_slice(piece);
            Ok(())
        };
        self.borrowed().write_to(take).expect("sections in memory can be read");
        bytes
    }

    /// Passes on the bytes of the file, in pieces. Sections on disk are read. Each section is
    /// dropped behind its bytes, so that a temporary file whose sections are all written takes no
    /// room any more.
    ///
    /// # Errors
    /// Errors of `take`, and of files that cannot be read again or have changed.
    pub(crate) fn write_to(self, take: &mut dyn FnMut(&[u8]) -> std::io::Result<()>) -> std::io::Result<()> {
        let entries = self.entries();
        take(self.header(&entries).as_bytes())?;
        take(entries.as_bytes())?;
        let mut end = self.table_end();
        for (entry, section) in in_place(&entries, self.sections.into_values()) {
            take(&[0; ALIGNMENT][..(entry.offset - end) as usize])?;
            section.bytes.read(section.hash, take)?;
            end = entry.offset + entry.length;
        }
        take(&[0; ALIGNMENT][..(end.next_multiple_of(ALIGNMENT as u64) - end) as usize])
    }

    /// The same sections, borrowed.
    pub(crate) fn borrowed(&self) -> FileBuilder<'_> {
        let sections = self.sections.iter().map(|(key, section)| {
            let &Section { flags, stride, hash, ref bytes } = section;
            (*key, Section { flags, stride, hash, bytes: bytes.borrowed() })
        });
        FileBuilder { sections: sections.collect(), required_features: self.required_features }
    }

    /// Writes header, table and sections on disk into as many zero bytes as the file has. Returns
    /// where which bytes of the sections in memory are to be copied.
    ///
    /// # Errors
    /// Errors of files that cannot be read again or have changed.
    pub(super) fn copies<'b>(
        &'b self,
        bytes: &'b mut [u8],
    ) -> std::io::Result<Vec<(&'b mut [u8], &'b [u8])>> {
        let entries = self.entries();
        let head = [self.header(&entries).as_bytes(), entries.as_bytes()].concat();
        let (front, mut rest) = bytes.split_at_mut(head.len());
        front.copy_from_slice(&head);
        let mut end = head.len();
        let mut copies = Vec::with_capacity(entries.len());
        for (entry, section) in in_place(&entries, self.sections.values()) {
            let (_, section_and_rest) = rest.split_at_mut(entry.offset as usize - end);
            let (to, behind) = section_and_rest.split_at_mut(entry.length as usize);
            match section.bytes.in_memory() {
                Some(from) => copies.extend(to.chunks_mut(COPIED_AT_ONCE).zip(from.chunks(COPIED_AT_ONCE))),
                None => {
                    let mut at = 0;
                    section.bytes.read(section.hash, &mut |piece| {
                        to[at..at + piece.len()].copy_from_slice(piece);
                        at += piece.len();
                        Ok(())
                    })?;
                }
            }
            rest = behind;
            end = (entry.offset + entry.length) as usize;
        }
        Ok(copies)
    }

    /// The name of the file's content: the hash of its header.
    pub(super) fn name(&self) -> bth_files::Digest {
        bth_files::Digest::of(self.header(&self.entries()).as_bytes())
    }

    /// Moves the bytes of large sections elsewhere, where `to` takes them.
    ///
    /// # Errors
    /// Errors of `to`.
    pub(crate) fn move_large(
        &mut self,
        to: &mut dyn FnMut(&[u8]) -> Result<Option<Bytes<'static>>>,
    ) -> Result<()> {
        for section in self.sections.values_mut() {
            if let Bytes::Owned(bytes) = &section.bytes
                && bytes.len() >= LARGE
                && let Some(moved) = to(bytes)?
            {
                section.bytes = moved;
            }
        }
        Ok(())
    }

    /// The same without borrows.
    pub fn into_static(self) -> FileBuilder<'static> {
        let Self { sections, required_features } = self;
        let owned = |(key, section): (_, Section<'_>)| {
            let Section { flags, stride, hash, bytes } = section;
            (key, Section { flags, stride, hash, bytes: bytes.into_static() })
        };
        FileBuilder { sections: sections.into_iter().map(owned).collect(), required_features }
    }

    fn header(&self, entries: &[SectionEntry]) -> Header {
        let mut header = Header {
            identifier: IDENTIFIER,
            writer_version: WRITER_VERSION,
            minimum_reader_version: MINIMUM_READER_VERSION,
            file_length: self.end(entries),
            section_offset: size_of::<Header>() as u64,
            section_count: entries.len() as u32,
            reserved: 0,
            required_features: self.required_features,
            optional_features: 0,
            content_id: content_id(entries),
            table_hash: hash128(entries.as_bytes()),
            header_hash: [0; 16],
        };
        header.header_hash = hash128(&header.as_bytes()[..std::mem::offset_of!(Header, header_hash)]);
        header
    }

    /// Bytes of a file with these entries.
    fn end(&self, entries: &[SectionEntry]) -> u64 {
        let end = entries.iter().map(|e| e.offset + e.length).fold(self.table_end(), u64::max);
        end.next_multiple_of(ALIGNMENT as u64)
    }

    fn table_end(&self) -> u64 {
        (size_of::<Header>() + self.sections.len() * size_of::<SectionEntry>()) as u64
    }

    fn entries(&self) -> Vec<SectionEntry> {
        // OBJECT sections come first, so that what a reader needs of many objects is in one place.
        let of_objects = self.sections.iter().filter(|((_, kind), _)| *kind == kind::OBJECT);
        let rounded = |bytes: u64| bytes.next_multiple_of(ALIGNMENT as u64);
        let mut first_end = self.table_end();
        let mut end = first_end + of_objects.map(|(_, section)| rounded(section.bytes.len())).sum::<u64>();
        let entry = |(&(object, kind), section): (&(u32, u32), &Section)| {
            let end = if kind == kind::OBJECT { &mut first_end } else { &mut end };
            let offset = end.next_multiple_of(ALIGNMENT as u64);
            let length = section.bytes.len();
            *end = offset + length;
            SectionEntry {
                kind,
                flags: section.flags,
                object,
                alignment: ALIGNMENT as u32,
                offset,
                length,
                stride: section.stride,
                reserved: 0,
                count: length / section.stride as u64,
                hash: section.hash,
            }
        };
        self.sections.iter().map(entry).collect()
    }
}

/// Sections with their entries, in the order in which they lie in the file.
fn in_place<S>(
    entries: &[SectionEntry],
    sections: impl Iterator<Item = S>,
) -> impl Iterator<Item = (&SectionEntry, S)> {
    let (first, others): (Vec<_>, Vec<_>) =
        entries.iter().zip(sections).partition(|(entry, _)| entry.kind == kind::OBJECT);
    first.into_iter().chain(others)
}

/// Table entry of a section whose bytes have been hashed before.
pub(crate) struct SectionHead {
    pub(crate) kind: u32,
    /// `NONE` for sections of the whole file.
    pub(crate) object: u32,
    pub(crate) stride: u32,
    pub(crate) hash: [u8; 16],
}

/// The field of that name, if this is an OBJECT section.
fn coordinates_of(kind: u32, bytes: &[u8]) -> Option<u32> {
    let at = std::mem::offset_of!(Object, coordinates);
    let bytes = bytes.get(at..at + 4).filter(|_| kind == kind::OBJECT)?;
    Some(u32::from_le_bytes(bytes.try_into().ok()?))
}

/// Features that a reader needs for such coordinates.
fn features(coordinates: u32) -> u64 {
    let grid = if coordinates & !WIDENED_BOXES != 0 { FEATURE_GRID } else { 0 };
    let widened = if coordinates & WIDENED_BOXES != 0 { FEATURE_WIDENED_BOXES } else { 0 };
    grid | widened
}

pub(super) fn defect(message: String) -> Error {
    Error::Internal { code: "BTH-X031", message }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_of_adding_does_not_matter_and_provenance_is_not_content() {
        let mut a = FileBuilder::new();
        a.section(100, 0, 1, b"abc".as_slice()).unwrap().section(99, 0, 4, b"defg".as_slice()).unwrap();
        let mut b = FileBuilder::new();
        b.section(99, 0, 4, b"defg".as_slice()).unwrap().section(100, 0, 1, b"abc".as_slice()).unwrap();
        assert_eq!(a.finish(), b.finish());
        let id = a.content_id();
        a.provenance("{}".into()).unwrap();
        assert_eq!(id, a.content_id());
        assert_ne!(a.finish(), b.finish());
    }

    #[test]
    fn a_temporary_file_is_gone_when_its_sections_are_written() {
        let mut builder = FileBuilder::new();
        let mut files = Vec::new();
        for (kind, byte) in [(100, b'a'), (101, b'b')] {
            let file = Arc::new(DiskFile::open("temporary".as_ref(), tempfile::tempfile().unwrap()));
            let range = file.append(&[byte; 100]).unwrap();
            let head = SectionHead { kind, object: 0, stride: 1, hash: hash128(&[byte; 100]) };
            files.push(Arc::downgrade(&file));
            builder.hashed_section(head, None, Bytes::OnDisk(file, range)).unwrap();
        }
        let (whole, mut written) = (builder.finish(), Vec::new());
        let take = &mut |piece: &[u8]| {
            let left = [0, 1].map(|file: usize| files[file].strong_count() > 0);
            assert!(!piece.starts_with(b"a") || left == [true, true]);
            assert!(!piece.starts_with(b"b") || left == [false, true]);
            written.extend_from_slice(piece);
            Ok(())
        };
        builder.write_to(take).unwrap();
        assert_eq!(written, whole);
    }

    #[test]
    fn a_section_of_unassigned_kind_0_stays_optional() {
        let mut builder = FileBuilder::new();
        builder.section(0, NONE, 1, b"a".as_slice()).unwrap();
        assert_eq!(bth_format::File::from_bytes(&builder.finish()).unwrap().table()[0].flags, 0);
    }

    #[test]
    fn file_without_sections_opens() {
        let bytes = FileBuilder::new().finish();
        assert_eq!(bytes.len(), 128);
        assert_eq!(bth_format::File::from_bytes(&bytes).unwrap().object_count(), 0);
    }

    #[test]
    fn partial_elements_and_repeated_sections_are_refused() {
        assert!(FileBuilder::new().section(1, 0, 4, vec![0; 6]).is_err());
        let mut twice = FileBuilder::new();
        twice.section(1, 0, 4, vec![0; 4]).unwrap();
        assert!(twice.section(1, 0, 4, vec![0; 4]).is_err());
    }
}
