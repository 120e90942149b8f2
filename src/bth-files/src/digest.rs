//! BLAKE3 of contents.

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::io::{Read, Write};

/// Inputs of at least this many bytes are hashed by several threads.
const PARALLEL: usize = 1 << 20;
/// Initial capacity of the read buffer; many files are smaller.
const FIRST: usize = 1 << 16;

/// A BLAKE3 hash.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Digest([u8; 32]);

impl Digest {
    /// The hash of some bytes.
    pub fn of(bytes: &[u8]) -> Self {
        let mut hasher = blake3::Hasher::new();
        update(&mut hasher, bytes);
        Self(*hasher.finalize().as_bytes())
    }

    /// The hash of all that a reader gives, and the number of bytes.
    ///
    /// # Errors
    /// Those of the reader.
    pub fn of_reader(mut reader: impl Read) -> std::io::Result<(Self, u64)> {
        let mut hasher = blake3::Hasher::new();
        let mut buffer = Vec::with_capacity(FIRST);
        let mut total = 0;
        loop {
            buffer.clear();
            let filled = reader.by_ref().take(PARALLEL as u64).read_to_end(&mut buffer)?;
            update(&mut hasher, &buffer);
            total += filled as u64;
            if filled < PARALLEL {
                return Ok((Self(*hasher.finalize().as_bytes()), total));
            }
        }
    }

    /// The hash of all that `write` writes, and the number of bytes.
    ///
    /// # Errors
    /// Those of `write`.
    pub fn of_written(
        write: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
    ) -> std::io::Result<(Self, u64)> {
        let mut sink = Sink { hasher: blake3::Hasher::new(), bytes: 0 };
        write(&mut sink)?;
        Ok((Self(*sink.hasher.finalize().as_bytes()), sink.bytes))
    }

    /// 64 hexadecimal digits.
    pub fn hex(&self) -> String {
        blake3::Hash::from_bytes(self.0).to_hex().to_string()
    }

    /// From 64 hexadecimal digits in lower case.
    pub fn parse(hex: &str) -> Option<Self> {
        let hash = blake3::Hash::from_hex(hex).ok()?;
        (hash.to_hex().as_str() == hex).then(|| Self(*hash.as_bytes()))
    }
}

/// Hashes what is written to it.
struct Sink {
    hasher: blake3::Hasher,
    bytes: u64,
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        update(&mut self.hasher, bytes);
        self.bytes += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

fn update(hasher: &mut blake3::Hasher, bytes: &[u8]) {
    if bytes.len() < PARALLEL {
        hasher.update(bytes)
    } else {
        hasher.update_rayon(bytes)
    };
}

impl From<blake3::Hash> for Digest {
    fn from(hash: blake3::Hash) -> Self {
        Self(*hash.as_bytes())
    }
}

impl std::fmt::Debug for Digest {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.hex())
    }
}

impl Serialize for Digest {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(&self.hex())
    }
}

impl<'de> Deserialize<'de> for Digest {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let hex = String::deserialize(from)?;
        Self::parse(&hex).ok_or_else(|| serde::de::Error::custom("expected 64 hexadecimal digits"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_and_readers_hash_alike_at_every_size() {
        for size in [0, 1, 1000, PARALLEL - 1, PARALLEL, PARALLEL + 1, 3 * PARALLEL + 17] {
            let bytes: Vec<u8> = (0..size).map(|i| (i * 7 % 251) as u8).collect();
            let expected = Digest::from(blake3::hash(&bytes));
            assert_eq!(Digest::of(&bytes), expected);
            assert_eq!(Digest::of_reader(&bytes[..]).unwrap(), (expected, size as u64));
            let in_two = Digest::of_written(|out| {
                let (front, back) = bytes.split_at(size / 3);
                out.write_all(front).and_then(|()| out.write_all(back))
            });
            assert_eq!(in_two.unwrap(), (expected, size as u64));
        }
    }

    #[test]
    fn only_lower_case_digits_name_a_digest() {
        let hex = Digest::of(b"x").hex();
        assert_eq!(Digest::parse(&hex), Some(Digest::of(b"x")));
        assert_eq!(Digest::parse(&hex.to_uppercase()), None);
        assert_eq!(Digest::parse(&hex[1..]), None);
    }
}
