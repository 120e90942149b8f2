//! The GLB container (glTF 2.0 specification, §4).

use crate::error::Result;
use crate::source::{MALFORMED, Source, TRUNCATED, TRUNCATED_HINT, UNSUPPORTED};
use crate::text::without_mark;

const JSON_CHUNK: u32 = 0x4E4F_534A;
const BIN_CHUNK: u32 = 0x004E_4942;

/// Splits a GLB into its JSON and its binary chunk. A `.gltf` is all JSON, perhaps after a byte
/// order mark.
pub(crate) fn split<'a>(source: &Source<'a>) -> Result<(&'a [u8], Option<&'a [u8]>)> {
    let data = source.data;
    if !data.starts_with(b"glTF") {
        return Ok((without_mark(data), None));
    }
    let word = |at: usize| -> Result<u32> {
        let bytes = data.get(at..at + 4).and_then(|b| b.try_into().ok());
        bytes.map(u32::from_le_bytes).ok_or_else(|| {
            let message = "expected a GLB header or chunk header, found the end of the file";
            source.error_at_byte(TRUNCATED, data.len(), message, TRUNCATED_HINT)
        })
    };
    let (version, length) = (word(4)?, word(8)? as usize);
    if version != 2 {
        let message = format!("expected GLB version 2, found {version}");
        return Err(source.error_at_byte(UNSUPPORTED, 4, message, "convert the model to glTF 2.0"));
    }
    if length > data.len() {
        let message = format!("expected {length} bytes as the header says, found {}", data.len());
        return Err(source.error_at_byte(TRUNCATED, data.len(), message, TRUNCATED_HINT));
    }
    if length < data.len() {
        source.monitor.warn(&format!("{} bytes after the end of the GLB are ignored", data.len() - length));
    }
    let (mut json, mut binary, mut at) = (None, None, 12);
    while at < length {
        let (size, kind) = (word(at)? as usize, word(at + 4)?);
        let end = (at + 8).saturating_add(size);
        if end > length {
            let message =
                format!("expected a chunk of {size} bytes, found {}", length.saturating_sub(at + 8));
            return Err(source.error_at_byte(TRUNCATED, at, message, TRUNCATED_HINT));
        }
        let chunk = &data[at + 8..end];
        match kind {
            JSON_CHUNK if json.is_none() => json = Some(chunk),
            BIN_CHUNK if binary.is_none() => binary = Some(chunk),
            _ => {} // Readers may ignore other chunks (§4.4.1).
        }
        at = end;
    }
    let json = json.ok_or_else(|| {
        let message = "expected a JSON chunk, found none";
        source.error_at_byte(MALFORMED, 12, message, "export the model again")
    })?;
    Ok((without_zeros(source, json), binary))
}

/// A JSON chunk without zeros at its end, with which some programs pad it, where the specification
/// wants blanks (§4.4.3.2).
fn without_zeros<'a>(source: &Source<'_>, json: &'a [u8]) -> &'a [u8] {
    let end = json.iter().rposition(|byte| *byte != 0).map_or(0, |last| last + 1);
    if end < json.len() {
        source.monitor.warn("the JSON of the GLB is padded with zeros in place of blanks");
    }
    &json[..end]
}
