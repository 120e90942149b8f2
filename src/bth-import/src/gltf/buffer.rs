//! The bytes behind a glTF document: embedded and external buffers, and the views into them.

use std::borrow::Cow;

use serde::Deserialize;

use crate::error::{Error, Result};
use crate::gltf::extensions::{MESHOPT, unsupported_extension};
use crate::gltf::file::GltfFile;
use crate::gltf::meshopt;
use crate::gltf::schema::{Buffer, BufferView, MeshoptCompression};
use crate::gltf::uri::{beside, decode_data, refusal};
use crate::source::{TRUNCATED, TRUNCATED_HINT, read_at_most};

const BUFFER: &str = "BTH-I014";

impl<'a> GltfFile<'a> {
    /// Returns the bytes of a buffer view, and its stride if it has one.
    ///
    /// # Errors
    /// `BTH-I014` when the view or its buffer does not exist, does not reach far enough, or does
    /// not decompress; `BTH-I011` when it is compressed and this build has no decoder.
    pub(super) fn view(&self, index: usize) -> Result<(&[u8], Option<u64>)> {
        let Some(view) = self.document.buffer_views.get(index) else {
            return Err(self.buffer_error(format!("buffer view {index}"), "it does not exist"));
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
        let part = format!("buffer view {index}");
        let bytes = self.range(&part, view.buffer, view.byte_offset, view.byte_length)?;
        Ok((bytes, view.byte_stride))
    }

    /// Returns the number of bytes that were read from files or decompressed so far.
    pub(super) fn bytes_read(&self) -> u64 {
        let loaded = self.loaded.iter().filter_map(|cell| cell.get()).map(|bytes| bytes.len());
        let decompressed = self.decompressed.iter().filter_map(|cell| cell.get()).map(Vec::len);
        (self.source.data.len() + loaded.chain(decompressed).sum::<usize>()) as u64
    }

    /// Returns how a view is compressed, if it is.
    fn compression(
        &self,
        index: usize,
        view: &BufferView,
    ) -> Result<Option<(&'static str, MeshoptCompression)>> {
        let mut names = MESHOPT.into_iter().filter_map(|name| Some((name, view.extensions.get(name)?)));
        let Some((name, value)) = names.next() else { return Ok(None) };
        MeshoptCompression::deserialize(value).map(|compression| Some((name, compression))).map_err(|e| {
            let message = format!("expected the properties of {name}, found: {e}");
            self.buffer_error(format!("buffer view {index}"), message)
        })
    }

    fn decompress(&self, index: usize, compression: &MeshoptCompression) -> Result<&[u8]> {
        let cell = &self.decompressed[index];
        if cell.get().is_none() {
            let part = format!("buffer view {index}");
            let stream =
                self.range(&part, compression.buffer, compression.byte_offset, compression.byte_length)?;
            let bytes =
                meshopt::decode(stream, compression).map_err(|message| self.buffer_error(part, message))?;
            // The cell is not shared among threads, so it is still empty.
            let _ = cell.set(bytes);
        }
        Ok(cell.get().map_or(&[], |bytes| bytes))
    }

    /// Returns bytes of a buffer, checked to lie inside it.
    fn range(&self, part: &str, buffer: usize, offset: u64, length: u64) -> Result<&[u8]> {
        let bytes = self.buffer(buffer)?;
        let end = offset.saturating_add(length);
        if end <= bytes.len() as u64 {
            return Ok(&bytes[offset as usize..end as usize]);
        }
        let message = format!("expected bytes {offset}..{end} of buffer {buffer}, which has {}", bytes.len());
        Err(self.buffer_error(part, message))
    }

    fn buffer(&self, index: usize) -> Result<&[u8]> {
        let (Some(buffer), Some(cell)) = (self.document.buffers.get(index), self.loaded.get(index)) else {
            return Err(self.buffer_error(format!("buffer {index}"), "it does not exist"));
        };
        if cell.get().is_none() {
            // The cell is not shared among threads, so it is still empty.
            let _ = cell.set(self.load(index, buffer)?);
        }
        Ok(cell.get().map_or(&[], |bytes| bytes.as_ref()))
    }

    fn load(&self, index: usize, buffer: &Buffer) -> Result<Cow<'a, [u8]>> {
        let part = format!("buffer {index}");
        let missing = |message: &str| self.buffer_error(part.as_str(), message);
        let mut bytes = match buffer.uri.as_deref() {
            None => {
                let chunk = self.binary.filter(|_| index == 0);
                Cow::Borrowed(chunk.ok_or_else(|| missing("it has neither a uri nor a GLB chunk"))?)
            }
            Some(uri) if uri.starts_with("data:") => {
                Cow::Owned(decode_data(uri).ok_or_else(|| missing("expected base64 in its data: URI"))?)
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

    /// Reads a file next to the document, at most as many bytes of it as the document uses.
    fn read_external(&self, part: &str, uri: &str, length: u64) -> Result<Vec<u8>> {
        let Some(path) = beside(self.source.path, uri) else {
            let (message, hint) = refusal(uri);
            return Err(self.source.error_in_part(BUFFER, part, message, hint));
        };
        read_at_most(&path, length)
    }

    fn buffer_error(&self, part: impl Into<String>, message: impl Into<String>) -> Error {
        self.error(BUFFER, part, message)
    }
}
