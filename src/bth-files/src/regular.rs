//! What a path names, before it is opened.

use std::fs::Metadata;
use std::io::{Error, ErrorKind, Result};
use std::path::Path;

/// The metadata of a regular file. What is read whole, or more than once, must be one: a named pipe
/// that is opened waits for a writer, and a device may have no end.
///
/// # Errors
/// Errors of the system; `IsADirectory` for folders, `NotSeekable` for pipes, sockets and devices.
pub fn regular_file(path: &Path) -> Result<Metadata> {
    match std::fs::metadata(path)? {
        found if found.is_file() => Ok(found),
        found if found.is_dir() => Err(Error::new(ErrorKind::IsADirectory, "a folder, not a file")),
        _ => Err(Error::new(ErrorKind::NotSeekable, "not a regular file")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_told_from_what_is_none() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        std::fs::write(&path, "five.").unwrap();
        assert_eq!(regular_file(&path).unwrap().len(), 5);
        let kind = |path: &Path| regular_file(path).unwrap_err().kind();
        assert_eq!(kind(folder.path()), ErrorKind::IsADirectory);
        assert_eq!(kind(&folder.path().join("missing")), ErrorKind::NotFound);
    }

    #[cfg(unix)]
    #[test]
    fn pipes_and_devices_are_no_files_and_links_are_what_they_lead_to() {
        let folder = tempfile::tempdir().unwrap();
        let [pipe, link] = ["pipe", "link"].map(|name| folder.path().join(name));
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        std::os::unix::fs::symlink(&pipe, &link).unwrap();
        for path in [&pipe, &link, Path::new("/dev/null")] {
            assert_eq!(regular_file(path).unwrap_err().kind(), ErrorKind::NotSeekable, "{path:?}");
        }
    }
}
