//! Reads the body of a binary PLY.

use crate::error::{Error, Result};
use crate::formats::ply::header::{Element, ElementKind, Header, Meaning, Scalar};
use crate::formats::ply::sink::{Sink, Vertex, slot};
use crate::source::{MALFORMED, MALFORMED_HINT, Source, TRUNCATED, TRUNCATED_HINT};

/// Reads all elements; `BIG` is true for the big-endian byte order.
pub(super) fn read<const BIG: bool>(source: &Source<'_>, header: &Header, sink: &mut Sink<'_>) -> Result<()> {
    let mut cursor = Cursor::<BIG> { source, at: header.body };
    for element in &header.elements {
        match element.kind {
            ElementKind::Vertices => cursor.vertices(element, sink)?,
            ElementKind::Faces | ElementKind::Strips => cursor.lists(element, sink)?,
            ElementKind::Edges | ElementKind::Other => cursor.skip(element, element.count)?,
        }
    }
    let extra = source.data.len() - cursor.at;
    if extra > 0 {
        source.monitor.warn(&format!("{extra} bytes after the last element are ignored"));
    }
    Ok(())
}

/// The byte of a vertex's row.
pub(super) fn byte_of_vertex<const BIG: bool>(source: &Source<'_>, header: &Header, row: usize) -> usize {
    let mut cursor = Cursor::<BIG> { source, at: header.body };
    for element in &header.elements {
        let rows = if element.kind == ElementKind::Vertices { row as u64 } else { element.count };
        // The body was read to its end before, so this cannot fail.
        if cursor.skip(element, rows).is_err() || element.kind == ElementKind::Vertices {
            break;
        }
    }
    cursor.at
}

struct Cursor<'s, 'd, const BIG: bool> {
    source: &'s Source<'d>,
    at: usize,
}

impl<'d, const BIG: bool> Cursor<'_, 'd, BIG> {
    fn vertices(&mut self, element: &Element, sink: &mut Sink<'_>) -> Result<()> {
        let smallest = smallest_row(element);
        let room = (self.source.data.len() - self.at) / smallest.max(1);
        sink.raw.positions.reserve_exact(room.min(element.count as usize));
        if element.properties.iter().any(|property| property.list.is_some()) {
            for row in 0..element.count {
                self.source.tick(row, self.at)?;
                let mut vertex = Vertex::default();
                for property in &element.properties {
                    let bytes = self.property(property.list, property.scalar, element)?;
                    if let Some(slot) = slot(property.meaning) {
                        vertex[slot] = coordinate::<BIG>(property.scalar, bytes);
                    }
                }
                sink.vertex(vertex);
            }
            return Ok(());
        }
        // All rows have the same size, so the offsets of the kept values are found once.
        let mut fields = Vec::new();
        let mut offset = 0;
        for property in &element.properties {
            let end = offset + property.scalar.size();
            fields.extend(slot(property.meaning).map(|slot| (slot, property.scalar, offset..end)));
            offset = end;
        }
        for row in 0..element.count {
            self.source.tick(row, self.at)?;
            let bytes = self.take(offset, element)?;
            let mut vertex = Vertex::default();
            for (slot, scalar, range) in &fields {
                vertex[*slot] = coordinate::<BIG>(*scalar, &bytes[range.clone()]);
            }
            sink.vertex(vertex);
        }
        Ok(())
    }

    fn lists(&mut self, element: &Element, sink: &mut Sink<'_>) -> Result<()> {
        if element.kind == ElementKind::Faces {
            // Reserve for triangles, whose rows have at least three bytes of indices.
            let room = (self.source.data.len() - self.at) / (smallest_row(element) + 3);
            sink.raw.triangles.reserve(room.min(element.count as usize));
        }
        let mut indices = Vec::new();
        // Elements without properties take no bytes, so their count is not bounded by the file.
        let rows = if element.properties.is_empty() { 0 } else { element.count };
        for row in 0..rows {
            self.source.tick(row, self.at)?;
            let start = self.at;
            for property in &element.properties {
                let bytes = self.property(property.list, property.scalar, element)?;
                if property.meaning != Meaning::Indices {
                    continue;
                }
                indices.clear();
                match property.scalar {
                    Scalar::I32 => indices.extend(u32_words::<BIG>(bytes).map(|word| i64::from(word as i32))),
                    Scalar::U32 => indices.extend(u32_words::<BIG>(bytes).map(i64::from)),
                    scalar => {
                        let items = bytes.chunks_exact(scalar.size());
                        indices.extend(items.map(|item| integer::<BIG>(scalar, item)));
                    }
                }
                let of_row = || format!(" in row {row} of element {}", element.name);
                sink.list(element.kind, &indices, || (self.source.byte(start), of_row()))?;
            }
        }
        Ok(())
    }

    /// Skips rows.
    fn skip(&mut self, element: &Element, rows: u64) -> Result<()> {
        if element.properties.is_empty() {
            return Ok(());
        }
        if element.properties.iter().all(|property| property.list.is_none()) {
            let bytes = rows.saturating_mul(smallest_row(element) as u64);
            self.take(usize::try_from(bytes).unwrap_or(usize::MAX), element)?;
            return Ok(());
        }
        for row in 0..rows {
            self.source.tick(row, self.at)?;
            for property in &element.properties {
                self.property(property.list, property.scalar, element)?;
            }
        }
        Ok(())
    }

    /// The bytes of a property's value or items.
    #[inline]
    fn property(&mut self, list: Option<Scalar>, scalar: Scalar, element: &Element) -> Result<&'d [u8]> {
        let Some(count_type) = list else {
            return self.take(scalar.size(), element);
        };
        let at = self.at;
        let count = integer::<BIG>(count_type, self.take(count_type.size(), element)?);
        let Ok(count) = usize::try_from(count) else {
            let message = format!("expected the count of a list of element {}, found {count}", element.name);
            return Err(self.source.error_at_byte(MALFORMED, at, message, MALFORMED_HINT));
        };
        self.take(count.saturating_mul(scalar.size()), element)
    }

    #[inline]
    fn take(&mut self, bytes: usize, element: &Element) -> Result<&'d [u8]> {
        match self.source.data[self.at..].get(..bytes) {
            Some(taken) => {
                self.at += bytes;
                Ok(taken)
            }
            None => Err(self.truncated(element)),
        }
    }

    #[cold]
    fn truncated(&self, element: &Element) -> Error {
        let message =
            format!("expected {} rows of element {}, found the end of the file", element.count, element.name);
        self.source.error_at_byte(TRUNCATED, self.source.data.len(), message, TRUNCATED_HINT)
    }
}

/// Bytes of a row whose lists are empty.
fn smallest_row(element: &Element) -> usize {
    element.properties.iter().map(|property| property.list.unwrap_or(property.scalar).size()).sum()
}

#[inline]
fn u32_words<const BIG: bool>(bytes: &[u8]) -> impl Iterator<Item = u32> {
    let (words, _) = bytes.as_chunks::<4>();
    words.iter().map(|word| if BIG { u32::from_be_bytes(*word) } else { u32::from_le_bytes(*word) })
}

/// The unsigned value of a scalar's bytes.
#[inline]
fn bits<const BIG: bool>(bytes: &[u8]) -> u64 {
    let join = |value: u64, byte: &u8| value << 8 | u64::from(*byte);
    if BIG { bytes.iter().fold(0, join) } else { bytes.iter().rev().fold(0, join) }
}

#[inline]
fn integer<const BIG: bool>(scalar: Scalar, bytes: &[u8]) -> i64 {
    let bits = bits::<BIG>(bytes);
    match scalar {
        Scalar::I8 => i64::from(bits as i8),
        Scalar::I16 => i64::from(bits as i16),
        Scalar::I32 => i64::from(bits as i32),
        _ => bits as i64,
    }
}

#[inline]
fn coordinate<const BIG: bool>(scalar: Scalar, bytes: &[u8]) -> f64 {
    match scalar {
        Scalar::F32 => f32::from_bits(bits::<BIG>(bytes) as u32).into(),
        Scalar::F64 => f64::from_bits(bits::<BIG>(bytes)),
        _ => integer::<BIG>(scalar, bytes) as f64,
    }
}
