//! Numbers, words and lines of text sources.

/// Parses a number; `None` if the word is none. What some C libraries write for numbers that are not finite, such as
/// `-nan(ind)` and `1.#INF`, becomes NaN, so that it is an error only where a face uses it.
#[inline]
pub(super) fn float<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    let text = std::str::from_utf8(word).ok()?;
    text.parse().ok().or_else(|| foreign_nan(text)?.parse().ok())
}

#[cold]
fn foreign_nan(text: &str) -> Option<&'static str> {
    let text = text.trim_start_matches(['-', '+']).to_ascii_lowercase();
    (text.starts_with("1.#") || text.starts_with("nan(")).then_some("nan")
}

/// Parses a decimal integer; `None` if the word is none or has more than 18 digits.
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
    /// Lines of a text, numbered from 1. The first one begins behind the byte order mark, if there is one; [`Self::position`]
    /// counts its bytes.
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
