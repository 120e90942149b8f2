//! Rows of scene sections, each checked by itself.

use crate::error::{Code, Error, Result};
use std::fmt::Debug;

/// What a row violates.
pub(super) struct Violation {
    pub(super) code: Code,
    /// Byte of the row.
    pub(super) offset: usize,
    pub(super) expected: &'static str,
    pub(super) found: String,
}

/// What the check of one row returns.
pub(super) type RowResult<T> = std::result::Result<T, Violation>;

/// The error that a row violates an invariant.
pub(super) fn violation<T>(
    code: Code,
    offset: usize,
    expected: &'static str,
    found: impl Debug,
) -> RowResult<T> {
    Err(Violation { code, offset, expected, found: format!("{found:?}") })
}

/// Checks every row of a section of the whole file by itself.
pub(super) fn check_rows<T>(kind: u32, rows: &[T], check: impl Fn(usize, &T) -> RowResult<()>) -> Result<()> {
    for (i, row) in rows.iter().enumerate() {
        check(i, row).map_err(|violation| violation.in_row::<T>(kind, i))?;
    }
    Ok(())
}

impl Violation {
    /// The violation as an error of a row of a section of the whole file.
    pub(super) fn in_row<T>(self, kind: u32, row: usize) -> Error {
        let offset = row * size_of::<T>() + self.offset;
        Error::within_file(
            self.code,
            kind,
            offset as u64,
            self.expected,
            format!("{} in row {row}", self.found),
        )
    }
}
