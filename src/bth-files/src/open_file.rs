//! A file that is read while other processes may change it.

use crate::regular::regular_file;
use std::fs::{File, Metadata};
use std::io::{Error, ErrorKind, Read, Result, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// The unit in which file systems share blocks between files, in bytes.
const BLOCK: u64 = 4096;

/// Identity of a file and the time of its last change. The system sets that time on every change of
/// content, name or attributes, and no program can set it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FileState {
    /// Device that holds the file; 0 where the system does not tell.
    pub device: u64,
    /// Number of the file on its device; 0 where the system does not tell.
    pub inode: u64,
    /// Length in bytes.
    pub bytes: u64,
    /// Time of the last change: seconds since 1970 and nanoseconds.
    pub changed: (i64, i64),
}

impl FileState {
    /// The state of a file.
    #[cfg(unix)]
    pub fn of(m: &Metadata) -> Self {
        use std::os::unix::fs::MetadataExt;
        Self { device: m.dev(), inode: m.ino(), bytes: m.len(), changed: (m.ctime(), m.ctime_nsec()) }
    }

    /// The state of a file. Systems other than Unix have no time of change, so the time of
    /// modification replaces it.
    #[cfg(not(unix))]
    pub fn of(m: &Metadata) -> Self {
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

/// An open file with its state at the time of opening.
#[derive(Debug)]
pub struct OpenFile {
    /// The read position is valid only while the lock is held.
    file: Mutex<File>,
    state: FileState,
}

impl OpenFile {
    /// Opens a file for reading.
    ///
    /// # Errors
    /// Those of [`regular_file`] and of the system.
    pub fn open(path: &Path) -> Result<Self> {
        regular_file(path)?;
        let file = File::open(path)?;
        let state = FileState::of(&file.metadata()?);
        Ok(Self { file: Mutex::new(file), state })
    }

    /// Bytes of the file.
    pub fn length(&self) -> u64 {
        self.state.bytes
    }

    /// Returns true if the file has not changed since it was opened.
    pub fn is_unchanged(&self) -> bool {
        let file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.metadata().is_ok_and(|m| FileState::of(&m) == self.state)
    }

    /// Fills `bytes` from offset `at`.
    ///
    /// # Errors
    /// Those of the system; `UnexpectedEof` when the file ends before.
    pub fn read_at(&self, at: u64, bytes: &mut [u8]) -> Result<()> {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(at))?;
        file.read_exact(bytes)
    }

    /// Writes a range of the file to `out`, in which `out_at` bytes precede it. Between two files
    /// the system copies, and file systems that support it share the blocks whose offsets are
    /// aligned alike.
    ///
    /// # Errors
    /// Those of the system; `UnexpectedEof` when the file ends before.
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

    /// The state of the file when it was opened.
    pub fn state(&self) -> FileState {
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
        let opened = OpenFile::open(&from).unwrap();
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
        assert!(OpenFile::open(folder.path()).is_err());
        assert!(OpenFile::open(&folder.path().join("missing")).is_err());
    }
}
