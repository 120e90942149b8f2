//! Length-prefixed frames.

use std::io::{ErrorKind, Read, Write};

use crate::Error;

/// Bytes of the longest frame: enough for about 50 million tetrahedra.
pub const MAX_FRAME: u32 = 1 << 30;

/// Bytes by which a buffer grows while a frame arrives.
const CHUNK: usize = 1 << 20;

/// Sends one frame and flushes.
///
/// # Errors
/// [`Error::TooLong`] when the frame exceeds [`MAX_FRAME`] (nothing is sent then), [`Error::Io`].
pub fn write_frame(to: &mut impl Write, bytes: &[u8]) -> Result<(), Error> {
    let length = u32::try_from(bytes.len()).ok().filter(|&n| n <= MAX_FRAME);
    let length = length.ok_or(Error::TooLong(bytes.len() as u64))?;
    to.write_all(&length.to_le_bytes())?;
    to.write_all(bytes)?;
    to.flush()?;
    Ok(())
}

/// Receives one frame.
///
/// # Errors
/// [`Error::End`] when the stream ends before the first byte of a frame, [`Error::TooLong`],
/// [`Error::Io`] (also when the stream ends within a frame).
pub fn read_frame(from: &mut impl Read) -> Result<Vec<u8>, Error> {
    let mut prefix = [0u8; 4];
    let first = loop {
        match from.read(&mut prefix) {
            Ok(n) => break n,
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error.into()),
        }
    };
    if first == 0 {
        return Err(Error::End);
    }
    from.read_exact(&mut prefix[first..])?;
    let length = u32::from_le_bytes(prefix);
    if length > MAX_FRAME {
        return Err(Error::TooLong(u64::from(length)));
    }
    // The length is not trusted: memory grows with the bytes that arrive.
    let length = length as usize;
    let mut bytes = Vec::new();
    while bytes.len() < length {
        let start = bytes.len();
        let step = (length - start).min(CHUNK.max(start));
        bytes.resize(start + step, 0);
        from.read_exact(&mut bytes[start..])?;
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_come_back_as_sent() {
        for length in [0usize, 1, 5, CHUNK - 1, CHUNK, 3 * CHUNK + 7] {
            let sent: Vec<u8> = (0..length).map(|i| (i * 7) as u8).collect();
            let mut pipe = Vec::new();
            write_frame(&mut pipe, &sent).unwrap();
            write_frame(&mut pipe, b"next").unwrap();
            let mut from = &pipe[..];
            assert_eq!(read_frame(&mut from).unwrap(), sent);
            assert_eq!(read_frame(&mut from).unwrap(), b"next");
            assert!(matches!(read_frame(&mut from), Err(Error::End)));
        }
    }

    #[test]
    fn a_lying_length_is_refused_without_the_memory_it_asks_for() {
        let mut pipe = MAX_FRAME.to_le_bytes().to_vec();
        pipe.extend([0; 10]);
        assert!(matches!(read_frame(&mut &pipe[..]), Err(Error::Io(_))));
        let pipe = u32::MAX.to_le_bytes();
        assert!(matches!(read_frame(&mut &pipe[..]), Err(Error::TooLong(_))));
    }

    #[test]
    fn a_stream_that_ends_within_a_prefix_is_an_error_and_no_end() {
        assert!(matches!(read_frame(&mut &[1u8, 0][..]), Err(Error::Io(_))));
    }
}
