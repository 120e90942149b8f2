//! Names: unique within their table, and the lookup of references to them.

use crate::error::{Result, code};
use crate::limits::MAX_NAME;
use crate::table::{Table, Value};

/// The names of one table. There may be many millions, so each takes few bytes.
#[derive(Debug)]
pub(crate) struct Names {
    what: &'static str,
    /// All names, one behind the other.
    text: String,
    /// Where each name ends.
    ends: Vec<u64>,
    /// The rows in the order of their names.
    order: Vec<u32>,
}

impl Names {
    /// The names of `count` tables; `with` calls what it is given with the table of a row. Fails on
    /// a name that is empty or too long, holds control characters or is used twice.
    pub(crate) fn of(
        what: &'static str,
        count: usize,
        mut with: impl FnMut(usize, &mut dyn FnMut(&Table<'_>) -> Result<()>) -> Result<()>,
    ) -> Result<Self> {
        let mut names =
            Self { what, text: String::new(), ends: Vec::with_capacity(count), order: Vec::new() };
        for row in 0..count {
            with(row, &mut |table| names.add(table))?;
        }
        let mut order: Vec<u32> = (0..count as u32).collect();
        order.sort_unstable_by(|a, b| names.name(*a).cmp(names.name(*b)).then(a.cmp(b)));
        names.order = order;
        let twice = names.order.windows(2).filter(|rows| names.name(rows[0]) == names.name(rows[1]));
        if let Some(row) = twice.map(|rows| rows[1]).min() {
            with(row as usize, &mut |table| {
                let message = format!("the {what} \"{}\" is there already", names.name(row));
                Err(table.need("name")?.error(code::NAME, message, "give each one a name of its own"))
            })?;
        }
        Ok(names)
    }

    /// The names of tables.
    pub(crate) fn collect(what: &'static str, tables: &[Table<'_>]) -> Result<Self> {
        Self::of(what, tables.len(), |row, read| read(&tables[row]))
    }

    fn add(&mut self, table: &Table<'_>) -> Result<()> {
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
        self.text.push_str(name);
        self.ends.push(self.text.len() as u64);
        Ok(())
    }

    fn name(&self, row: u32) -> &str {
        let first = row.checked_sub(1).map_or(0, |before| self.ends[before as usize]);
        &self.text[first as usize..self.ends[row as usize] as usize]
    }

    /// The row that a value names.
    pub(crate) fn row(&self, value: &Value<'_>) -> Result<usize> {
        let name = value.string()?;
        let found = self.order.binary_search_by(|row| self.name(*row).cmp(name));
        found.map(|at| self.order[at] as usize).map_err(|_| {
            let message = format!("there is no {} \"{name}\"", self.what);
            value.error(code::REFERENCE, message, format!("name one of the {}s of this manifest", self.what))
        })
    }
}
