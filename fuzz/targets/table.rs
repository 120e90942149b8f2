//! Section tables that are nearly right: entries laid out as the format wants, then some fields
//! changed, and sections of arbitrary content that fit their strides, so that the checks of
//! contents are reached often.
#![no_main]
use arbitrary::Arbitrary;
use bth_format::layout::*;
use libfuzzer_sys::fuzz_target;
use zerocopy::IntoBytes;

#[derive(Arbitrary, Debug)]
struct Layout {
    sections: Vec<Section>,
    /// Changed fields: row, which field, new value.
    changes: Vec<(u8, u8, u64)>,
    sort: bool,
}

#[derive(Arbitrary, Debug)]
struct Section {
    kind: u8,
    object: u8,
    elements: u8,
    content: Vec<u8>,
}

/// Kinds that are known, and one that is not.
const KINDS: [u32; 39] = [
    1, 2, 3, 4, 5, 6, 7, 8, 9, 16, 17, 18, 19, 20, 21, 22, 23, 24, 28, 29, 32, 33, 34, 35, 36, 37, 38, 39,
    40, 48, 49, 50, 51, 52, 53, 54, 55, 56, 99,
];

/// Bytes of a file with these sections; hashes are not looked at under fuzzing.
fn file(layout: &mut Layout) -> Vec<u8> {
    let sections = &mut layout.sections;
    sections.truncate(40);
    let object = |s: &Section| if s.object == 255 { NONE } else { u32::from(s.object % 4) };
    let kind = |s: &Section| KINDS[usize::from(s.kind) % KINDS.len()];
    if layout.sort {
        sections.sort_by_key(|s| (object(s), kind(s)));
        sections.dedup_by_key(|s| (object(s), kind(s)));
    }
    let mut end = size_of::<Header>() + size_of::<SectionEntry>() * sections.len();
    let mut bytes = vec![0; end];
    let mut entries = Vec::new();
    for s in sections.iter() {
        let stride = match bth_format::file::kind_stride(kind(s)) {
            Some(0) => [16, 20, 32][usize::from(s.object) % 3],
            Some(stride) => stride,
            None => 1 + usize::from(s.object),
        };
        let count = if kind(s) == kind::OBJECT { 1 } else { usize::from(s.elements) };
        let offset = end.next_multiple_of(ALIGNMENT);
        end = offset + stride * count;
        bytes.resize(end, 0);
        for (to, from) in bytes[offset..].iter_mut().zip(&s.content) {
            *to = *from;
        }
        entries.push(SectionEntry {
            kind: kind(s),
            flags: 0,
            object: object(s),
            alignment: ALIGNMENT as u32,
            offset: offset as u64,
            length: (stride * count) as u64,
            stride: stride as u32,
            reserved: 0,
            count: count as u64,
            hash: [0; 16],
        });
    }
    bytes.resize(end.next_multiple_of(ALIGNMENT), 0);
    for (row, field, value) in layout.changes.iter().take(3) {
        let rows = entries.len();
        let Some(e) = entries.get_mut(usize::from(*row) % rows.max(1)) else { continue };
        match field % 9 {
            0 => e.offset = *value,
            1 => e.length = *value,
            2 => e.count = *value,
            3 => e.stride = *value as u32,
            4 => e.offset = e.offset.wrapping_add(64 * (*value % 5)).wrapping_sub(128),
            5 => e.object = *value as u32,
            6 => e.kind = *value as u32,
            7 => e.flags = *value as u32,
            _ => e.alignment = *value as u32,
        }
    }
    let header = Header {
        identifier: IDENTIFIER,
        writer_version: WRITER_VERSION,
        minimum_reader_version: MINIMUM_READER_VERSION,
        file_length: bytes.len() as u64,
        section_offset: size_of::<Header>() as u64,
        section_count: entries.len() as u32,
        reserved: 0,
        required_features: 0,
        optional_features: 0,
        content_id: [0; 32],
        table_hash: [0; 16],
        header_hash: [0; 16],
    };
    let (head, table) = (header.as_bytes(), entries.as_bytes());
    bytes[..head.len()].copy_from_slice(head);
    bytes[head.len()..][..table.len()].copy_from_slice(table);
    bytes
}

fuzz_target!(|layout: Layout| {
    let mut layout = layout;
    bth_fuzz::open_and_trace(&file(&mut layout));
});
