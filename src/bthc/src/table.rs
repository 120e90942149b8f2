//! Plain text tables, and numbers, for people.

use bth_files::printable;
use comfy_table::{CellAlignment, ContentArrangement, presets};

/// Max columns of a table. Longer cells are wrapped.
const WIDTH: u16 = 100;

/// A table without lines, whose first column is aligned left and whose others are aligned right.
#[derive(Debug)]
pub(crate) struct Table(comfy_table::Table);

impl Default for Table {
    fn default() -> Self {
        let mut table = comfy_table::Table::new();
        table.load_preset(presets::NOTHING);
        table.set_content_arrangement(ContentArrangement::Dynamic).set_width(WIDTH);
        Self(table)
    }
}

impl Table {
    /// Adds a row.
    pub(crate) fn row<const N: usize>(&mut self, cells: [&str; N]) {
        self.0.add_row(cells.map(printable));
    }

    /// Adds a row with a count, unless that is 0.
    pub(crate) fn count(&mut self, name: &str, n: u64) {
        if n > 0 {
            self.row([name, &count(n)]);
        }
    }

    /// The text, without trailing blanks and without terminal codes.
    pub(crate) fn render(mut self) -> String {
        for (i, column) in self.0.column_iter_mut().enumerate() {
            let (left_padding, alignment) = match i {
                0 => (0, CellAlignment::Left),
                _ => (2, CellAlignment::Right),
            };
            column.set_padding((left_padding, 0)).set_cell_alignment(alignment);
        }
        let mut text = self.0.trim_fmt();
        if !text.is_empty() {
            text.push('\n');
        }
        text
    }
}

/// A count with thousands separated, such as `1,234,567`.
pub(crate) fn count(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::with_capacity(digits.len() + digits.len() / 3);
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Bytes with a binary unit, such as `3.4 MiB`.
pub(crate) fn bytes(n: u64) -> String {
    let mut value = n as f64;
    for unit in ["bytes", "KiB", "MiB"] {
        if value < 1024.0 {
            return if unit == "bytes" { format!("{n} bytes") } else { format!("{value:.1} {unit}") };
        }
        value /= 1024.0;
    }
    format!("{value:.2} GiB")
}

/// Seconds with milliseconds.
pub(crate) fn seconds(s: f64) -> String {
    format!("{s:.3} s")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_grouped_by_thousands() {
        for (n, text) in [(0, "0"), (999, "999"), (1000, "1,000"), (1_234_567, "1,234,567")] {
            assert_eq!(count(n), text);
        }
    }

    #[test]
    fn bytes_get_a_binary_unit() {
        assert_eq!(bytes(1023), "1023 bytes");
        assert_eq!(bytes(1536), "1.5 KiB");
        assert_eq!(bytes(3 << 30), "3.00 GiB");
    }

    #[test]
    fn first_column_is_left_aligned_and_the_others_right() {
        let mut table = Table::default();
        table.row(["stage", "s"]);
        table.row(["a", "12.5"]);
        assert_eq!(table.render(), "stage     s\na      12.5\n");
        assert_eq!(Table::default().render(), "");
    }

    #[test]
    fn long_cells_are_wrapped_and_wide_characters_are_aligned() {
        let mut table = Table::default();
        table.row(["name", &"words ".repeat(40)]);
        table.row(["日本", "22"]);
        table.count("nothing", 0);
        let text = table.render();
        let columns: Vec<usize> = text.lines().map(|line| line.chars().count()).collect();
        assert!(columns.len() == 4 && columns.iter().all(|columns| *columns <= 100), "{text}");
        // Two characters are twice as wide.
        assert!(text.ends_with("22\n") && columns[3] + 2 == columns[0], "{text}");
    }
}
