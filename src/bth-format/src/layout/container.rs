//! The container: header and section table. Specification: "Container".

use super::assert_layout::assert_layout;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// First bytes of every file. The non-ASCII byte, CR LF, 0x1A and LF reveal a transfer that treated
/// the file as text; the digit is the major version.
pub const IDENTIFIER: [u8; 16] = *b"\x89BTH1\r\n\x1a\n\0\0\0\0\0\0\0";
/// Format version written by this library: major in the high half, minor in the low.
pub const WRITER_VERSION: u32 = 0x0001_0000;
/// Oldest reader version that understands what this library writes.
pub const MINIMUM_READER_VERSION: u32 = 0x0001_0000;
/// Every section starts at a multiple of this many bytes, and the file ends at one.
pub const ALIGNMENT: usize = 64;

/// File header, at byte 0 of the file. Specification: "Header".
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Header {
    /// [`IDENTIFIER`].
    pub identifier: [u8; 16],
    /// Version of the format that the writer followed.
    pub writer_version: u32,
    /// A reader of a lower version of the format must refuse the file.
    pub minimum_reader_version: u32,
    /// Bytes of the whole file.
    pub file_length: u64,
    /// First byte of the section table: always 128.
    pub section_offset: u64,
    /// Number of entries of the section table.
    pub section_count: u32,
    /// Zero.
    pub reserved: u32,
    /// Bits that a reader must know to read the file: [`FEATURE_GRID`], [`FEATURE_WIDENED_BOXES`]
    /// and [`FEATURE_FIRST_TREES`].
    pub required_features: u64,
    /// Bits that a reader may ignore; none is assigned.
    pub optional_features: u64,
    /// BLAKE3 (256 bits) of what the sections hold, without provenance. Specification: "Content
    /// id".
    pub content_id: [u8; 32],
    /// BLAKE3 (first 128 bits) of the section table.
    pub table_hash: [u8; 16],
    /// BLAKE3 (first 128 bits) of the 112 bytes of the header before this field.
    pub header_hash: [u8; 16],
}

/// One entry of the section table. Entries ascend strictly by (object, kind). Specification:
/// "SectionEntry".
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct SectionEntry {
    /// One of [`super::kind`], or a kind that this reader does not know.
    pub kind: u32,
    /// [`SECTION_REQUIRED`] or 0; the other bits are zero.
    pub flags: u32,
    /// The object that the section belongs to; [`super::NONE`] for sections of the whole file.
    pub object: u32,
    /// Alignment of `offset` in bytes: always 64.
    pub alignment: u32,
    /// First byte of the section, from the start of the file.
    pub offset: u64,
    /// Bytes of the section: `stride * count`.
    pub length: u64,
    /// Bytes of one element.
    pub stride: u32,
    /// Zero.
    pub reserved: u32,
    /// Number of elements.
    pub count: u64,
    /// BLAKE3 (first 128 bits) of the section's bytes.
    pub hash: [u8; 16],
}

/// Bit of [`Header::required_features`]: an object stores the coordinates of its triangle leaves on
/// a [`super::Grid`].
pub const FEATURE_GRID: u64 = 1;

/// Bit of [`Header::required_features`] of older files: child boxes are quantized to bytes. Such
/// files are refused.
pub(crate) const FEATURE_BYTE_BOXES: u64 = 2;

/// Bit of [`Header::required_features`] of older files: an object that can be given new positions
/// has tet leaves. Such files are refused. Bit 2 is not assigned.
pub(crate) const FEATURE_DEFORMABLE_TETS: u64 = 8;

/// Bit of [`Header::required_features`]: the boxes of an object are widened, see
/// [`super::WIDENED_BOXES`].
pub const FEATURE_WIDENED_BOXES: u64 = 16;

/// Bit of [`Header::required_features`]: TREES has trees of the first groups, not of all, or of all
/// and not of a world without rows.
pub const FEATURE_FIRST_TREES: u64 = 32;

/// Bit of [`SectionEntry::flags`]: a reader that does not know the section's kind must refuse the
/// file.
pub const SECTION_REQUIRED: u32 = 1;

assert_layout! {
    Header 128 { writer_version 16, file_length 24, section_offset 32, section_count 40,
        required_features 48, optional_features 56, content_id 64, table_hash 96, header_hash 112 }
    SectionEntry 64 { kind 0, flags 4, object 8, alignment 12, offset 16, length 24, stride 32, count 40, hash 48 }
}
