//! URIs of glTF buffers: files next to the document and data: URIs (glTF 2.0 specification, §2.8).

use std::path::{self, Path, PathBuf};

use crate::text::shown;

/// Returns the file that a relative URI names; `None` for other URIs.
pub(super) fn beside(document: &Path, uri: &str) -> Option<PathBuf> {
    let name = decode_percent(uri)?;
    let relative = Path::new(&name);
    let is_relative = !name.is_empty()
        && !uri.contains(':')
        && !relative.components().any(|c| matches!(c, path::Component::RootDir | path::Component::Prefix(_)));
    is_relative.then(|| document.parent().unwrap_or(Path::new("")).join(relative))
}

/// Returns why [`next to`] finds no file: what was expected and found, and a hint.
pub(super) fn refusal(uri: &str) -> (String, &'static str) {
    let found = shown(uri.as_bytes());
    match decode_percent(uri) {
        None => (
            format!(
                "expected percent escapes of two hexadecimal digits that stand for UTF-8, found \"{found}\""
            ),
            "write a percent sign in a name as %25",
        ),
        Some(_) => (
            format!("expected a relative file name or a data: URI, found \"{found}\""),
            "put the file beside the model and refer to it by its name",
        ),
    }
}

/// Decodes percent escapes (RFC 3986, §2.1); `None` if that is malformed or the result is not
/// UTF-8.
fn decode_percent(uri: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [first, tail @ ..] = rest {
        rest = tail;
        bytes.push(match (first, tail) {
            (b'%', [high, low, tail @ ..]) => {
                rest = tail;
                let digit = |c: &u8| (*c as char).to_digit(16);
                (digit(high)? * 16 + digit(low)?) as u8
            }
            (b'%', _) => return None,
            _ => *first,
        });
    }
    String::from_utf8(bytes).ok()
}

/// Returns the bytes of a `data:` URI; `None` if they are not in base64.
pub(super) fn decode_data(uri: &str) -> Option<Vec<u8>> {
    decode_base64(uri.split_once(";base64,")?.1.as_bytes())
}

/// Decodes base64 (RFC 4648, §4 and §5), with or without padding.
fn decode_base64(text: &[u8]) -> Option<Vec<u8>> {
    let text = text.trim_ascii();
    let text = text.strip_suffix(b"==").or_else(|| text.strip_suffix(b"=")).unwrap_or(text);
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3 + 2);
    for group in text.chunks(4) {
        let mut bits = 0u32;
        for c in group {
            let value = match c {
                b'A'..=b'Z' => c - b'A',
                b'a'..=b'z' => c - b'a' + 26,
                b'0'..=b'9' => c - b'0' + 52,
                b'+' | b'-' => 62,
                b'/' | b'_' => 63,
                _ => return None,
            };
            bits = bits << 6 | u32::from(value);
        }
        let decoded = (bits << (6 * (4 - group.len()))).to_be_bytes();
        bytes.extend_from_slice(match group.len() {
            4 => &decoded[1..4],
            3 => &decoded[1..3],
            2 => &decoded[1..2],
            _ => return None,
        });
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_follows_the_vectors_of_rfc_4648() {
        for (text, bytes) in [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYg", "foob"),
            ("Zm9vYmFy", "foobar"),
        ] {
            assert_eq!(decode_base64(text.as_bytes()).as_deref(), Some(bytes.as_bytes()));
        }
        assert_eq!(decode_base64(b"Zm9v!A=="), None);
        assert_eq!(decode_base64(b"Z"), None);
    }

    #[test]
    fn percent_escapes_are_decoded() {
        assert_eq!(decode_percent("a%20b%C3%A9.bin").as_deref(), Some("a b\u{e9}.bin"));
        assert_eq!(decode_percent("a%2"), None);
        assert_eq!(decode_percent("a%zz"), None);
    }
}
