//! What names a file without reading all of it, and whether all of it is what the name says.

use bth_files::Digest;
use bth_format::file::hash128;
use std::path::Path;

/// Bytes that name a file: its header.
pub(crate) const HEADER: usize = size_of::<bth_format::layout::Header>();

/// What names a file: the hash of its header, which has that of the section table, which has those of the sections. Between
/// them there are zeros.
pub(crate) fn name(head: &[u8]) -> Digest {
    Digest::of(head.get(..HEADER).unwrap_or(head))
}

/// What names a compiled file, if every byte of it is what the name says.
pub fn name_if_whole(path: &Path) -> Option<Digest> {
    let file = bth_format::File::read(path).ok()?;
    let bytes = file.bytes();
    let mut end = HEADER + size_of_val(file.table());
    for section in file.sections() {
        let start = section.entry.offset as usize;
        if !are_zeros(&bytes[end..start]) || hash128(section.bytes) != section.entry.hash {
            return None;
        }
        end = start + section.bytes.len();
    }
    are_zeros(&bytes[end..]).then(|| name(bytes))
}

pub(crate) fn are_zeros(bytes: &[u8]) -> bool {
    bytes.iter().all(|b| *b == 0)
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
        assert_eq!(named, Some(builder.content().0.name()));
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
