//! Checks of the header and the section table: BTH-F001 to BTH-F019 and BTH-F022. Costs
//! O(sections). Specification: "Opening".

use crate::error::{Code, Error, Result};
use crate::layout::*;
use crate::limits;
use std::mem::offset_of;
use zerocopy::{FromBytes, IntoBytes};

/// Bytes of the header, and offset of the section table.
pub(super) const HEADER_SIZE: usize = size_of::<Header>();
/// Bytes of a section entry.
const ENTRY_SIZE: u64 = size_of::<SectionEntry>() as u64;
/// Required feature bits that this library knows.
const KNOWN_FEATURES: u64 = FEATURE_GRID | FEATURE_WIDENED_BOXES | FEATURE_FIRST_TREES;

/// True if hashes are compared. Not under fuzzing: mutated files would have wrong hashes, and no
/// check behind would be reached.
const CHECKSUMS: bool = !cfg!(fuzzing);

/// The first 128 bits of the BLAKE3 hash.
pub fn hash128(bytes: &[u8]) -> [u8; 16] {
    blake3::hash(bytes).as_bytes()[..16].try_into().expect("32 bytes hold 16")
}

/// The content id of a section table: BLAKE3 of the identifier and, in the table's order and
/// without PROVENANCE, each entry's kind, flags, object, stride, count and hash. Specification:
/// "Content id".
pub fn content_id(entries: &[SectionEntry]) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&IDENTIFIER);
    for e in entries.iter().filter(|e| e.kind != kind::PROVENANCE) {
        for field in [e.kind, e.flags, e.object, e.stride] {
            hasher.update(&field.to_le_bytes());
        }
        hasher.update(&e.count.to_le_bytes()).update(&e.hash);
    }
    *hasher.finalize().as_bytes()
}

/// BTH-F022: the max number of elements of a section.
fn max_count(kind: u32) -> u64 {
    match kind {
        kind::OBJECT => 1,
        kind::LINES => Child::INDEX_LIMIT as u64,
        kind::TETS => limits::MAX_TETS as u64,
        kind::TRIANGLE_IDS | kind::TRIANGLE_FACES | kind::TRIANGLES | kind::CORNERS | kind::OPACITY => {
            limits::MAX_TRIANGLES as u64
        }
        kind::TRIANGLE_PLACES | kind::FREE_DIRECTIONS | kind::FREE_DISTANCES => limits::MAX_TRIANGLES as u64,
        kind::FREE_LEVELS | kind::ANCHOR => 1,
        kind::OPACITY_MICRO => limits::MAX_OPACITY_WORDS as u64,
        kind::LEAF_VERTICES => limits::MAX_LEAF_VERTICES as u64,
        kind::TET_LEAVES => Child::INDEX_LIMIT as u64,
        // Links hold rows in 31 bits, other references in 32; NONE is no row.
        kind::TET_FACES | kind::HULL_FACES | kind::TET_VERTICES | kind::INSTANCES => (FACE_BIT - 1) as u64,
        kind::POSITIONS | kind::EXACT_POSITIONS | kind::NORMALS | kind::UVS | kind::SECOND_UVS => {
            (NONE - 1) as u64
        }
        kind::GROUP_RUNS | kind::COLOR_CORNERS | kind::SECOND_CORNERS => limits::MAX_TRIANGLES as u64,
        kind::GROUPS | kind::MATERIALS | kind::LABELS => (NONE - 1) as u64,
        kind::SEQUENCE_TIMES | kind::SEQUENCE_POSITIONS => (NONE - 1) as u64,
        kind::OBJECT_NAMES | kind::OBJECT_LABELS => (NONE - 1) as u64,
        kind::MATERIAL_PARAMETERS | kind::GLOSS_PARAMETERS => (NONE - 1) as u64,
        kind::TEXTURES | kind::COLORS | kind::IMAGES => (NONE - 1) as u64,
        kind::DEFORMATION..=kind::MORPH_DELTAS => (NONE - 1) as u64,
        kind if kind::is_scene(kind) => (NONE - 1) as u64,
        kind::TREES | kind::TREE_LINES => (FACE_BIT - 1) as u64,
        _ => u64::MAX,
    }
}

/// BTH-F001 to BTH-F008 of the header. `bytes` are the file's first 128, or all where there are
/// fewer or more; `length` is the number of bytes of the file.
pub(super) fn check_header(bytes: &[u8], length: u64) -> Result<&Header> {
    let fail = |code, offset: usize, expected: String, found: String| {
        Err(Error::at(code, offset as u64, expected, found))
    };
    let Ok((header, _)) = Header::ref_from_prefix(bytes) else {
        return fail(Code::HeaderSize, 0, format!("{HEADER_SIZE} bytes"), format!("{}", bytes.len()));
    };
    if header.identifier != IDENTIFIER {
        return fail(Code::Identifier, 0, hex(&IDENTIFIER), hex(&header.identifier));
    }
    let (writer, reader) = (header.writer_version, header.minimum_reader_version);
    if writer >> 16 != 1 || reader >> 16 != 1 || reader > writer || reader > WRITER_VERSION {
        let expected = format!("versions 1.x that a reader of {} may read", version(WRITER_VERSION));
        let found = format!("writer {}, minimum reader {}", version(writer), version(reader));
        return fail(Code::Version, offset_of!(Header, writer_version), expected, found);
    }
    let at = offset_of!(Header, header_hash);
    let hash = hash128(&bytes[..at]);
    if CHECKSUMS && header.header_hash != hash {
        return fail(Code::HeaderHash, at, hex(&hash), hex(&header.header_hash));
    }
    if header.file_length != length {
        let at = offset_of!(Header, file_length);
        return fail(Code::Length, at, format!("{} bytes", header.file_length), format!("{length} bytes"));
    }
    if header.reserved != 0 {
        return fail(
            Code::Reserved,
            offset_of!(Header, reserved),
            "0".into(),
            format!("{}", header.reserved),
        );
    }
    let unknown = header.required_features & !KNOWN_FEATURES;
    if unknown != 0 {
        let at = offset_of!(Header, required_features);
        let old = match unknown {
            FEATURE_BYTE_BOXES => ": boxes of 8 bits, which are no longer read; compile the model again",
            FEATURE_DEFORMABLE_TETS => {
                ": tetrahedra under an object that deforms, which are no longer read; compile the model again"
            }
            _ => "",
        };
        return fail(Code::Features, at, "known feature bits".into(), format!("unknown {unknown:#x}{old}"));
    }
    let max_entries = (length - HEADER_SIZE as u64) / ENTRY_SIZE;
    if header.section_offset != HEADER_SIZE as u64
        || header.section_count > limits::MAX_SECTIONS
        || header.section_count as u64 > max_entries
    {
        let at = offset_of!(Header, section_offset);
        let expected =
            format!("at most {} entries at byte {HEADER_SIZE}", max_entries.min(limits::MAX_SECTIONS as u64));
        let found = format!("{} entries at byte {}", header.section_count, header.section_offset);
        return fail(Code::Table, at, expected, found);
    }
    Ok(header)
}

/// Where the section table of a file ends whose header has been checked.
pub(super) fn end(header: &Header) -> u64 {
    HEADER_SIZE as u64 + u64::from(header.section_count) * ENTRY_SIZE
}

/// The entries of the section table of a file whose header has been checked.
pub(super) fn entries<'a>(bytes: &'a [u8], header: &Header) -> &'a [SectionEntry] {
    let end = end(header) as usize;
    <[SectionEntry]>::ref_from_bytes(&bytes[HEADER_SIZE..end])
        .ok()
        .expect("the buffer is aligned and a table is whole entries")
}

/// Checks the header and the section table of a file of `length` bytes, with which `bytes` begin;
/// returns the number of objects.
///
/// # Errors
/// The first violation of BTH-F001 to BTH-F019 and BTH-F022.
pub(super) fn check(bytes: &[u8], length: u64) -> Result<u32> {
    let header = check_header(bytes, length)?;
    let entries = entries(bytes, header);
    let hash = hash128(entries.as_bytes());
    if CHECKSUMS && header.table_hash != hash {
        let at = offset_of!(Header, table_hash) as u64;
        return Err(Error::at(Code::TableHash, at, hex(&hash), hex(&header.table_hash)));
    }
    // The OBJECT sections lie in front of all others.
    let of_objects = entries.iter().filter(|e| e.kind == kind::OBJECT);
    let mut first_end = HEADER_SIZE as u64 + entries.len() as u64 * ENTRY_SIZE;
    let mut end = of_objects.map(|e| e.offset.saturating_add(e.length)).fold(first_end, u64::max);
    for (i, e) in entries.iter().enumerate() {
        let previous = i.checked_sub(1).map(|p| &entries[p]);
        let end = if e.kind == kind::OBJECT { &mut first_end } else { &mut end };
        *end = check_entry(e, previous, *end, header.file_length).map_err(
            |(code, field, expected, found)| {
                let at = HEADER_SIZE as u64 + i as u64 * ENTRY_SIZE + field as u64;
                Error::within(code, e.kind, at, expected, found).in_object(e.object)
            },
        )?;
    }
    let objects = check_objects(entries)?;
    let id = content_id(entries);
    if CHECKSUMS && header.content_id != id {
        let at = offset_of!(Header, content_id) as u64;
        return Err(Error::at(Code::ContentId, at, hex(&id), hex(&header.content_id)));
    }
    // BTH-F019, which makes the file's length a multiple of 64. Sections end within the file, but
    // rounding up may overflow.
    if end.checked_next_multiple_of(ALIGNMENT as u64) != Some(header.file_length) {
        let at = offset_of!(Header, file_length) as u64;
        let expected = format!("the end of the last section, {end}, rounded up to {ALIGNMENT}");
        return Err(Error::at(Code::Tail, at, expected, format!("{}", header.file_length)));
    }
    Ok(objects)
}

/// A violation in an entry: the code, the field's offset in the entry, what is expected and what
/// was found.
type Mismatch = (Code, usize, String, String);

/// BTH-F006, BTH-F007, BTH-F010 to BTH-F016 and BTH-F022 of an entry. `end` is where the section
/// before ends, `length` the length of the file; returns where this section ends.
fn check_entry(
    e: &SectionEntry,
    previous: Option<&SectionEntry>,
    end: u64,
    length: u64,
) -> std::result::Result<u64, Mismatch> {
    if let Some(p) = previous
        && (p.object, p.kind) >= (e.object, e.kind)
    {
        let expected = format!("an entry behind object {}, kind {}", p.object, p.kind);
        return Err((Code::Order, 0, expected, format!("object {}, kind {}", e.object, e.kind)));
    }
    if e.reserved != 0 {
        return Err((
            Code::Reserved,
            offset_of!(SectionEntry, reserved),
            "0".into(),
            format!("{}", e.reserved),
        ));
    }
    if e.flags & !SECTION_REQUIRED != 0 {
        return Err((Code::Flags, offset_of!(SectionEntry, flags), "0 or 1".into(), format!("{}", e.flags)));
    }
    if e.alignment as usize != ALIGNMENT || !e.offset.is_multiple_of(ALIGNMENT as u64) {
        let found = format!("alignment {} at offset {}", e.alignment, e.offset);
        return Err((
            Code::Alignment,
            offset_of!(SectionEntry, alignment),
            format!("multiples of {ALIGNMENT}"),
            found,
        ));
    }
    let last = e.offset.checked_add(e.length).filter(|last| e.offset >= end && *last <= length);
    let Some(last) = last else {
        let found = format!("{} bytes at {}", e.length, e.offset);
        return Err((
            Code::Bounds,
            offset_of!(SectionEntry, offset),
            format!("bytes from {end} to {length}"),
            found,
        ));
    };
    if (e.stride as u64).checked_mul(e.count) != Some(e.length) {
        let found = format!("{} bytes", e.length);
        return Err((
            Code::Count,
            offset_of!(SectionEntry, length),
            format!("{} times {} bytes", e.count, e.stride),
            found,
        ));
    }
    if e.kind == kind::FORMER_SEGMENTS {
        let found = "27: trees for ranges of time, which are no longer read; compile the scene again";
        return Err((Code::Features, 0, "a known kind".into(), found.into()));
    }
    match kind::stride(e.kind) {
        None if e.flags & SECTION_REQUIRED != 0 => {
            return Err((Code::UnknownKind, 0, "a known kind".into(), format!("{}", e.kind)));
        }
        None => {}
        Some(stride) if stride == e.stride as usize => {}
        Some(stride) => {
            let (code, more) = match (e.kind, e.stride) {
                (kind::TETS, 16 | 20) => {
                    (Code::Features, ", which is no longer read; compile the model again")
                }
                _ => (Code::Stride, ""),
            };
            let found = format!("{}{more}", e.stride);
            return Err((code, offset_of!(SectionEntry, stride), format!("{stride}"), found));
        }
    }
    if e.kind != kind::OBJECT && e.count > max_count(e.kind) {
        let expected = format!("at most {}", max_count(e.kind));
        return Err((Code::Limit, offset_of!(SectionEntry, count), expected, format!("{}", e.count)));
    }
    Ok(last)
}

/// BTH-F017: objects are numbered without gaps. The entries ascend by object and kind. Returns the
/// number of objects.
fn check_objects(entries: &[SectionEntry]) -> Result<u32> {
    let mut objects = 0;
    for (i, e) in entries.iter().enumerate() {
        let whole_file = e.object == NONE;
        let first = !whole_file && e.object == objects;
        let wrong = if whole_file {
            kind::stride(e.kind).is_some() && !kind::is_of_file(e.kind)
        } else if e.kind == kind::OBJECT {
            !first || e.count != 1
        } else {
            // Kind 1 sorts first (kind 0 is not assigned), so an object's other sections follow its
            // OBJECT.
            e.object + 1 != objects || kind::is_of_file(e.kind) || e.kind == 0
        };
        if wrong {
            let at = HEADER_SIZE as u64 + i as u64 * ENTRY_SIZE + offset_of!(SectionEntry, object) as u64;
            let expected =
                format!("the one OBJECT row of object {objects}, or a section that fits its object");
            let found = format!("{} rows of kind {} in object {}", e.count, e.kind, e.object);
            return Err(Error::within(Code::Objects, e.kind, at, expected, found).in_object(e.object));
        }
        objects += u32::from(first && e.kind == kind::OBJECT);
    }
    Ok(objects)
}

fn version(v: u32) -> String {
    format!("{}.{}", v >> 16, v & 0xffff)
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}
