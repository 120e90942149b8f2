//! Parsers of values that several options share.

/// A share given in percent, such as `1%`, as a fraction.
pub(super) fn share(text: &str) -> Result<f64, String> {
    let number = text.strip_suffix('%').and_then(|n| n.trim().parse::<f64>().ok());
    number
        .filter(|p| (0.0..100.0).contains(p))
        .map(|p| p / 100.0)
        .ok_or_else(|| "expected a share such as 1%".to_owned())
}

/// A part of a file's name, which names no other folder.
pub(super) fn file_name(text: &str) -> Result<String, String> {
    let is_name = !text.is_empty() && !text.contains(|c| std::path::is_separator(c) || c.is_control());
    is_name.then(|| text.to_owned()).ok_or_else(|| "expected a name, without folders".to_owned())
}

/// A whole number from 1.
pub(super) fn at_least_one(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|n| *n > 0).ok_or_else(|| "expected a number from 1".to_owned())
}

/// A finite number above 0.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x: &f64| x.is_finite() && *x > 0.0);
    number.ok_or_else(|| "expected a finite number above 0".to_owned())
}
