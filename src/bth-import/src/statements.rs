//! Statements of OBJ files and material libraries: a line each, and the names in them.

use crate::number::{Lines, words};
use std::borrow::Cow;

/// The words of a name, with single spaces between them. Bytes that are not UTF-8 become the replacement character. Names go on to the
/// end of the line, and a word such as `#12` belongs to them, as other readers have it (Blender, tinyobjloader). Only `#` as
/// a word of its own begins a comment.
pub(crate) fn name<'w>(words: impl Iterator<Item = &'w [u8]>) -> String {
    let words: Vec<_> = words.take_while(|word| *word != b"#").map(String::from_utf8_lossy).collect();
    words.join(" ")
}

/// The statements of a text with the numbers of their first lines, as [`next_statement`] joins them.
pub(crate) fn statements(data: &[u8]) -> impl Iterator<Item = (u64, Cow<'_, [u8]>)> {
    let mut lines = Lines::new(data);
    std::iter::from_fn(move || next_statement(&mut lines))
}

/// Whether a line goes on in the next one: it ends in a backslash that is not in a comment.
fn goes_on(line: &[u8]) -> bool {
    line.last() == Some(&b'\\') && !words(line).next().is_some_and(|word| word.starts_with(b"#"))
}

/// The next line and its number. While a line ends in a backslash, the following line is joined to it, but for lines that are comments.
#[inline]
pub(crate) fn next_statement<'a>(lines: &mut Lines<'a>) -> Option<(u64, Cow<'a, [u8]>)> {
    let (number, line) = lines.next()?;
    if !goes_on(line) {
        return Some((number, Cow::Borrowed(line)));
    }
    let mut joined = line.to_vec();
    let mut open = true;
    while open {
        joined.pop();
        joined.push(b' ');
        let next = lines.next().map_or(&b""[..], |(_, line)| line);
        joined.extend_from_slice(next);
        open = goes_on(next);
    }
    Some((number, Cow::Owned(joined)))
}
