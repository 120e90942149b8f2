//! Rows of a section, each checked by itself.

use crate::error::{Code, Error, Result};
use std::borrow::Cow;
use std::fmt::Debug;

/// What a row violates.
pub(super) struct Violation {
    pub(super) code: Code,
    /// Byte of the row.
    pub(super) offset: usize,
    pub(super) expected: Cow<'static, str>,
    pub(super) found: String,
}

/// What the check of one row returns.
pub(super) type RowResult<T> = std::result::Result<T, Violation>;

/// The error that a row violates an invariant.
pub(super) fn violation<T>(
    code: Code,
    offset: usize,
    expected: impl Into<Cow<'static, str>>,
    found: impl Debug,
) -> RowResult<T> {
    Err(Violation { code, offset, expected: expected.into(), found: format!("{found:?}") })
}

/// A table of conditions about the fields of a row. The first that does not hold is the violation.
/// Each line has the code, the field whose byte the error names, the condition, what is expected,
/// and what is found.
macro_rules! check_fields {
    ($row:ty { $($code:ident $field:ident: $holds:expr, $expected:expr, $found:expr;)* }) => {
        $(if !($holds) {
            return $crate::check::rows::violation(
                $crate::error::Code::$code,
                ::std::mem::offset_of!($row, $field),
                $expected,
                $found,
            );
        })*
    };
}
pub(super) use check_fields;

/// Checks every row of a section of the whole file.
pub(super) fn check_rows<T>(kind: u32, rows: &[T], check: impl Fn(usize, &T) -> RowResult<()>) -> Result<()> {
    for (i, row) in rows.iter().enumerate() {
        check(i, row).map_err(|violation| violation.in_row::<T>(kind, i))?;
    }
    Ok(())
}

/// Checks every row of a section of an object.
pub(super) fn check_object_rows<T>(
    kind: u32,
    rows: &[T],
    check: impl Fn(usize, &T) -> RowResult<()>,
) -> Result<()> {
    for (i, row) in rows.iter().enumerate() {
        check(i, row).map_err(|v| {
            let offset = i * size_of::<T>() + v.offset;
            Error::within(v.code, kind, offset as u64, v.expected, v.found)
        })?;
    }
    Ok(())
}

/// Checks a condition that has to hold for every row of a section of an object.
pub(super) fn check_all<T: Debug>(
    code: Code,
    kind: u32,
    rows: &[T],
    holds: impl Fn(&T) -> bool,
    expected: impl Into<Cow<'static, str>>,
) -> Result<()> {
    match rows.iter().position(|row| !holds(row)) {
        None => Ok(()),
        Some(i) => {
            let (at, found) = ((i * size_of::<T>()) as u64, format!("{:?}", rows[i]));
            Err(Error::within(code, kind, at, expected, found))
        }
    }
}

/// Returns true if all numbers are finite.
pub(super) fn is_finite(numbers: &[f32]) -> bool {
    numbers.iter().all(|x| x.is_finite())
}

impl Violation {
    /// The violation as an error of a row of a section of the whole file.
    pub(super) fn in_row<T>(self, kind: u32, row: usize) -> Error {
        let offset = row * size_of::<T>() + self.offset;
        let found = format!("{} in row {row}", self.found);
        Error::within_file(self.code, kind, offset as u64, self.expected, found)
    }
}
