//! The name of a file's content, which its header determines, and the check of a whole file against
//! it.

use super::DiskFile;
use bth_files::Digest;
use bth_format::file::hash128;
use bth_format::layout::ALIGNMENT;
use std::io::Read;
use std::ops::Range;
use std::path::Path;

/// Bytes of the header; their hash is the name of the content.
const HEADER: usize = size_of::<bth_format::layout::Header>();

/// The name of a file's content: the hash of the header. The header contains the hash of the
/// section table, which contains the hashes of the sections. The bytes between sections are zeros.
pub(super) fn name(head: &[u8]) -> Digest {
    Digest::of(head.get(..HEADER).unwrap_or(head))
}

/// The name of a compiled file's content, if every byte of the file agrees with the hashes; else
/// `None`.
pub fn name_if_whole(path: &Path) -> Option<Digest> {
    let mut table = bth_format::file::read_table(path).ok()?;
    // OBJECT sections lie before all others.
    table.sort_unstable_by_key(|entry| entry.offset);
    let mut file = std::fs::File::open(path).ok()?;
    let length = file.metadata().ok()?.len();
    let mut head = [0; HEADER];
    file.read_exact(&mut head).ok()?;
    let file = DiskFile::open(path, file);
    let read = |range, hash| file.read(range, hash, &mut |_| Ok(())).ok();
    let zeros = |range: Range<u64>| {
        let count = range.end.checked_sub(range.start)? as usize;
        read(range, hash128([0; ALIGNMENT].get(..count)?))
    };
    let mut end = (HEADER + size_of_val(&table[..])) as u64;
    for entry in &table {
        zeros(end..entry.offset)?;
        end = entry.offset + entry.length;
        read(entry.offset..end, entry.hash)?;
    }
    zeros(end..length)?;
    Some(name(&head))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::write::FileBuilder;
    use bth_format::layout::NONE;

    #[test]
    fn every_changed_added_or_lost_byte_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bth");
        let mut builder = FileBuilder::new();
        builder.section(99, NONE, 4, vec![1; 20]).unwrap().section(100, NONE, 1, vec![2; 7]).unwrap();
        builder.provenance("{}".into()).unwrap();
        let bytes = builder.finish();
        std::fs::write(&path, &bytes).unwrap();
        let named = name_if_whole(&path);
        assert_eq!(named, Some(crate::write::Content::from(builder.into_static()).name()));
        for at in 0..bytes.len() {
            let mut other = bytes.clone();
            other[at] ^= 1;
            std::fs::write(&path, &other).unwrap();
            assert_ne!(name_if_whole(&path), named, "byte {at}");
        }
        for other in [&bytes[..bytes.len() - 64], &[&bytes[..], &[0; 64]].concat(), b""] {
            std::fs::write(&path, other).unwrap();
            assert_eq!(name_if_whole(&path), None);
        }
    }
}
