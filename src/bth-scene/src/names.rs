//! Names: unique within their table, and the lookup of references to them.

use crate::error::{Result, code};
use crate::limits::MAX_NAME;
use crate::table::{Table, Value};
use std::borrow::Cow;
use std::collections::HashMap;
use std::collections::hash_map::Entry;

/// The names of one table.
#[derive(Debug)]
pub(crate) struct Names<'a> {
    what: &'static str,
    rows: HashMap<Cow<'a, str>, usize>,
}

impl<'a> Names<'a> {
    pub(crate) fn new(what: &'static str) -> Self {
        Self { what, rows: HashMap::new() }
    }

    /// Collects the names of tables.
    pub(crate) fn collect(what: &'static str, tables: &[Table<'a>]) -> Result<Self> {
        let mut names = Self::new(what);
        for table in tables {
            names.add(table, Cow::Borrowed(table.need("name")?.string()?))?;
        }
        Ok(names)
    }

    /// Adds the name of the next table; fails on one that is empty or too long, holds control
    /// characters or is used twice.
    pub(crate) fn add(&mut self, table: &Table<'_>, name: Cow<'a, str>) -> Result<()> {
        let what = self.what;
        let error = |message: String, hint: &str| Err(table.need("name")?.error(code::NAME, message, hint));
        if name.is_empty() || name.chars().any(char::is_control) {
            return error("expected a name without control characters".to_owned(), "give it a name");
        }
        if name.len() > MAX_NAME {
            let message = format!("expected a name of at most {MAX_NAME} bytes, found {}", name.len());
            return error(message, "give it a shorter name");
        }
        let row = self.rows.len();
        match self.rows.entry(name) {
            Entry::Vacant(entry) => {
                entry.insert(row);
                Ok(())
            }
            Entry::Occupied(entry) => {
                let message = format!("the {what} \"{}\" is there already", entry.key());
                error(message, "give each one a name of its own")
            }
        }
    }

    /// The row that a value names.
    pub(crate) fn row(&self, value: &Value<'_>) -> Result<usize> {
        let name = value.string()?;
        self.rows.get(name).copied().ok_or_else(|| {
            let message = format!("there is no {} \"{name}\"", self.what);
            value.error(code::REFERENCE, message, format!("name one of the {}s of this manifest", self.what))
        })
    }
}
