//! Text as a terminal may show it.

use std::borrow::Cow;
use std::fmt::Write;

/// Text with its control characters, but for line feeds, as escapes such as `\u{1b}`: names come
/// from files of others and must not move the cursor or change colours.
pub fn printable(text: &str) -> Cow<'_, str> {
    let is_control = |c: char| c.is_control() && c != '\n';
    if !text.contains(is_control) {
        return Cow::Borrowed(text);
    }
    let mut escaped = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if is_control(c) {
            // Writing to a string cannot fail.
            let _ = write!(escaped, "{}", c.escape_debug());
        } else {
            escaped.push(c);
        }
    }
    Cow::Owned(escaped)
}

#[cfg(test)]
mod tests {
    use super::printable;

    #[test]
    fn control_characters_are_escaped_and_all_else_stays() {
        assert_eq!(printable("a\u{1b}[31m\r\t\0b\u{9b}c\u{7f}"), "a\\u{1b}[31m\\r\\t\\0b\\u{9b}c\\u{7f}");
        assert_eq!(printable("Türe \"a\\b\"\nсцена"), "Türe \"a\\b\"\nсцена");
    }
}
