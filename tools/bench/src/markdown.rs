//! Markdown tables and numbers.

/// A table; the first column is aligned left, the others right.
pub fn table(head: &[String], rows: &[Vec<String>]) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let mut text = line(head);
    text.push_str("|---");
    for _ in 1..head.len() {
        text.push_str("|---:");
    }
    text.push_str("|\n");
    for row in rows {
        text.push_str(&line(row));
    }
    text
}

/// Cells of a row or of the head of a table.
pub fn cells(texts: &[&str]) -> Vec<String> {
    texts.iter().map(|text| (*text).to_owned()).collect()
}

/// A count with thousands separated: `1,234,567`.
pub fn count(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// A number in two decimals, or `-` for none.
pub fn two_decimals(value: Option<f64>) -> String {
    value.map_or("-".to_owned(), |v| format!("{v:.2}"))
}

/// A time in the unit that suits it: `0.42 ms`, `1.50 s`.
pub fn seconds(value: Option<f64>) -> String {
    match value {
        None => "-".to_owned(),
        Some(s) if s < 1e-3 => format!("{:.0} µs", s * 1e6),
        Some(s) if s < 1.0 => format!("{:.2} ms", s * 1e3),
        Some(s) => format!("{s:.2} s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_align_numbers_right() {
        let text = table(&cells(&["tracer", "ao"]), &[cells(&["bth", "1.00"])]);
        assert_eq!(text, "| tracer | ao |\n|---|---:|\n| bth | 1.00 |\n");
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!([0, 999, 1000, 1234567].map(count), ["0", "999", "1,000", "1,234,567"]);
        assert_eq!(two_decimals(None), "-");
        let times = [4.2e-5, 0.00345, 2.0].map(|s| seconds(Some(s)));
        assert_eq!(times, ["42 µs", "3.45 ms", "2.00 s"]);
    }
}
