//! The parts of a 3MF package: files in a ZIP archive (Open Packaging Conventions).

use std::collections::HashMap;
use std::io::Read;

use flate2::bufread::DeflateDecoder;
use rawzip::{CompressionMethod, ZipArchive, ZipArchiveEntryWayfinder, ZipSliceArchive};

use crate::error::{Error, Result};
use crate::gltf::threemf::EXPORT;
use crate::gltf::threemf::part::Part;
use crate::source::{MALFORMED, Source, UNSUPPORTED};

/// Unzipped bytes that the parts may have: for each byte of the package, and in addition.
const BYTES_PER_BYTE: u64 = 256;
const FREE_BYTES: u64 = 1 << 24;
/// Bytes of memory that a byte of a part takes at most until it is read.
const MEMORY_PER_BYTE: u64 = 3;
/// What the bytes of a part begin with that the extension for secure content encrypts.
const ENCRYPTED: &[u8] = b"%3McF";

pub(super) struct Package<'a> {
    source: &'a Source<'a>,
    archive: ZipSliceArchive<&'a [u8]>,
    /// By names in small letters, as the names of parts are equal.
    entries: HashMap<String, Entry>,
    /// Bytes that further parts may have.
    left: u64,
}

struct Entry {
    place: ZipArchiveEntryWayfinder,
    method: CompressionMethod,
    is_encrypted: bool,
}

impl<'a> Package<'a> {
    pub(super) fn open(source: &'a Source<'a>) -> Result<Self> {
        let error = |e: rawzip::Error| {
            source.error(MALFORMED, format!("expected a whole ZIP archive, found: {e}"), EXPORT)
        };
        let archive = ZipArchive::from_slice(source.data).map_err(error)?;
        let mut entries = HashMap::new();
        let mut listed = archive.entries();
        while let Some(entry) = listed.next_entry().map_err(error)? {
            let name = String::from_utf8_lossy(entry.file_path().as_bytes()).to_ascii_lowercase();
            let (place, method) = (entry.wayfinder(), entry.compression_method());
            let is_encrypted = entry.flags().is_encrypted();
            entries.entry(name).or_insert(Entry { place, method, is_encrypted });
        }
        let left = (source.data.len() as u64).saturating_mul(BYTES_PER_BYTE).saturating_add(FREE_BYTES);
        Ok(Package { source, archive, entries, left })
    }

    /// Unzips a part.
    pub(super) fn part(&mut self, name: &str) -> Result<Part<'a>> {
        let name = name.trim_start_matches('/');
        let error = |code, message: String| self.source.error_in_part(code, name, message, EXPORT);
        let Some(entry) = self.entries.get(&name.to_ascii_lowercase()) else {
            return Err(error(
                MALFORMED,
                "expected a part of this name in the package, found none".to_owned(),
            ));
        };
        if entry.is_encrypted {
            return Err(error(UNSUPPORTED, "expected a part that is not encrypted".to_owned()));
        }
        let damaged = |e: &dyn std::fmt::Display| {
            error(MALFORMED, format!("expected the bytes that were packed, found: {e}"))
        };
        let packed = self.archive.get_entry(entry.place).map_err(|e| damaged(&e))?;
        let reader: Box<dyn Read> = match entry.method {
            CompressionMethod::STORE => Box::new(packed.data()),
            CompressionMethod::DEFLATE => Box::new(DeflateDecoder::new(packed.data())),
            other => {
                return Err(error(
                    UNSUPPORTED,
                    format!("expected stored or deflated bytes, found {other:?}"),
                ));
            }
        };
        let room = bth_format::memory::available() / MEMORY_PER_BYTE;
        let most = self.left.min(room);
        let mut text = Vec::new();
        let read = packed.verifying_reader(reader).take(most.saturating_add(1)).read_to_end(&mut text);
        if text.len() as u64 > most {
            let path = self.source.path.display();
            return Err(match most < self.left {
                true => Error::Limit {
                    code: "BTH-L034",
                    message: format!("{path}: reading {name} takes more memory than is left"),
                },
                false => error(
                    MALFORMED,
                    format!("expected at most {BYTES_PER_BYTE} times the bytes of the package, found more"),
                ),
            });
        }
        read.map_err(|e| damaged(&e))?;
        self.left -= text.len() as u64;
        if text.starts_with(ENCRYPTED) {
            return Err(error(UNSUPPORTED, "expected a part that is not encrypted".to_owned()));
        }
        if text.starts_with(b"\xFE\xFF") || text.starts_with(b"\xFF\xFE") {
            return Err(error(UNSUPPORTED, "expected text in UTF-8, found UTF-16".to_owned()));
        }
        Ok(Part { source: self.source, name: name.to_owned(), text })
    }
}
