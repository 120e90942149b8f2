//! A file outside of the store that is read while others may change it.

use std::fs::{File, Metadata};
use std::io::{Error, ErrorKind, Read, Result, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// What file systems that share blocks between files share: nothing smaller.
const BLOCK: u64 = 4096;

/// Which file, and when it was last changed. The system sets the time of change on every change of content, name or
/// attributes, and nobody else can.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct State {
    pub(crate) device: u64,
    pub(crate) inode: u64,
    pub(crate) bytes: u64,
    pub(crate) changed: (i64, i64),
}

impl State {
    #[cfg(unix)]
    pub(crate) fn of(m: &Metadata) -> Self {
        use std::os::unix::fs::MetadataExt;
        Self { device: m.dev(), inode: m.ino(), bytes: m.len(), changed: (m.ctime(), m.ctime_nsec()) }
    }

    /// Elsewhere nothing is as good as the time of change.
    #[cfg(not(unix))]
    pub(crate) fn of(m: &Metadata) -> Self {
        let since =
            m.modified().ok().and_then(|t| t.duration_since(std::time::UNIX_EPOCH).ok()).unwrap_or_default();
        Self {
            device: 0,
            inode: 0,
            bytes: m.len(),
            changed: (since.as_secs() as i64, since.subsec_nanos().into()),
        }
    }
}

/// An open file, and how it was when it was opened.
#[derive(Debug)]
pub struct Opened {
    /// Its place for reading is that of whoever has the lock.
    file: Mutex<File>,
    state: State,
}

impl Opened {
    /// Opens a file for reading.
    ///
    /// # Errors
    /// What the system said; when it is no regular file.
    pub fn open(path: &Path) -> Result<Self> {
        // Before it is opened: pipes would wait for a writer.
        if !std::fs::metadata(path)?.is_file() {
            return Err(Error::new(ErrorKind::InvalidInput, "not a regular file"));
        }
        let file = File::open(path)?;
        let state = State::of(&file.metadata()?);
        Ok(Self { file: Mutex::new(file), state })
    }

    /// Bytes of the file.
    pub fn length(&self) -> u64 {
        self.state.bytes
    }

    /// Whether nobody has changed it since.
    pub fn is_unchanged(&self) -> bool {
        let file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.metadata().is_ok_and(|m| State::of(&m) == self.state)
    }

    /// Reads bytes from a place on.
    ///
    /// # Errors
    /// What the system said; when there are fewer.
    pub fn read_at(&self, at: u64, bytes: &mut [u8]) -> Result<()> {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(at))?;
        file.read_exact(bytes)
    }

    /// Writes a part of it to `out`, where `out_at` bytes have been written before. From file to file the system copies, and on
    /// file systems that can it shares the blocks that lie alike in both.
    ///
    /// # Errors
    /// What the system said; when there are fewer bytes.
    pub fn copy_to(&self, part: Range<u64>, out: &mut (impl Write + ?Sized), out_at: u64) -> Result<()> {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(part.start))?;
        let whole = part.end - part.start;
        let mut lengths = [whole, 0, 0];
        if part.start % BLOCK == out_at % BLOCK {
            let first = (part.start.next_multiple_of(BLOCK) - part.start).min(whole);
            let last = (whole - first) % BLOCK;
            lengths = [first, whole - first - last, last];
        }
        for length in lengths {
            if std::io::copy(&mut (&mut *file).take(length), out)? != length {
                return Err(Error::new(ErrorKind::UnexpectedEof, "the file was cut short"));
            }
        }
        Ok(())
    }

    pub(crate) fn state(&self) -> State {
        self.state
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_arrive_whole_wherever_they_lie_and_a_change_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let (from, to) = (folder.path().join("from"), folder.path().join("to"));
        let bytes: Vec<u8> = (0..50_000u32).map(|i| (i * 31 % 251) as u8).collect();
        std::fs::write(&from, &bytes).unwrap();
        let opened = Opened::open(&from).unwrap();
        assert_eq!(opened.length(), 50_000);
        for part in [0..50_000, 4096..8192, 100..100, 100..200, 4000..20_001, 8191..49_999] {
            for before in [0usize, 100, 4000, 4096] {
                let mut expected = vec![7; before];
                expected.extend(&bytes[part.start as usize..part.end as usize]);
                let mut file = File::create(&to).unwrap();
                file.write_all(&expected[..before]).unwrap();
                opened.copy_to(part.clone(), &mut file, before as u64).unwrap();
                assert_eq!(std::fs::read(&to).unwrap(), expected, "{part:?} behind {before}");
                let mut memory = Vec::new();
                opened.copy_to(part.clone(), &mut memory, 0).unwrap();
                assert_eq!(memory, expected[before..]);
            }
        }
        let mut read = [0; 10];
        opened.read_at(49_990, &mut read).unwrap();
        assert_eq!(read, bytes[49_990..]);
        assert!(opened.read_at(49_991, &mut read).is_err());
        assert!(opened.copy_to(49_991..50_001, &mut Vec::new(), 0).is_err());
        assert!(opened.is_unchanged());
        std::thread::sleep(std::time::Duration::from_millis(20));
        File::options().append(true).open(&from).unwrap().write_all(b"x").unwrap();
        assert!(!opened.is_unchanged());
    }

    #[test]
    fn folders_and_what_is_not_there_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        assert!(Opened::open(folder.path()).is_err());
        assert!(Opened::open(&folder.path().join("missing")).is_err());
    }
}
