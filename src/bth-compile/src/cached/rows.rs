//! Encodes slices of numbers as bytes (for each slice its length in bytes, then its bytes, padded
//! to a multiple of eight), decodes them, and hashes them.

use bth_files::Digest;
use zerocopy::{FromBytes, Immutable, IntoBytes};

const PAD: usize = 8;

/// Receives the slices of a value.
pub(crate) trait Sink {
    /// Adds a slice.
    fn add<T: IntoBytes + Immutable>(&mut self, rows: &[T]);
}

/// Turns slices into bytes.
#[derive(Default)]
pub(crate) struct RowWriter(Vec<u8>);

impl Sink for RowWriter {
    fn add<T: IntoBytes + Immutable>(&mut self, rows: &[T]) {
        let bytes = rows.as_bytes();
        self.0.extend_from_slice(&(bytes.len() as u64).to_le_bytes());
        self.0.extend_from_slice(bytes);
        self.0.resize(self.0.len().next_multiple_of(PAD), 0);
    }
}

impl RowWriter {
    pub(crate) fn finish(self) -> Vec<u8> {
        self.0
    }
}

/// Turns the bytes back into slices.
pub(crate) struct RowReader<'a>(&'a [u8]);

impl<'a> RowReader<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    /// The next slice; `None` when the bytes end or are not whole rows.
    pub(crate) fn take<T: FromBytes>(&mut self) -> Option<Vec<T>> {
        let (length, rest) = self.0.split_first_chunk::<8>()?;
        let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
        let bytes = rest.get(..length)?;
        self.0 = rest.get(length.checked_next_multiple_of(PAD)?..)?;
        let rows = bytes.chunks_exact(size_of::<T>());
        if !rows.remainder().is_empty() {
            return None;
        }
        rows.map(|row| T::read_from_bytes(row).ok()).collect()
    }

    /// The next slice, of one row.
    pub(crate) fn one<T: FromBytes>(&mut self) -> Option<T> {
        let mut rows = self.take::<T>()?;
        rows.pop().filter(|_| rows.is_empty())
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// Hashes slices, each preceded by its length.
pub(crate) struct HashedRows(blake3::Hasher);

impl HashedRows {
    pub(crate) fn new(kind: &str) -> Self {
        let mut rows = Self(blake3::Hasher::new());
        rows.add(kind.as_bytes());
        rows
    }

    pub(crate) fn finish(self) -> Digest {
        self.0.finalize().into()
    }
}

impl Sink for HashedRows {
    fn add<T: IntoBytes + Immutable>(&mut self, rows: &[T]) {
        let bytes = rows.as_bytes();
        self.0.update(&(bytes.len() as u64).to_le_bytes()).update(bytes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back_and_other_lengths_are_refused() {
        let mut rows = RowWriter::default();
        rows.add(&[[1.5f32, 2.0, -0.0]]);
        rows.add::<u8>(&[7; 3]);
        rows.add::<u64>(&[]);
        rows.add(&[9u32]);
        let bytes = rows.finish();
        let mut parts = RowReader::new(&bytes);
        assert_eq!(parts.take::<[f32; 3]>().unwrap(), [[1.5, 2.0, -0.0]]);
        assert_eq!(parts.take::<u8>().unwrap(), [7; 3]);
        assert!(parts.take::<u64>().unwrap().is_empty());
        assert_eq!(parts.one::<u32>(), Some(9));
        assert!(parts.is_empty() && parts.take::<u8>().is_none());
        assert!(RowReader::new(&bytes).take::<u64>().is_none(), "twelve bytes are no whole u64");
        assert!(RowReader::new(&bytes[..12]).take::<u32>().is_none());
        assert!(RowReader::new(&[255; 16]).take::<u8>().is_none());
    }
}
