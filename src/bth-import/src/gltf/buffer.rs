//! The bytes behind a glTF document: the GLB container, embedded and external buffers.

use std::borrow::Cow;
use std::cell::OnceCell;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

use crate::error::{Error, Result};
use crate::gltf::json::{Buffer, Root};
use crate::source::{MALFORMED, Source, TRUNCATED, TRUNCATED_HINT, UNSUPPORTED};

const BUFFER: &str = "BTH-I014";
const JSON_CHUNK: u32 = 0x4E4F_534A;
const BIN_CHUNK: u32 = 0x004E_4942;

/// Splits a GLB into its JSON and its binary chunk; a `.gltf` is all JSON.
pub(crate) fn split<'a>(source: &Source<'a>) -> Result<(&'a [u8], Option<&'a [u8]>)> {
    let data = source.data;
    if !data.starts_with(b"glTF") {
        return Ok((data, None));
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
            _ => {} // The specification lets readers pass over other chunks.
        }
        at = end;
    }
    let json = json.ok_or_else(|| {
        let message = "expected a JSON chunk, found none";
        source.error_at_byte(MALFORMED, 12, message, "export the model again")
    })?;
    Ok((json, binary))
}

/// The buffers of a document, read when they are first used.
pub(crate) struct Buffers<'a> {
    source: &'a Source<'a>,
    binary: Option<&'a [u8]>,
    loaded: Vec<OnceCell<Cow<'a, [u8]>>>,
}

impl<'a> Buffers<'a> {
    /// Buffers of a document; `binary` is the GLB's chunk.
    pub(crate) fn new(source: &'a Source<'a>, root: &Root, binary: Option<&'a [u8]>) -> Self {
        Buffers { source, binary, loaded: root.buffers.iter().map(|_| OnceCell::new()).collect() }
    }

    /// The bytes of a buffer view.
    ///
    /// # Errors
    /// When the view or its buffer does not exist, does not reach far enough, or is compressed.
    pub(crate) fn view(&self, root: &Root, view: usize) -> Result<(&[u8], Option<u64>)> {
        let part = format!("buffer view {view}");
        let error = |message: String| {
            self.source.error_in_part(BUFFER, part.clone(), message, "export the model again")
        };
        let view = root.buffer_views.get(view).ok_or_else(|| error("it does not exist".into()))?;
        if let Some(name) = view.extensions.keys().find(|name| name.ends_with("_meshopt_compression")) {
            return Err(crate::gltf::unsupported_extension(self.source, name));
        }
        let buffer = self.buffer(root, view.buffer)?;
        let end = view.byte_offset.saturating_add(view.byte_length);
        if end > buffer.len() as u64 {
            let message = format!(
                "expected bytes {}..{end} of buffer {}, which has {}",
                view.byte_offset,
                view.buffer,
                buffer.len()
            );
            return Err(error(message));
        }
        Ok((&buffer[view.byte_offset as usize..end as usize], view.byte_stride))
    }

    fn buffer(&self, root: &Root, index: usize) -> Result<&[u8]> {
        let (Some(buffer), Some(cell)) = (root.buffers.get(index), self.loaded.get(index)) else {
            let part = format!("buffer {index}");
            return Err(self.source.error_in_part(
                BUFFER,
                part,
                "it does not exist",
                "export the model again",
            ));
        };
        if cell.get().is_none() {
            // A second writer cannot come between: the cell is not shared among threads.
            let _ = cell.set(self.load(index, buffer)?);
        }
        Ok(cell.get().map_or(&[], |bytes| bytes.as_ref()))
    }

    fn load(&self, index: usize, buffer: &Buffer) -> Result<Cow<'a, [u8]>> {
        let part = format!("buffer {index}");
        let error = |message: String, hint| self.source.error_in_part(BUFFER, part.clone(), message, hint);
        let mut bytes = match buffer.uri.as_deref() {
            None => Cow::Borrowed(self.binary.filter(|_| index == 0).ok_or_else(|| {
                error("it has neither a uri nor a GLB chunk".into(), "export the model again")
            })?),
            Some(uri) if uri.starts_with("data:") => Cow::Owned(
                uri.split_once(";base64,").and_then(|(_, text)| decode_base64(text.as_bytes())).ok_or_else(
                    || error("expected base64 in its data: URI".into(), "export the model again"),
                )?,
            ),
            Some(uri) => Cow::Owned(self.read_external(&part, uri, buffer.byte_length)?),
        };
        if (bytes.len() as u64) < buffer.byte_length {
            let message = format!("expected {} bytes, found {}", buffer.byte_length, bytes.len());
            return Err(self.source.error_in_part(TRUNCATED, part, message, TRUNCATED_HINT));
        }
        let length = buffer.byte_length as usize;
        match &mut bytes {
            Cow::Borrowed(bytes) => *bytes = &bytes[..length], // a GLB chunk is padded
            Cow::Owned(bytes) => bytes.truncate(length),
        }
        Ok(bytes)
    }

    /// Reads a file beside the document, at most as many bytes of it as the document uses.
    fn read_external(&self, part: &str, uri: &str, length: u64) -> Result<Vec<u8>> {
        let Some(path) = beside(self.source.path, uri) else {
            let message = format!("expected a relative file name or a data: URI, found \"{uri}\"");
            let hint = "put the buffer beside the model and refer to it by its name";
            return Err(self.source.error_in_part(BUFFER, part, message, hint));
        };
        let file_error = |e: std::io::Error| Error::File {
            code: "BTH-O001",
            path: path.clone(),
            message: format!("cannot read: {e}"),
        };
        let file = std::fs::File::open(&path).map_err(file_error)?;
        if !file.metadata().map_err(file_error)?.is_file() {
            return Err(file_error(std::io::Error::other("not a regular file")));
        }
        let mut bytes = Vec::new();
        file.take(length).read_to_end(&mut bytes).map_err(file_error)?;
        Ok(bytes)
    }
}

/// The file that a relative URI names; `None` for others.
fn beside(document: &Path, uri: &str) -> Option<PathBuf> {
    let name = decode_percent(uri)?;
    let relative = Path::new(&name);
    let is_relative = !uri.contains(':')
        && !relative.components().any(|c| matches!(c, Component::RootDir | Component::Prefix(_)));
    is_relative.then(|| document.parent().unwrap_or(Path::new("")).join(relative))
}

/// The files beside a glTF document that hold its buffers, in order. None for what is no document: reading it tells why.
pub fn external_files(path: &Path, data: &[u8]) -> Vec<PathBuf> {
    let source = Source::new(path, data, &crate::Silent);
    let root = split(&source).ok().and_then(|(json, _)| serde_json::from_slice::<Root>(json).ok());
    let buffers = root.into_iter().flat_map(|root| root.buffers);
    let uris = buffers.filter_map(|buffer| buffer.uri).filter(|uri| !uri.starts_with("data:"));
    uris.filter_map(|uri| beside(path, &uri)).collect()
}

/// Decodes %XX; `None` if that is malformed or the result is not UTF-8.
fn decode_percent(uri: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [first, tail @ ..] = rest {
        rest = tail;
        bytes.push(match (first, tail) {
            (b'%', [high, low, tail @ ..]) => {
                rest = tail;
                let digit = |c: &u8| (*c as char).to_digit(16);
                (digit(high)? * 16 + digit(low)?) as u8
            }
            (b'%', _) => return None,
            _ => *first,
        });
    }
    String::from_utf8(bytes).ok()
}

/// Decodes base64 (RFC 4648, §4 and §5), with or without padding.
fn decode_base64(text: &[u8]) -> Option<Vec<u8>> {
    let text = text.trim_ascii();
    let text = text.strip_suffix(b"==").or_else(|| text.strip_suffix(b"=")).unwrap_or(text);
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3 + 2);
    for group in text.chunks(4) {
        let mut bits = 0u32;
        for c in group {
            let value = match c {
                b'A'..=b'Z' => c - b'A',
                b'a'..=b'z' => c - b'a' + 26,
                b'0'..=b'9' => c - b'0' + 52,
                b'+' | b'-' => 62,
                b'/' | b'_' => 63,
                _ => return None,
            };
            bits = bits << 6 | u32::from(value);
        }
        let decoded = (bits << (6 * (4 - group.len()))).to_be_bytes();
        bytes.extend_from_slice(match group.len() {
            4 => &decoded[1..4],
            3 => &decoded[1..3],
            2 => &decoded[1..2],
            _ => return None,
        });
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_follows_the_vectors_of_rfc_4648() {
        for (text, bytes) in [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYg", "foob"),
            ("Zm9vYmFy", "foobar"),
        ] {
            assert_eq!(decode_base64(text.as_bytes()).as_deref(), Some(bytes.as_bytes()));
        }
        assert_eq!(decode_base64(b"Zm9v!A=="), None);
        assert_eq!(decode_base64(b"Z"), None);
    }

    #[test]
    fn percent_escapes_are_decoded() {
        assert_eq!(decode_percent("a%20b%C3%A9.bin").as_deref(), Some("a b\u{e9}.bin"));
        assert_eq!(decode_percent("a%2"), None);
        assert_eq!(decode_percent("a%zz"), None);
    }
}
