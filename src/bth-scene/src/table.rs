//! TOML tables and values, read strictly, with their places in the text for errors.

use crate::error::{Error, Result, code};
use std::ops::Range;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The text of a manifest and its path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Document<'a> {
    pub(crate) path: &'a Path,
    /// The whole text.
    pub(crate) text: &'a str,
    /// Where pieces of what is parsed begin, there and in the whole text.
    pub(crate) pieces: &'a [(usize, usize)],
}

impl Document<'_> {
    /// Parses a part of the text.
    pub(crate) fn parse<'t>(&self, part: &'t str) -> Result<Spanned<DeTable<'t>>> {
        DeTable::parse(part).map_err(|e| {
            let message = e.message().trim_end().replace('\n', "; ");
            self.error(e.span().unwrap_or(0..0), code::SYNTAX, message, "correct the TOML there")
        })
    }

    /// An error at a range of bytes.
    pub(crate) fn error(
        &self,
        at: Range<usize>,
        code: &'static str,
        message: impl Into<String>,
        hint: impl Into<String>,
    ) -> Error {
        let piece = self.pieces.partition_point(|(start, _)| *start <= at.start);
        let (there, here) = piece.checked_sub(1).map_or((0, 0), |piece| self.pieces[piece]);
        let before = self.text.get(..here + at.start - there).unwrap_or(self.text);
        let line_start = before.rfind('\n').map_or(0, |i| i + 1);
        Error {
            code,
            path: self.path.to_owned(),
            line: before.matches('\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
            message: message.into(),
            hint: hint.into(),
        }
    }
}

/// A table whose keys are all known.
#[derive(Clone, Debug)]
pub(crate) struct Table<'a> {
    doc: Document<'a>,
    entries: &'a DeTable<'a>,
    span: Range<usize>,
    keys: &'static [&'static str],
}

impl<'a> Table<'a> {
    /// Fails on keys that are not among `keys`.
    pub(crate) fn new(
        doc: Document<'a>,
        entries: &'a DeTable<'a>,
        span: Range<usize>,
        keys: &'static [&'static str],
    ) -> Result<Self> {
        for (key, _) in entries.iter() {
            if !keys.contains(&key.get_ref().as_ref()) {
                let message = format!("unknown key `{}`", key.get_ref());
                let hint = format!("the keys here are {}", keys.join(", "));
                return Err(doc.error(key.span(), code::UNKNOWN_KEY, message, hint));
            }
        }
        Ok(Self { doc, entries, span, keys })
    }

    /// The value of a key, if the table has it.
    pub(crate) fn get(&self, key: &'static str) -> Option<Value<'a>> {
        debug_assert!(self.keys.contains(&key), "{key} is not in the list of keys");
        self.entries.get(key).map(|value| Value { doc: self.doc, key, value })
    }

    /// The value of a required key.
    pub(crate) fn need(&self, key: &'static str) -> Result<Value<'a>> {
        self.get(key).ok_or_else(|| {
            self.error(code::MISSING_KEY, format!("the key `{key}` is missing"), "add it".to_owned())
        })
    }

    /// The elements of an array of tables, if there is one.
    pub(crate) fn tables(&self, key: &'static str, keys: &'static [&'static str]) -> Result<Vec<Table<'a>>> {
        let Some(array) = self.get(key) else { return Ok(Vec::new()) };
        array.array()?.iter().map(|v| v.table(keys)).collect()
    }

    /// An error about the table as a whole.
    pub(crate) fn error(
        &self,
        code: &'static str,
        message: impl Into<String>,
        hint: impl Into<String>,
    ) -> Error {
        self.doc.error(self.span.clone(), code, message, hint)
    }

    /// Fails when the table has both keys.
    pub(crate) fn exclude(&self, a: &'static str, b: &'static str) -> Result<()> {
        match (self.get(a), self.get(b)) {
            (Some(_), Some(value)) => Err(value.error(
                code::CONFLICT,
                format!("`{a}` and `{b}` exclude each other"),
                "keep one of them",
            )),
            _ => Ok(()),
        }
    }
}

/// A value, with its key.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Value<'a> {
    doc: Document<'a>,
    key: &'static str,
    value: &'a Spanned<DeValue<'a>>,
}

impl<'a> Value<'a> {
    /// An error at this value.
    pub(crate) fn error(
        &self,
        code: &'static str,
        message: impl Into<String>,
        hint: impl Into<String>,
    ) -> Error {
        self.doc.error(self.value.span(), code, message, hint)
    }

    fn wrong_type(&self, expected: &str) -> Error {
        let found = self.value.get_ref().type_str();
        self.error(
            code::TYPE,
            format!("expected {expected} for `{}`, found a value of type {found}", self.key),
            format!("write {expected}"),
        )
    }

    /// An error for a value that is not allowed.
    pub(crate) fn not_allowed(&self, expected: &str, found: impl std::fmt::Display) -> Error {
        self.error(
            code::VALUE,
            format!("expected {expected} for `{}`, found {found}", self.key),
            format!("write {expected}"),
        )
    }

    pub(crate) fn is_string(&self) -> bool {
        self.value.get_ref().is_str()
    }

    pub(crate) fn is_table(&self) -> bool {
        self.value.get_ref().is_table()
    }

    pub(crate) fn is_array(&self) -> bool {
        self.value.get_ref().is_array()
    }

    pub(crate) fn string(&self) -> Result<&'a str> {
        self.value.get_ref().as_str().ok_or_else(|| self.wrong_type("a string"))
    }

    pub(crate) fn boolean(&self) -> Result<bool> {
        self.value.get_ref().as_bool().ok_or_else(|| self.wrong_type("true or false"))
    }

    pub(crate) fn integer(&self, range: std::ops::RangeInclusive<i64>) -> Result<i64> {
        let value = self.value.get_ref().as_integer().ok_or_else(|| self.wrong_type("a whole number"))?;
        let number = i64::from_str_radix(value.as_str(), value.radix()).ok();
        number.filter(|n| range.contains(n)).ok_or_else(|| {
            let expected = format!("a whole number from {} to {}", range.start(), range.end());
            self.not_allowed(&expected, value)
        })
    }

    /// A finite number.
    pub(crate) fn number(&self) -> Result<f64> {
        let (parsed, text) = match self.value.get_ref() {
            DeValue::Float(f) => (f.as_str().parse::<f64>().ok(), f.to_string()),
            DeValue::Integer(i) => {
                (i64::from_str_radix(i.as_str(), i.radix()).ok().map(|n| n as f64), i.to_string())
            }
            _ => return Err(self.wrong_type("a number")),
        };
        parsed.filter(|n| n.is_finite()).ok_or_else(|| self.not_allowed("a finite number", text))
    }

    /// A finite number that satisfies a condition; `expected` describes it.
    pub(crate) fn number_that(&self, expected: &str, holds: impl Fn(f64) -> bool) -> Result<f64> {
        let number = self.number()?;
        if holds(number) { Ok(number) } else { Err(self.not_allowed(expected, number)) }
    }

    pub(crate) fn array(&self) -> Result<Vec<Value<'a>>> {
        let array = self.value.get_ref().as_array().ok_or_else(|| self.wrong_type("an array"))?;
        Ok(array.iter().map(|value| Value { value, ..*self }).collect())
    }

    /// An array of `N` finite numbers.
    pub(crate) fn numbers<const N: usize>(&self) -> Result<[f64; N]> {
        let mut numbers = [0.0; N];
        numbers.copy_from_slice(&self.numbers_of(N)?);
        Ok(numbers)
    }

    /// An array of a number of finite numbers.
    pub(crate) fn numbers_of(&self, count: usize) -> Result<Vec<f64>> {
        let array = self.array()?;
        if array.len() != count {
            return Err(self.not_allowed(&format!("{count} numbers"), array.len()));
        }
        array.iter().map(Value::number).collect()
    }

    /// Rows of a matrix that is applied to columns (x, y, z, 1).
    pub(crate) fn matrix(&self) -> Result<[[f64; 4]; 3]> {
        let rows = self.array()?;
        if rows.len() != 3 {
            return Err(self.not_allowed("three rows of four numbers", format!("{} rows", rows.len())));
        }
        let mut matrix = [[0.0; 4]; 3];
        for (row, value) in matrix.iter_mut().zip(&rows) {
            *row = value.numbers()?;
        }
        Ok(matrix)
    }

    /// A table whose keys are all known.
    pub(crate) fn table(&self, keys: &'static [&'static str]) -> Result<Table<'a>> {
        let entries = self.value.get_ref().as_table().ok_or_else(|| self.wrong_type("a table"))?;
        Table::new(self.doc, entries, self.value.span(), keys)
    }

    /// One of some words.
    pub(crate) fn choice<T: Copy>(&self, words: &[(&str, T)]) -> Result<T> {
        let word = self.string()?;
        words.iter().find(|(name, _)| *name == word).map(|(_, value)| *value).ok_or_else(|| {
            let names: Vec<_> = words.iter().map(|(name, _)| *name).collect();
            self.not_allowed(&format!("one of {}", names.join(", ")), format!("\"{word}\""))
        })
    }
}
