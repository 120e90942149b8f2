//! Encodes results of the stages as bytes, and decodes them with checks.

mod mesh;
mod summary;
mod tets;

pub(crate) use summary::MeshSummary;
pub(super) use summary::geometry;

use super::rows::{RowReader, RowWriter};
use crate::free::Free;
use crate::marks::Marks;

/// A result that can be kept.
pub(crate) trait Codec: Sized {
    /// Writes the rows of the result.
    fn write(&self, to: &mut RowWriter);
    /// The result from its rows; `None` when they are not valid.
    fn read(from: &mut RowReader<'_>) -> Option<Self>;
}

/// The bytes of a result.
pub(crate) fn encode<T: Codec>(value: &T) -> Vec<u8> {
    let mut rows = RowWriter::default();
    value.write(&mut rows);
    rows.finish()
}

/// A result from its bytes; `None` unless they are valid and all of them are used.
pub(crate) fn decode<T: Codec>(bytes: &[u8]) -> Option<T> {
    let mut rows = RowReader::new(bytes);
    let value = T::read(&mut rows)?;
    rows.is_empty().then_some(value)
}

impl Codec for Marks {
    fn write(&self, to: &mut RowWriter) {
        to.add(&self.suitable.iter().map(|s| u8::from(*s)).collect::<Vec<_>>());
    }

    fn read(from: &mut RowReader<'_>) -> Option<Self> {
        let suitable: Vec<u8> = from.take()?;
        Some(Marks { suitable: suitable.iter().map(|s| *s != 0).collect() })
    }
}

impl Codec for Free {
    fn write(&self, to: &mut RowWriter) {
        to.add(&[self.levels]);
        to.add(&self.directions);
        to.add(&self.distances);
    }

    fn read(from: &mut RowReader<'_>) -> Option<Self> {
        Some(Free { levels: from.one()?, directions: from.take()?, distances: from.take()? })
    }
}
