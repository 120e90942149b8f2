//! The name of a file's content, which its header determines, and the check of a whole file against
//! it.

use bth_files::Digest;
use bth_format::file::hash128;
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

pub(super) fn are_zeros(bytes: &[u8]) -> bool {
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
        assert_eq!(named, Some(builder.content().name()));
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
