//! The file that an earlier compilation of a scene left where this one will write: its objects need not be read from the
//! cache nor written from memory.

use super::compile::Context;
use super::outline::{Outline, SectionRow};
use crate::cached;
use crate::write::{Bytes, HEADER, are_zeros, name};
use bth_cache::{Digest, Opened};
use bth_format::file::hash128;
use std::path::Path;
use std::sync::Arc;

/// An earlier file with its outline.
pub(super) struct Previous {
    pub(super) outline: Outline,
    file: Arc<Opened>,
    /// Whether it is known that nobody has touched the file since it was written. Else each section is read and checked.
    untouched: bool,
}

impl Previous {
    /// The file at a path, if the cache knows how it came about and if it was made with the same options.
    pub(super) fn open(path: &Path, context: &Context<'_>) -> Option<Self> {
        let store = context.cache.store()?;
        let file = Opened::open(path).ok()?;
        let mut head = [0; HEADER];
        file.read_at(0, &mut head).ok()?;
        let named = name(&head);
        let key = key(&named, context)?;
        let record = context.cache.find(&key, context.monitor)?;
        let outline = cached::decode(&context.cache.read(&record, context.monitor)?)?;
        let untouched = store.stamped_opened(path, &file) == Some(named);
        Some(Self { outline, file: Arc::new(file), untouched })
    }

    /// Whether an object of the outline is whole in the file.
    pub(super) fn has(&self, object: u32) -> bool {
        let sections = self.outline.sections_of(object);
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

    /// Where the bytes of a section are.
    pub(super) fn bytes(&self, section: &SectionRow) -> Bytes<'static> {
        Bytes::Old(self.file.clone(), section.offset..section.offset + section.length)
    }
}

/// Keeps the outline of a file under its name.
pub(super) fn keep_outline(named: &Digest, outline: &Outline, context: &Context<'_>) {
    if let Some(key) = key(named, context) {
        context.cache.keep_here(&key, &cached::encode(outline), context.monitor);
    }
}

fn key(named: &Digest, context: &Context<'_>) -> Option<bth_cache::Key> {
    Some(cached::outline(named, context.options, context.tetgen.as_ref()?))
}
