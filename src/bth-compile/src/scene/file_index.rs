//! The index of a scene file: its objects, their sections, and the hashes of the sources of each.
//! By it the next compilation copies unchanged objects from the file.

use super::report::ObjectReport;
use crate::cached::{Codec, RowReader, Sink};
use crate::tets::WorkerStatus;
use bth_format::layout as on_disk;
use bth_format::layout::ALIGNMENT;
use std::collections::{BTreeMap, HashMap};
use zerocopy::{FromBytes, Immutable, IntoBytes};

/// BLAKE3 of an object's content, or of the identity of a part of a source.
pub(super) type Hash = [u8; 32];

/// An object of the file.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, Immutable)]
#[repr(C)]
pub(super) struct ObjectRow {
    /// Hash by which equal objects are found.
    pub(super) content: Hash,
    pub(super) triangles: u64,
    pub(super) degenerate: u64,
    pub(super) tet_leaves: u64,
    pub(super) tet_triangles: u64,
    /// Its OBJECT row.
    pub(super) object: on_disk::Object,
    /// First row of its sections in the index.
    pub(super) first: u32,
    pub(super) sections: u32,
    /// Row of the workers.
    pub(super) worker: u32,
    pub(super) reserved: u32,
}

/// A section of an object.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, Immutable)]
#[repr(C)]
pub(super) struct SectionRow {
    pub(super) kind: u32,
    pub(super) stride: u32,
    /// Offset and length in the file, bytes.
    pub(super) offset: u64,
    pub(super) length: u64,
    pub(super) hash: [u8; 16],
}

/// A part of a source from which an object was made.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, Immutable)]
#[repr(C)]
pub(super) struct PartRow {
    /// Hash that identifies the part.
    pub(super) part: Hash,
    /// Row of the objects.
    pub(super) object: u32,
    /// Row of the formats.
    pub(super) format: u32,
}

/// The index of a scene file.
#[derive(Clone, Debug, Default)]
pub(super) struct FileIndex {
    pub(super) objects: Vec<ObjectRow>,
    pub(super) sections: Vec<SectionRow>,
    pub(super) parts: Vec<PartRow>,
    /// Formats of sources.
    pub(super) formats: Vec<String>,
    /// Statuses of the worker; objects that needed no worker refer to `None`.
    pub(super) workers: Vec<Option<WorkerStatus>>,
    /// What was warned of while parts were read, by their rows; most have nothing.
    pub(super) warnings: BTreeMap<u32, Vec<String>>,
    by_content: HashMap<Hash, u32>,
    by_part: HashMap<Hash, u32>,
}

impl FileIndex {
    /// The row of a value in a list; the value is added if the list does not have it.
    pub(super) fn row_of<T: PartialEq + Clone>(words: &mut Vec<T>, word: &T) -> u32 {
        let there = words.iter().position(|known| known == word);
        there.unwrap_or_else(|| {
            words.push(word.clone());
            words.len() - 1
        }) as u32
    }

    /// The object of this content.
    pub(super) fn object_of(&self, content: &Hash) -> Option<u32> {
        self.by_content.get(content).copied()
    }

    /// The row of a part of a source, and what was warned of while it was read.
    pub(super) fn part(&self, part: &Hash) -> Option<(&PartRow, &[String])> {
        let row = *self.by_part.get(part)?;
        Some((self.parts.get(row as usize)?, self.warnings.get(&row).map_or(&[], Vec::as_slice)))
    }

    /// The sections of an object.
    pub(super) fn sections_of(&self, object: u32) -> &[SectionRow] {
        let row = &self.objects[object as usize];
        &self.sections[row.first as usize..][..row.sections as usize]
    }

    /// Status of the worker for an object.
    pub(super) fn worker_of(&self, object: u32) -> &Option<WorkerStatus> {
        &self.workers[self.objects[object as usize].worker as usize]
    }

    /// The report on an object.
    pub(super) fn report_of(&self, object: u32) -> ObjectReport {
        let row = &self.objects[object as usize];
        ObjectReport {
            triangles: row.triangles,
            degenerate: row.degenerate,
            tet_leaves: row.tet_leaves,
            tet_triangles: row.tet_triangles,
            ..ObjectReport::default()
        }
    }

    /// Returns true if all rows are in range and each object's sections follow each other.
    fn is_valid(&self) -> bool {
        let sections = |row: &ObjectRow| {
            let end = row.first.checked_add(row.sections)?;
            let sections = self.sections.get(row.first as usize..end as usize)?;
            let object = sections.first().is_some_and(|s| s.kind == on_disk::kind::OBJECT);
            let follows = |pair: &[SectionRow]| {
                let end = pair[0].offset.checked_add(pair[0].length)?;
                Some(end.checked_next_multiple_of(ALIGNMENT as u64)? == pair[1].offset)
            };
            Some(object && sections.windows(2).all(|pair| follows(pair) == Some(true)))
        };
        let object =
            |row: &ObjectRow| (row.worker as usize) < self.workers.len() && sections(row).unwrap_or(false);
        let part = |row: &PartRow| {
            (row.object as usize) < self.objects.len() && (row.format as usize) < self.formats.len()
        };
        self.objects.iter().all(object) && self.parts.iter().all(part)
    }
}

impl Codec for FileIndex {
    fn write(&self, to: &mut impl Sink) {
        to.add(&self.objects);
        to.add(&self.sections);
        to.add(&self.parts);
        // Names, statuses and warnings can always be expressed in JSON.
        let words = (&self.formats, &self.workers, &self.warnings);
        to.add(&serde_json::to_vec(&words).unwrap_or_default());
    }

    fn read(from: &mut RowReader<'_>) -> Option<Self> {
        let (objects, sections, parts) = (from.take()?, from.take()?, from.take()?);
        let words: Vec<u8> = from.take()?;
        let (formats, workers, warnings) = serde_json::from_slice(&words).ok()?;
        let mut index = Self { objects, sections, parts, formats, workers, warnings, ..Self::default() };
        let numbered = |hashes: &mut dyn Iterator<Item = Hash>| hashes.zip(0..).collect();
        index.by_content = numbered(&mut index.objects.iter().map(|row| row.content));
        index.by_part = numbered(&mut index.parts.iter().map(|row| row.part));
        index.is_valid().then_some(index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cached::{decode, encode};

    fn index() -> FileIndex {
        let section = |kind, offset, length| SectionRow { kind, stride: 4, offset, length, hash: [9; 16] };
        let object = on_disk::Object::read_from_bytes(&[0; size_of::<on_disk::Object>()]).unwrap();
        let row = ObjectRow {
            content: [1; 32],
            triangles: 3,
            degenerate: 1,
            tet_leaves: 0,
            tet_triangles: 0,
            object,
            first: 1,
            sections: 2,
            worker: 0,
            reserved: 0,
        };
        FileIndex {
            objects: vec![row],
            sections: vec![section(1, 0, 0), section(1, 640, 100), section(2, 768, 8)],
            parts: vec![PartRow { part: [2; 32], object: 0, format: 0 }],
            formats: vec!["obj".into()],
            workers: vec![None],
            warnings: BTreeMap::from([(0, vec!["left out".into()])]),
            ..FileIndex::default()
        }
    }

    #[test]
    fn an_index_comes_back_and_is_searched() {
        let back: FileIndex = decode(&encode(&index())).unwrap();
        assert_eq!((back.object_of(&[1; 32]), back.object_of(&[2; 32])), (Some(0), None));
        let part = back.part(&[2; 32]).map(|(row, warnings)| (row.object, warnings));
        assert_eq!(part, Some((0, &["left out".to_owned()][..])));
        assert!(back.part(&[1; 32]).is_none());
        assert_eq!(back.sections_of(0).iter().map(|s| s.offset).collect::<Vec<_>>(), [640, 768]);
        assert_eq!((back.report_of(0).triangles, back.report_of(0).degenerate), (3, 1));
    }

    #[test]
    fn rows_out_of_range_and_sections_apart_do_not_come_back() {
        let changes: [fn(&mut FileIndex); 7] = [
            |o| o.objects[0].sections = 3,
            |o| o.objects[0].first = u32::MAX,
            |o| o.objects[0].sections = 0,
            |o| o.objects[0].worker = 1,
            |o| o.parts[0].object = 1,
            |o| o.parts[0].format = 1,
            |o| o.sections[2].offset = 832,
        ];
        for (number, change) in changes.iter().enumerate() {
            let mut index = index();
            change(&mut index);
            assert!(decode::<FileIndex>(&encode(&index)).is_none(), "change {number}");
        }
    }
}
