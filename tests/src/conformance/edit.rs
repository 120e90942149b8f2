//! Changes bytes of a valid file and recomputes its hashes, so that exactly one rule is broken.

use bth_format::file::{content_id, hash128};
use bth_format::layout::*;
use std::mem::offset_of;
use zerocopy::{FromBytes, IntoBytes};

/// Which hashes are recomputed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seal {
    /// Nothing.
    None,
    /// The header's hash.
    Header,
    /// The hashes of the table and the header, and the content id.
    Table,
    /// All hashes.
    Sections,
}

/// A file under change.
#[derive(Clone, Debug)]
pub struct Editor {
    /// The whole file.
    pub bytes: Vec<u8>,
}

impl Editor {
    /// Starts from a valid file.
    pub fn new(bytes: &[u8]) -> Self {
        Self { bytes: bytes.to_vec() }
    }
    /// The header of the file.
    pub fn header(&self) -> Header {
        Header::read_from_prefix(&self.bytes).expect("a whole header").0
    }
    /// The entries of the section table that lie within the file.
    pub fn entries(&self) -> Vec<SectionEntry> {
        let count = self.header().section_count as usize;
        self.bytes[128..]
            .chunks_exact(64)
            .take(count)
            .map(|b| SectionEntry::read_from_bytes(b).unwrap())
            .collect()
    }
    /// Byte of the file where the table entry of a section starts.
    pub fn entry_at(&self, object: u32, kind: u32) -> usize {
        let found = self.entries().iter().position(|e| (e.object, e.kind) == (object, kind));
        128 + 64 * found.unwrap_or_else(|| panic!("no section {kind} of object {object}"))
    }
    /// Byte of the file where a section of object 0 starts.
    pub fn section_at(&self, kind: u32) -> usize {
        let at = self.entry_at(0, kind) + offset_of!(SectionEntry, offset);
        u64::from_le_bytes(self.bytes[at..at + 8].try_into().unwrap()) as usize
    }
    /// Overwrites bytes of the file.
    pub fn put(&mut self, at: usize, value: &[u8]) -> &mut Self {
        self.bytes[at..at + value.len()].copy_from_slice(value);
        self
    }
    /// Overwrites a number in a section of object 0.
    pub fn put_u32(&mut self, kind: u32, at: usize, value: u32) -> &mut Self {
        self.put(self.section_at(kind) + at, &value.to_le_bytes())
    }
    /// A 64-bit number at a byte of the file.
    pub fn bytes_at(&self, at: usize) -> usize {
        u64::from_le_bytes(self.bytes[at..at + 8].try_into().unwrap()) as usize
    }
    /// Overwrites a number in a section of object 0.
    pub fn put_f32(&mut self, kind: u32, at: usize, value: f32) -> &mut Self {
        self.put_u32(kind, at, value.to_bits())
    }
    /// Reads a number of a section of object 0.
    pub fn get_u32(&self, kind: u32, at: usize) -> u32 {
        let at = self.section_at(kind) + at;
        u32::from_le_bytes(self.bytes[at..at + 4].try_into().unwrap())
    }
    /// Recomputes hashes; entries of sections beyond the end of the file keep theirs.
    pub fn seal(&mut self, seal: Seal) -> Vec<u8> {
        if seal == Seal::Sections {
            for (i, e) in self.entries().iter().enumerate() {
                let end = e.offset.saturating_add(e.length);
                if end <= self.bytes.len() as u64 && e.offset <= end {
                    let hash = hash128(&self.bytes[e.offset as usize..end as usize]);
                    self.put(128 + 64 * i + offset_of!(SectionEntry, hash), &hash);
                }
            }
        }
        if matches!(seal, Seal::Table | Seal::Sections) {
            let entries = self.entries();
            self.put(offset_of!(Header, content_id), &content_id(&entries));
            self.put(offset_of!(Header, table_hash), &hash128(entries.as_bytes()));
        }
        if seal != Seal::None {
            let at = offset_of!(Header, header_hash);
            let hash = hash128(&self.bytes[..at]);
            self.put(at, &hash);
        }
        self.bytes.clone()
    }
}
