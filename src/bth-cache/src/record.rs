//! The record of a key, which names its content: a line of JSON and a line with its hash.

use crate::{Digest, Key};
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// The content of a key, and the report of the stage that made it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// The key.
    #[serde(flatten)]
    pub key: Key,
    /// BLAKE3 of the content; for a content that is not kept, a hash that determines it.
    pub blob: Digest,
    /// Bytes of the content.
    pub bytes: u64,
    /// True if the content itself is kept; else it is put together from other entries when it is
    /// needed.
    pub whole: bool,
    /// The report of the stage.
    pub report: Value,
}

impl Record {
    pub(crate) fn to_text(&self) -> std::io::Result<String> {
        Ok(seal(serde_json::to_string(self)?))
    }

    /// The record of a key; `Err` describes the damage.
    pub(crate) fn from_text(text: &[u8], id: &Digest) -> Result<Self, &'static str> {
        let record: Self =
            serde_json::from_str(unseal(text)?).map_err(|_| "the record is none of this version")?;
        if record.key.id() != *id {
            return Err("the record is that of another key");
        }
        Ok(record)
    }
}

/// Text and its hash; the text is one line.
pub(crate) fn seal(mut line: String) -> String {
    line.push('\n');
    let hash = Digest::of(line.as_bytes()).hex();
    line + &hash + "\n"
}

/// The text that was sealed; fails when any byte was changed, added or lost.
pub(crate) fn unseal(text: &[u8]) -> Result<&str, &'static str> {
    const DAMAGED: &str = "its bytes do not have the hash that they should have";
    let text = std::str::from_utf8(text).map_err(|_| DAMAGED)?;
    let end = text.find('\n').ok_or(DAMAGED)? + 1;
    let (line, hash) = text.split_at(end);
    if hash.strip_suffix('\n') != Some(Digest::of(line.as_bytes()).hex().as_str()) {
        return Err(DAMAGED);
    }
    Ok(line)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record() -> Record {
        let report = serde_json::json!({"nodes": 3, "names": ["a\nb", "ü"], "share": 0.1});
        Record {
            key: Key::new("bvh").with("x", "1"),
            blob: Digest::of(b"abc"),
            bytes: 3,
            whole: true,
            report,
        }
    }

    #[test]
    fn every_changed_added_or_lost_byte_is_noticed() {
        let text = record().to_text().unwrap().into_bytes();
        let id = record().key.id();
        assert_eq!(Record::from_text(&text, &id).unwrap(), record());
        for at in 0..text.len() {
            for flip in [1, 0x20, 0x80] {
                let mut other = text.clone();
                other[at] ^= flip;
                assert!(Record::from_text(&other, &id).is_err(), "byte {at}");
            }
            assert!(Record::from_text(&text[..at], &id).is_err());
        }
        assert!(Record::from_text(&[&text[..], b"\n"].concat(), &id).is_err());
        assert!(Record::from_text(&text, &Digest::of(b"other")).is_err());
    }
}
