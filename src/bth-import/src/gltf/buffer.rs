//! The bytes behind a glTF document: embedded and external buffers, and the buffer views into them.

use std::borrow::Cow;
use std::cell::OnceCell;

use serde::Deserialize;

use crate::error::{Error, Result};
use crate::gltf::extensions::{MESHOPT, unsupported_extension};
use crate::gltf::meshopt;
use crate::gltf::schema::{Buffer, BufferView, GltfDocument, MeshoptCompression};
use crate::gltf::uri::{beside, decode_base64, refusal};
use crate::source::{Source, TRUNCATED, TRUNCATED_HINT, read_at_most};

const BUFFER: &str = "BTH-I014";

/// The buffers of a document, read when they are first used, and its compressed views, decoded when they are first used.
pub(crate) struct Buffers<'a> {
    source: &'a Source<'a>,
    document: &'a GltfDocument,
    binary: Option<&'a [u8]>,
    loaded: Vec<OnceCell<Cow<'a, [u8]>>>,
    decompressed: Vec<OnceCell<Vec<u8>>>,
}

impl<'a> Buffers<'a> {
    /// The buffers of a document; `binary` is the GLB's chunk.
    pub(crate) fn new(source: &'a Source<'a>, document: &'a GltfDocument, binary: Option<&'a [u8]>) -> Self {
        Buffers {
            source,
            document,
            binary,
            loaded: document.buffers.iter().map(|_| OnceCell::new()).collect(),
            decompressed: document.buffer_views.iter().map(|_| OnceCell::new()).collect(),
        }
    }

    /// The bytes of a buffer view, and its stride if it has one.
    ///
    /// # Errors
    /// `BTH-I014` when the view or its buffer does not exist, does not reach far enough, or does not decompress;
    /// `BTH-I011` when it is compressed and this build has no decoder.
    pub(crate) fn view(&self, index: usize) -> Result<(&[u8], Option<u64>)> {
        let Some(view) = self.document.buffer_views.get(index) else {
            return Err(self.error(format!("buffer view {index}"), "it does not exist"));
        };
        if let Some((name, compression)) = self.compression(index, view)? {
            if meshopt::AVAILABLE {
                return Ok((self.decompress(index, &compression)?, view.byte_stride));
            }
            if self.document.buffers.get(view.buffer).is_none_or(|buffer| buffer.uri.is_none()) {
                return Err(unsupported_extension(self.source, name));
            }
            // The fallback buffer holds the view's bytes without compression.
        }
        let bytes =
            self.range(&format!("buffer view {index}"), view.buffer, view.byte_offset, view.byte_length)?;
        Ok((bytes, view.byte_stride))
    }

    /// Bytes that were read from buffers or decompressed so far.
    pub(crate) fn bytes_read(&self) -> u64 {
        let loaded = self.loaded.iter().filter_map(|cell| cell.get()).map(|bytes| bytes.len() as u64);
        let decompressed = self.decompressed.iter().filter_map(|cell| cell.get()).map(|b| b.len() as u64);
        loaded.chain(decompressed).sum()
    }

    /// How a view is compressed, if it is.
    fn compression(
        &self,
        index: usize,
        view: &BufferView,
    ) -> Result<Option<(&'static str, MeshoptCompression)>> {
        let mut names = MESHOPT.into_iter().filter_map(|name| Some((name, view.extensions.get(name)?)));
        let Some((name, value)) = names.next() else { return Ok(None) };
        match MeshoptCompression::deserialize(value) {
            Ok(compression) => Ok(Some((name, compression))),
            Err(e) => {
                let message = format!("expected the properties of {name}, found: {e}");
                Err(self.error(format!("buffer view {index}"), message))
            }
        }
    }

    fn decompress(&self, index: usize, compression: &MeshoptCompression) -> Result<&[u8]> {
        let cell = &self.decompressed[index];
        if cell.get().is_none() {
            let part = format!("buffer view {index}");
            let stream =
                self.range(&part, compression.buffer, compression.byte_offset, compression.byte_length)?;
            let bytes = meshopt::decode(stream, compression).map_err(|message| self.error(part, message))?;
            // The cell is not shared among threads, so it is still empty.
            let _ = cell.set(bytes);
        }
        Ok(cell.get().map_or(&[], |bytes| bytes))
    }

    /// Bytes of a buffer, checked to lie inside it.
    fn range(&self, part: &str, buffer: usize, offset: u64, length: u64) -> Result<&[u8]> {
        let bytes = self.buffer(buffer)?;
        let end = offset.saturating_add(length);
        if end <= bytes.len() as u64 {
            return Ok(&bytes[offset as usize..end as usize]);
        }
        let message = format!("expected bytes {offset}..{end} of buffer {buffer}, which has {}", bytes.len());
        Err(self.error(part, message))
    }

    fn buffer(&self, index: usize) -> Result<&[u8]> {
        let (Some(buffer), Some(cell)) = (self.document.buffers.get(index), self.loaded.get(index)) else {
            return Err(self.error(format!("buffer {index}"), "it does not exist"));
        };
        if cell.get().is_none() {
            // The cell is not shared among threads, so it is still empty.
            let _ = cell.set(self.load(index, buffer)?);
        }
        Ok(cell.get().map_or(&[], |bytes| bytes.as_ref()))
    }

    fn load(&self, index: usize, buffer: &Buffer) -> Result<Cow<'a, [u8]>> {
        let part = format!("buffer {index}");
        let mut bytes = match buffer.uri.as_deref() {
            None => Cow::Borrowed(
                self.binary
                    .filter(|_| index == 0)
                    .ok_or_else(|| self.error(part.as_str(), "it has neither a uri nor a GLB chunk"))?,
            ),
            Some(uri) if uri.starts_with("data:") => {
                let decoded = uri.split_once(";base64,").and_then(|(_, text)| decode_base64(text.as_bytes()));
                Cow::Owned(
                    decoded.ok_or_else(|| self.error(part.as_str(), "expected base64 in its data: URI"))?,
                )
            }
            Some(uri) => Cow::Owned(self.read_external(&part, uri, buffer.byte_length)?),
        };
        if (bytes.len() as u64) < buffer.byte_length {
            let message = format!("expected {} bytes, found {}", buffer.byte_length, bytes.len());
            return Err(self.source.error_in_part(TRUNCATED, part, message, TRUNCATED_HINT));
        }
        let length = buffer.byte_length as usize;
        match &mut bytes {
            Cow::Borrowed(bytes) => *bytes = &bytes[..length], // A GLB chunk is padded.
            Cow::Owned(bytes) => bytes.truncate(length),
        }
        Ok(bytes)
    }

    /// Reads a file beside the document, at most as many bytes of it as the document uses.
    fn read_external(&self, part: &str, uri: &str, length: u64) -> Result<Vec<u8>> {
        let Some(path) = beside(self.source.path, uri) else {
            let (message, hint) = refusal(uri);
            return Err(self.source.error_in_part(BUFFER, part, message, hint));
        };
        read_at_most(&path, length)
    }

    fn error(&self, part: impl Into<String>, message: impl Into<String>) -> Error {
        self.source.error_in_part(BUFFER, part, message, "export the model again")
    }
}
