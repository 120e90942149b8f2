//! Checks the sizes of a meshopt stream before its decoder is called and its result allocated.

use crate::gltf::schema::MeshoptCompression;

/// What a stream encodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Mode {
    /// Rows of vertex attributes.
    Attributes,
    /// Indices of a triangle list.
    Triangles,
    /// Any other indices.
    Indices,
}

/// What is applied to decoded attributes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Filter {
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}

/// Sizes that follow the extension's rules and that the stream can hold.
#[derive(Clone, Copy, Debug)]
pub(super) struct CheckedSizes {
    pub(super) mode: Mode,
    pub(super) filter: Filter,
    /// Number of rows or indices.
    pub(super) count: usize,
    /// Bytes of a row or an index.
    pub(super) stride: usize,
}

impl CheckedSizes {
    /// Checks the properties of a view against the extension's rules and the length of its stream.
    ///
    /// # Errors
    /// What was expected and what was found.
    pub(super) fn of(stream: &[u8], compression: &MeshoptCompression) -> Result<Self, String> {
        let (mode, filter) = (mode(compression)?, filter(compression)?);
        let stride = stride(compression, mode, filter)?;
        let count = compression.count;
        let smallest = match mode {
            Mode::Attributes => smallest_attributes(stream, count, stride as u64),
            // A header, one byte for each triangle and a table of 16 bytes.
            Mode::Triangles => 1 + count / 3 + 16,
            // A header, one byte for each index and four bytes after them.
            Mode::Indices => count.saturating_add(5),
        };
        if stream.len() as u64 >= smallest {
            return Ok(CheckedSizes { mode, filter, count: count as usize, stride });
        }
        let found = stream.len();
        Err(format!("expected a stream of {smallest} bytes or more for {count} rows, found {found}"))
    }
}

fn mode(compression: &MeshoptCompression) -> Result<Mode, String> {
    match compression.mode.as_str() {
        "ATTRIBUTES" => Ok(Mode::Attributes),
        "TRIANGLES" if compression.count.is_multiple_of(3) => Ok(Mode::Triangles),
        "TRIANGLES" => {
            Err(format!("expected a count of indices that 3 divides, found {}", compression.count))
        }
        "INDICES" => Ok(Mode::Indices),
        other => Err(format!("expected the mode ATTRIBUTES, TRIANGLES or INDICES, found {other}")),
    }
}

fn filter(compression: &MeshoptCompression) -> Result<Filter, String> {
    match compression.filter.as_deref() {
        None | Some("NONE") => Ok(Filter::None),
        Some("OCTAHEDRAL") => Ok(Filter::Octahedral),
        Some("QUATERNION") => Ok(Filter::Quaternion),
        Some("EXPONENTIAL") => Ok(Filter::Exponential),
        Some("COLOR") => Ok(Filter::Color),
        Some(other) => Err(format!(
            "expected a filter NONE, OCTAHEDRAL, QUATERNION, EXPONENTIAL or COLOR, found {other}"
        )),
    }
}

/// The bytes of an element, which the mode and the filter restrict.
fn stride(compression: &MeshoptCompression, mode: Mode, filter: Filter) -> Result<usize, String> {
    let stride = compression.byte_stride;
    let (allowed, rule) = match (mode, filter) {
        (Mode::Triangles | Mode::Indices, Filter::None) => (matches!(stride, 2 | 4), "2 or 4"),
        (Mode::Triangles | Mode::Indices, _) => {
            return Err(format!("expected no filter for indices, found {filter:?}"));
        }
        (Mode::Attributes, Filter::None | Filter::Exponential) => {
            (stride.is_multiple_of(4) && (4..=256).contains(&stride), "a multiple of 4 up to 256")
        }
        (Mode::Attributes, Filter::Octahedral | Filter::Color) => (matches!(stride, 4 | 8), "4 or 8"),
        (Mode::Attributes, Filter::Quaternion) => (stride == 8, "8"),
    };
    if allowed {
        Ok(stride as usize)
    } else {
        Err(format!("expected a byteStride of {rule}, found {stride}"))
    }
}

/// Bytes of the smallest stream of `count` attribute rows, by the version in its header: a header,
/// for each block of rows at least the control bits of its byte columns, and the tail with the
/// first row.
fn smallest_attributes(stream: &[u8], count: u64, stride: u64) -> u64 {
    let version = stream.first().map_or(0, |header| header & 0x0f);
    let block = ((8192 / stride) & !15).min(256);
    let of_block = |rows: u64| match version {
        _ if rows == 0 => 0,
        // Two bits for each group of 16 rows of a byte column, in whole bytes.
        0 => stride * rows.div_ceil(16).div_ceil(4),
        // Two bits for each byte column.
        _ => stride / 4,
    };
    let tail = if version == 0 { stride.max(32) } else { (stride + stride / 4).max(24) };
    (count / block).saturating_mul(of_block(block)).saturating_add(of_block(count % block) + 1 + tail)
}
