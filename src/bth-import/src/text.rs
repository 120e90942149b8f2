//! Numbers, words, names, lines and statements of text sources.

use std::borrow::Cow;
use std::str::FromStr;

/// Parses a number; `None` for other words. What some C libraries write for numbers that are not
/// finite, such as `-nan(ind)` and `1.#INF`, becomes NaN, so that it is an error only where a face
/// uses it.
#[inline]
pub(super) fn float<T: FromStr>(word: &[u8]) -> Option<T> {
    let text = std::str::from_utf8(word).ok()?;
    text.parse().ok().or_else(|| foreign_nan(text)?.parse().ok())
}

#[cold]
fn foreign_nan(text: &str) -> Option<&'static str> {
    let text = text.trim_start_matches(['-', '+']).to_ascii_lowercase();
    (text.starts_with("1.#") || text.starts_with("nan(")).then_some("nan")
}

/// Parses three numbers; the error is the first word that is not a number.
#[inline]
pub(super) fn point<'w, T: FromStr + Default + Copy>(
    words: &mut impl Iterator<Item = &'w [u8]>,
) -> Result<[T; 3], &'w [u8]> {
    let mut point = [T::default(); 3];
    for x in &mut point {
        let word = words.next().unwrap_or_default();
        *x = float(word).ok_or(word)?;
    }
    Ok(point)
}

/// Parses a count; `None` if the word is not one.
pub(super) fn count(word: &[u8]) -> Option<u64> {
    u64::try_from(integer(word)?).ok()
}

/// Parses a decimal integer; `None` for other words and for more than 18 digits.
#[inline]
pub(super) fn integer(word: &[u8]) -> Option<i64> {
    let (negative, digits) = match word {
        [b'-', digits @ ..] => (true, digits),
        [b'+', digits @ ..] => (false, digits),
        digits => (false, digits),
    };
    if digits.is_empty() || digits.len() > 18 {
        return None;
    }
    let mut value = 0i64;
    for digit in digits {
        if !digit.is_ascii_digit() {
            return None;
        }
        value = value * 10 + i64::from(digit - b'0');
    }
    Some(if negative { -value } else { value })
}

/// The words of a line, which white space separates.
#[inline]
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(|c| c.is_ascii_whitespace()).filter(|word| !word.is_empty())
}

/// A word as it is shown in a message: valid UTF-8, escaped, and at most 40 bytes of it.
pub(super) fn shown(word: &[u8]) -> String {
    let cut = &word[..word.len().min(40)];
    String::from_utf8_lossy(cut).escape_debug().to_string()
}

/// The characters of the bytes 0x80 to 0x9F in Windows-1252. Bytes without one are control
/// characters.
const WINDOWS_1252: &str = "€\u{81}‚ƒ„…†‡ˆ‰Š‹Œ\u{8D}Ž\u{8F}\u{90}‘’“”•–—˜™š›œ\u{9D}žŸ";

/// Reads bytes as UTF-8, or else as Windows-1252. That gives different bytes different text, so
/// that names in any encoding are told apart.
pub(super) fn text(bytes: Vec<u8>) -> String {
    let character = |byte: &u8| match byte {
        0x80..0xA0 => WINDOWS_1252.chars().nth(usize::from(byte - 0x80)).unwrap_or_default(),
        _ => char::from(*byte),
    };
    String::from_utf8(bytes).unwrap_or_else(|e| e.as_bytes().iter().map(character).collect())
}

/// What some editors write at the start of UTF-8 text: U+FEFF, the byte order mark.
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// A text without the byte order mark at its start, if there is one.
pub(super) fn without_mark(data: &[u8]) -> &[u8] {
    data.strip_prefix(BYTE_ORDER_MARK).unwrap_or(data)
}

/// Lines of a text with their numbers. LF, CR LF and CR end a line.
pub(super) struct Lines<'a> {
    data: &'a [u8],
    at: usize,
    number: u64,
}

impl<'a> Lines<'a> {
    /// Lines of a text, numbered from 1. The first one begins behind the byte order mark, if there
    /// is one; [`Self::position`] counts its bytes.
    pub(super) fn new(data: &'a [u8]) -> Self {
        Lines::after(data, data.len() - without_mark(data).len(), 0)
    }

    /// Lines from byte `at` on, which `number` lines precede.
    pub(super) fn after(data: &'a [u8], at: usize, number: u64) -> Self {
        Lines { data, at, number }
    }

    /// The byte after the last line that the iterator returned.
    pub(super) fn position(&self) -> usize {
        self.at
    }

    /// The number of the last line that the iterator returned.
    pub(super) fn number(&self) -> u64 {
        self.number
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (u64, &'a [u8]);

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        let rest = self.data.get(self.at..).filter(|rest| !rest.is_empty())?;
        let end = rest.iter().position(|&c| c == b'\n' || c == b'\r').unwrap_or(rest.len());
        let newline = match &rest[end..] {
            [b'\r', b'\n', ..] => 2,
            [] => 0,
            _ => 1,
        };
        self.at += end + newline;
        self.number += 1;
        Some((self.number, &rest[..end]))
    }
}

/// Returns the words of a name, with single spaces between them, as [`text`] reads them. A name
/// ends at the end of the line, and a word such as `#12` belongs to it, as in other readers
/// (Blender, tinyobjloader). Only a single `#` as a word begins a comment.
pub(super) fn name<'w>(words: impl Iterator<Item = &'w [u8]>) -> String {
    let words: Vec<_> = words.take_while(|word| *word != b"#").collect();
    text(words.join(&b' '))
}

/// The name of a file, which some programs write in double quotes.
pub(super) fn file_name<'w>(words: impl Iterator<Item = &'w [u8]>) -> String {
    let name = name(words);
    let within = name.strip_prefix('"').and_then(|rest| rest.strip_suffix('"'));
    within.filter(|within| !within.contains('"')).map_or_else(|| name.clone(), str::to_owned)
}

/// The statements of a text with the numbers of their first lines, as [`next_statement`] joins
/// them.
pub(super) fn statements(data: &[u8]) -> impl Iterator<Item = (u64, Cow<'_, [u8]>)> {
    let mut lines = Lines::new(data);
    std::iter::from_fn(move || next_statement(&mut lines))
}

/// Returns true if a line goes on in the next one: it ends in a backslash that is not in a comment.
fn goes_on(line: &[u8]) -> bool {
    line.last() == Some(&b'\\') && !words(line).next().is_some_and(|word| word.starts_with(b"#"))
}

/// The next line and its number. While a line ends in a backslash, the following line is joined to
/// it, but for lines that are comments.
#[inline]
pub(super) fn next_statement<'a>(lines: &mut Lines<'a>) -> Option<(u64, Cow<'a, [u8]>)> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_at_any_newline_and_keep_their_numbers() {
        let lines: Vec<_> = Lines::new(b"a\r\nb\rc\n\nd").collect();
        assert_eq!(lines, [(1, &b"a"[..]), (2, b"b"), (3, b"c"), (4, b""), (5, b"d")]);
        assert_eq!(Lines::new(b"").next(), None);
        let mut marked = Lines::new(b"\xEF\xBB\xBFa\n\xEF\xBB\xBFb");
        assert_eq!((marked.next(), marked.position()), (Some((1, &b"a"[..])), 5));
        assert_eq!(marked.next(), Some((2, &b"\xEF\xBB\xBFb"[..])));
    }

    #[test]
    fn integers_are_decimal_and_bounded() {
        assert_eq!(integer(b"-12"), Some(-12));
        assert_eq!(integer(b"+7"), Some(7));
        for bad in [&b""[..], b"-", b"1.0", b"9999999999999999999", b"1a"] {
            assert_eq!(integer(bad), None);
        }
    }

    #[test]
    fn floats_read_leading_dots_exponents_and_foreign_nans() {
        assert_eq!(float::<f32>(b".8e-001"), Some(0.08));
        assert_eq!(float::<f32>(b"-.7e+2"), Some(-70.0));
        for nan in [&b"nan"[..], b"-nan", b"1.#IND", b"-1.#QNAN", b"-nan(ind)"] {
            assert!(float::<f32>(nan).unwrap().is_nan());
        }
        assert_eq!(float::<f32>(b"1e300"), Some(f32::INFINITY));
        assert_eq!(float::<f32>(b"1,5"), None);
    }
}
