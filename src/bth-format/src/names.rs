//! Names in a section of text.

use crate::limits::MAX_NAME;

/// The name of `length` bytes from `first` on; `None` when it does not lie within the text or is
/// not UTF-8, which the checks rule out (BTH-F144, BTH-F148, BTH-F153).
pub(crate) fn name(text: &[u8], first: u32, length: u32) -> Option<&str> {
    let end = (first as usize).checked_add(length as usize)?;
    std::str::from_utf8(text.get(first as usize..end)?).ok()
}

/// The part of a section of text in which names can lie: all before the first byte that is not
/// UTF-8. Found once, so that checking all names costs no more than the bytes of the section and
/// the rows, however names overlap.
#[inline(never)]
pub(crate) fn checked(text: &[u8]) -> &str {
    let valid = std::str::from_utf8(text).map_or_else(|error| error.valid_up_to(), str::len);
    text.get(..valid).and_then(|text| std::str::from_utf8(text).ok()).unwrap_or_default()
}

/// Returns true if the bytes from `first` on are a name of an allowed length, given the [`checked`]
/// text of the section.
#[inline(never)]
pub(crate) fn is_name(text: &str, first: u32, length: u32) -> bool {
    let end = (first as usize).checked_add(length as usize);
    length <= MAX_NAME && end.is_some_and(|end| text.get(first as usize..end).is_some())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lie_between_characters_before_the_first_byte_that_is_not_utf_8() {
        let text = checked(b"a\xc3\xa4b\xffcd");
        assert_eq!(text, "a\u{e4}b");
        for (first, length, is) in [
            (0, 4, true),
            (1, 2, true),
            (1, 1, false),
            (2, 1, false),
            (4, 0, true),
            (3, 2, false),
            (5, 1, false),
        ] {
            assert_eq!(is_name(text, first, length), is, "{first} {length}");
        }
        assert!(!is_name(text, u32::MAX, u32::MAX));
        let long = "x".repeat(MAX_NAME as usize + 1);
        assert!(is_name(&long, 0, MAX_NAME) && !is_name(&long, 0, MAX_NAME + 1));
    }
}
