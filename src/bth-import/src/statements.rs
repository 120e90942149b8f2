//! Statements of OBJ files and material libraries: a line each, and the names in them.

use crate::number::{Lines, words};
use std::borrow::Cow;

/// The words of a name, with single spaces between them, as [`text`] reads them. Names go on to the
/// end of the line, and a word such as `#12` belongs to them, as other readers have it (Blender, tinyobjloader). Only `#` as
/// a word of its own begins a comment.
pub(crate) fn name<'w>(words: impl Iterator<Item = &'w [u8]>) -> String {
    let words: Vec<_> = words.take_while(|word| *word != b"#").collect();
    text(words.join(&b' '))
}

/// The name of a file, which some programs write in double quotes.
pub(crate) fn file_name<'w>(words: impl Iterator<Item = &'w [u8]>) -> String {
    let name = name(words);
    let within = name.strip_prefix('"').and_then(|rest| rest.strip_suffix('"'));
    within.filter(|within| !within.contains('"')).map_or_else(|| name.clone(), str::to_owned)
}

/// What the bytes 0x80 to 0x9F stand for in Windows-1252; those that stand for nothing are control characters.
const WINDOWS_1252: &str = "€\u{81}‚ƒ„…†‡ˆ‰Š‹Œ\u{8D}Ž\u{8F}\u{90}‘’“”•–—˜™š›œ\u{9D}žŸ";

/// The text of bytes: UTF-8, or else Windows-1252. That gives different bytes different text whatever they mean, so that names in any
/// encoding are told apart.
pub(crate) fn text(bytes: Vec<u8>) -> String {
    let character = |byte: &u8| match byte {
        0x80..0xA0 => WINDOWS_1252.chars().nth(usize::from(byte - 0x80)).unwrap_or_default(),
        _ => char::from(*byte),
    };
    String::from_utf8(bytes).unwrap_or_else(|e| e.as_bytes().iter().map(character).collect())
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
