//! The files of a numbered sequence.

use super::{MAX_FRAMES, MISMATCH};
use crate::error::{Error, Place, Result};
use crate::source::input_error;
use std::path::{Path, PathBuf};

/// The files whose names have a number instead of a run of `#`, by number. The number has at least
/// as many digits as there are `#`, and no more unless it needs them; numbers follow each other
/// without gaps.
///
/// # Errors
/// `BTH-O001` when the folder cannot be read, `BTH-I017` when the pattern has no run of `#` or
/// several, when no file has such a name, or when a number is missing.
pub fn sequence_files(pattern: &Path) -> Result<Vec<PathBuf>> {
    let wrong = |message: String, hint: &str| {
        Err(input_error(MISMATCH, Place::File(pattern.to_owned()), message, hint))
    };
    let folder = pattern.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = pattern.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let Some((prefix, digits, suffix)) = parts(name) else {
        let hint = "write one run of # in the place of the frame's number, as in walk_####.ply";
        return wrong(format!("expected a name with one run of #, found \"{name}\""), hint);
    };
    let mut found = numbered(folder, prefix, digits, suffix)?;
    found.sort_unstable();
    let Some(&(first, _)) = found.first() else {
        let hint = "check the folder and the number of #, which is the least number of digits";
        return wrong("expected files whose names fit, found none".to_owned(), hint);
    };
    if let Some((number, _)) = found.iter().zip(first..).find_map(|(f, n)| (f.0 != n).then_some((n, f))) {
        let last = found.last().map_or(first, |last| last.0);
        let message = format!("expected all frames from {first} to {last}, frame {number} is missing");
        return wrong(message, "export the frames again, or list the files one by one");
    }
    if found.len() > MAX_FRAMES {
        let message = format!("a sequence may have {MAX_FRAMES} frames; this one has {}", found.len());
        return Err(Error::Limit { code: "BTH-L004", message });
    }
    Ok(found.into_iter().map(|(_, name)| folder.join(name)).collect())
}

/// The parts of a name before and behind its one run of `#`, and the length of the run.
fn parts(name: &str) -> Option<(&str, usize, &str)> {
    let start = name.find('#')?;
    let end = name.rfind('#')? + 1;
    let run = &name[start..end];
    run.bytes().all(|byte| byte == b'#').then_some((&name[..start], run.len(), &name[end..]))
}

/// The numbers and names of the files in a folder that fit.
fn numbered(folder: &Path, prefix: &str, digits: usize, suffix: &str) -> Result<Vec<(u64, String)>> {
    let cannot = |e: std::io::Error| Error::File {
        code: "BTH-O001",
        path: folder.to_owned(),
        message: format!("cannot read: {e}"),
    };
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(cannot)? {
        let name = entry.map_err(cannot)?.file_name();
        let Some(name) = name.to_str() else { continue };
        let number = name.strip_prefix(prefix).and_then(|rest| rest.strip_suffix(suffix));
        if let Some(number) = number.and_then(|text| parse(text, digits)) {
            found.push((number, name.to_owned()));
        }
    }
    Ok(found)
}

/// The number of a text of at least `digits` digits that has no zeros beyond them.
fn parse(text: &str, digits: usize) -> Option<u64> {
    let fits = text.len() >= digits
        && text.bytes().all(|byte| byte.is_ascii_digit())
        && (text.len() == digits || !text.starts_with('0'));
    fits.then(|| text.parse().ok())?
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder_of(names: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        names.iter().for_each(|name| std::fs::write(folder.path().join(name), "").unwrap());
        folder
    }

    #[test]
    fn files_are_in_the_order_of_their_numbers() {
        let folder =
            folder_of(&["a8.ply", "a9.ply", "a10.ply", "a11.ply", "a012.ply", "b8.ply", "a8.obj", "a.ply"]);
        let found = sequence_files(&folder.path().join("a#.ply")).unwrap();
        let names: Vec<_> = found.iter().map(|path| path.file_name().unwrap().to_str().unwrap()).collect();
        assert_eq!(names, ["a8.ply", "a9.ply", "a10.ply", "a11.ply"]);
        let found = sequence_files(&folder.path().join("a###.ply")).unwrap();
        assert_eq!(found, [folder.path().join("a012.ply")]);
    }

    #[test]
    fn gaps_and_names_that_do_not_fit_are_refused() {
        let folder = folder_of(&["a1.ply", "a3.ply"]);
        let error = |name: &str| sequence_files(&folder.path().join(name)).unwrap_err().to_string();
        assert!(
            error("a#.ply").contains("all frames from 1 to 3, frame 2 is missing"),
            "{}",
            error("a#.ply")
        );
        assert!(error("c#.ply").contains("found none"));
        assert!(error("a.ply").contains("one run of #"));
        assert!(error("a#b#.ply").contains("one run of #"));
        assert!(
            sequence_files(&folder.path().join("no/a#.ply")).unwrap_err().to_string().contains("BTH-O001")
        );
    }
}
