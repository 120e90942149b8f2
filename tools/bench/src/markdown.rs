//! Markdown tables and numbers.

/// A table; the first column is aligned left, the others right.
pub(crate) fn table(head: &[String], rows: &[Vec<String>]) -> String {
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

/// A count with thousands separated: `1,234,567`.
pub(crate) fn count(n: u64) -> String {
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

/// Three significant digits. Large numbers keep all digits before the point; tiny ones have an
/// exponent.
pub(crate) fn short(x: f64) -> String {
    match x.abs() {
        size if size == 0.0 || !size.is_finite() => format!("{x}"),
        size if size < 1e-4 => format!("{x:.1e}"),
        size if size >= 1e4 => count(x.round() as u64),
        size => {
            let digits = (2 - size.log10().floor() as i32).clamp(0, 12) as usize;
            format!("{x:.digits$}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_align_numbers_right_and_numbers_are_short() {
        let text =
            table(&["tracer", "ao"].map(str::to_owned), &[["bth", "1.00"].map(str::to_owned).to_vec()]);
        assert_eq!(text, "| tracer | ao |\n|---|---:|\n| bth | 1.00 |\n");
        assert_eq!([0, 999, 1000, 1234567].map(count), ["0", "999", "1,000", "1,234,567"]);
        let numbers = [0.0, 1.0, 0.12345, 1234.5, 1234567.8, 5.07e-8].map(short);
        assert_eq!(numbers, ["0", "1.00", "0.123", "1234", "1,234,568", "5.1e-8"]);
    }
}
