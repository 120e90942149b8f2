//! An object of a scene as it goes into the file: where its sections are.

use super::outline::Hash;
use super::previous::Previous;
use crate::error::Result;
use crate::tets;
use crate::write::{Bytes, FileBuilder, Known};
use bth_format::layout::{self, SectionEntry, kind};
use std::sync::Arc;
use zerocopy::FromBytes;

/// The sections of an object, every index of which has been checked.
pub(super) enum Stored {
    /// In a file that was read.
    Read {
        file: Arc<bth_format::File>,
        object: u32,
        /// What is known of it, unless it was copied from a file of the user: then the hashes of the sections are not known to
        /// be right, either.
        made: Option<(blake3::Hash, Option<tets::WorkerStatus>)>,
    },
    /// In the file that was there.
    Old { file: Arc<Previous>, object: u32 },
}

impl Stored {
    /// Its sections in a file that was read; kinds that we do not know may mean what we would break.
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
            Self::Read { file, object, made } => {
                for section in Self::sections(file, *object) {
                    let e = section.entry;
                    let hash = if made.is_some() { e.hash } else { bth_format::file::hash128(section.bytes) };
                    let known = Known { kind: e.kind, object: number, stride: e.stride, hash };
                    let range = e.offset as usize..(e.offset + e.length) as usize;
                    builder.known_section(known, self.coordinates(e.kind), Bytes::In(file.clone(), range))?;
                }
            }
            Self::Old { file, object } => {
                for row in file.outline.sections_of(*object) {
                    let known = Known { kind: row.kind, object: number, stride: row.stride, hash: row.hash };
                    builder.known_section(known, self.coordinates(row.kind), file.bytes(row))?;
                }
            }
        }
        Ok(())
    }

    /// Its OBJECT row.
    pub(super) fn row(&self) -> Option<layout::Object> {
        match self {
            Self::Read { file, object, .. } => {
                layout::Object::read_from_bytes(file.section(*object, kind::OBJECT)?.bytes).ok()
            }
            Self::Old { file, object } => Some(file.outline.objects[*object as usize].object),
        }
    }

    fn coordinates(&self, kind: u32) -> Option<u32> {
        (kind == kind::OBJECT).then(|| self.row().map(|row| row.coordinates)).flatten()
    }

    /// What makes it equal to others, and what became of the worker.
    pub(super) fn made(&self) -> Option<(Hash, &Option<tets::WorkerStatus>)> {
        match self {
            Self::Read { made, .. } => made.as_ref().map(|(content, worker)| (*content.as_bytes(), worker)),
            Self::Old { file, object } => {
                Some((file.outline.objects[*object as usize].content, file.outline.worker_of(*object)))
            }
        }
    }

    /// Bytes of those that tracing reads.
    pub(super) fn resident_bytes(&self) -> u64 {
        let resident = |kind: u32, length: u64| if kind <= kind::TRIANGLE_FACES { length } else { 0 };
        match self {
            Self::Read { file, object, .. } => {
                Self::sections(file, *object).map(|s| resident(s.entry.kind, s.entry.length)).sum()
            }
            Self::Old { file, object } => {
                file.outline.sections_of(*object).iter().map(|s| resident(s.kind, s.length)).sum()
            }
        }
    }
}
