//! Encodes results of the stages as bytes, and decodes them with checks.

mod mesh;
mod summary;
mod tets;

pub(crate) use summary::{MeshSummary, geometry};

use super::rows::{RowReader, RowWriter, Sink};
use crate::free::Free;
use crate::marks::Marks;
use zerocopy::{FromBytes, Immutable, IntoBytes};

/// A result that can be kept.
pub(crate) trait Codec: Sized {
    /// Writes the rows of the result.
    fn write(&self, to: &mut impl Sink);
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

/// Encodes structures by their fields; all must be named. Decoding returns `None` if the check
/// fails.
macro_rules! by_fields {
    ($($type:ident { $($field:ident),* } $check:expr;)*) => {
        $(impl $crate::cached::Codec for $type {
            fn write(&self, to: &mut impl $crate::cached::Sink) {
                let $type { $($field),* } = self;
                $($field.write(to);)*
            }

            fn read(from: &mut $crate::cached::RowReader<'_>) -> Option<Self> {
                let value = $type { $($field: $crate::cached::Codec::read(from)?),* };
                let check: fn(&$type) -> bool = $check;
                check(&value).then_some(value)
            }
        })*
    };
}
pub(crate) use by_fields;

impl<T: FromBytes + IntoBytes + Immutable> Codec for Vec<T> {
    fn write(&self, to: &mut impl Sink) {
        to.add(self);
    }

    fn read(from: &mut RowReader<'_>) -> Option<Self> {
        from.take()
    }
}

impl<T: FromBytes + IntoBytes + Immutable, const N: usize> Codec for [T; N] {
    fn write(&self, to: &mut impl Sink) {
        to.add(self);
    }

    fn read(from: &mut RowReader<'_>) -> Option<Self> {
        from.take()?.try_into().ok()
    }
}

impl<T: Codec> Codec for Option<T> {
    fn write(&self, to: &mut impl Sink) {
        to.add(&[u8::from(self.is_some())]);
        if let Some(value) = self {
            value.write(to);
        }
    }

    fn read(from: &mut RowReader<'_>) -> Option<Self> {
        match from.one::<u8>()? {
            0 => Some(None),
            _ => T::read(from).map(Some),
        }
    }
}

impl Codec for Marks {
    fn write(&self, to: &mut impl Sink) {
        to.add(&self.suitable.iter().map(|s| u8::from(*s)).collect::<Vec<_>>());
    }

    fn read(from: &mut RowReader<'_>) -> Option<Self> {
        let suitable: Vec<u8> = from.take()?;
        Some(Marks { suitable: suitable.iter().map(|s| *s != 0).collect() })
    }
}

by_fields! { Free { levels, directions, distances } |_| true; }
