//! Names: unique within their table, and the lookup of references to them.

use crate::error::{Result, code};
use crate::limits::MAX_NAME;
use crate::table::{Table, Value};
use std::collections::HashMap;

/// The names of one table.
#[derive(Debug)]
pub(crate) struct Names<'a> {
    what: &'static str,
    rows: HashMap<&'a str, usize>,
}

impl<'a> Names<'a> {
    /// Collects the names of tables; fails on one that is empty or too long, holds control
    /// characters or is used twice.
    pub(crate) fn collect(what: &'static str, tables: &[Table<'a>]) -> Result<Self> {
        let mut rows = HashMap::with_capacity(tables.len());
        for (row, table) in tables.iter().enumerate() {
            let value = table.need("name")?;
            let name = value.string()?;
            if name.is_empty() || name.chars().any(char::is_control) {
                let message = "expected a name without control characters";
                return Err(value.error(code::NAME, message, "give it a name"));
            }
            if name.len() > MAX_NAME {
                let message = format!("expected a name of at most {MAX_NAME} bytes, found {}", name.len());
                return Err(value.error(code::NAME, message, "give it a shorter name"));
            }
            if rows.insert(name, row).is_some() {
                let message = format!("the {what} \"{name}\" is there already");
                return Err(value.error(code::NAME, message, "give each one a name of its own"));
            }
        }
        Ok(Self { what, rows })
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
