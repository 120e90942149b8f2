//! The file of an earlier compilation of a scene at the path of this one's output. Its unchanged
//! objects are copied by the operating system, without being read from the cache or written from
//! memory.

use super::file_index::{FileIndex, SectionRow};
use crate::cached::{self, Cache};
use crate::monitor::Monitor;
use crate::options::CompileOptions;
use crate::pipeline;
use crate::write::{Bytes, HEADER, are_zeros, name};
use bth_files::OpenFile;
use bth_format::file::hash128;
use std::path::Path;
use std::sync::Arc;

/// An earlier file with its index.
pub(super) struct Previous {
    pub(super) index: FileIndex,
    file: Arc<OpenFile>,
    /// True if the file is known to be unchanged since it was written; else each section is read
    /// and checked.
    untouched: bool,
}

impl Previous {
    /// The file at a path, if the cache has its index and it was made with the same options.
    pub(super) fn open(
        path: &Path,
        options: &CompileOptions,
        tetgen: &str,
        cache: &Cache<'_>,
        monitor: &dyn Monitor,
    ) -> Option<Self> {
        let store = cache.store()?;
        let file = OpenFile::open(path).ok()?;
        let mut head = [0; HEADER];
        file.read_at(0, &mut head).ok()?;
        let named = name(&head);
        let record = cache.find(&pipeline::file_index(&named, options, tetgen), monitor)?;
        let index = cached::decode(&cache.read(&record, monitor)?)?;
        let untouched = store.content_of_open(path, &file) == Some(named);
        Some(Self { index, file: Arc::new(file), untouched })
    }

    /// Returns true if an object of the index is whole in the file.
    pub(super) fn has(&self, object: u32) -> bool {
        let sections = self.index.sections_of(object);
        let (Some(first), Some(last)) = (sections.first(), sections.last()) else { return false };
        let (start, end) = (first.offset, last.offset.saturating_add(last.length));
        if end > self.file.length() {
            return false;
        }
        self.untouched || self.check(sections, start, end)
    }

    /// Reads the sections of an object and compares their hashes.
    fn check(&self, sections: &[SectionRow], start: u64, end: u64) -> bool {
        let mut bytes = vec![0; (end - start) as usize];
        if self.file.read_at(start, &mut bytes).is_err() {
            return false;
        }
        let mut at = 0;
        sections.iter().all(|section| {
            let first = (section.offset - start) as usize;
            let last = first + section.length as usize;
            let whole = are_zeros(&bytes[at..first]) && hash128(&bytes[first..last]) == section.hash;
            at = last;
            whole
        })
    }

    /// Range of a section's bytes in the file.
    pub(super) fn bytes(&self, section: &SectionRow) -> Bytes<'static> {
        Bytes::OnDisk(self.file.clone(), section.offset..section.offset + section.length)
    }
}
