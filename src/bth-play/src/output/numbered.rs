//! Numbered pictures: a path whose `#` signs stand for the number of the frame.

use std::path::{Path, PathBuf};

/// A path in which the number of the frame is to be inserted.
pub(crate) struct Pattern {
    before: String,
    digits: usize,
    after: String,
}

impl Pattern {
    /// The pattern of a path: its last run of `#` stands for the number, padded with zeros to as many digits. `None` for a
    /// path without `#`, and for one in a folder that is there and has them in its name.
    pub(crate) fn new(path: &Path) -> Option<Self> {
        let text = path.to_str()?;
        let end = text.rfind('#')? + 1;
        let is_in_name = path.file_name()?.to_str()?.contains('#');
        if !is_in_name && path.parent().is_some_and(Path::is_dir) {
            return None;
        }
        let start = text[..end].trim_end_matches('#').len();
        Some(Self { before: text[..start].to_owned(), digits: end - start, after: text[end..].to_owned() })
    }

    /// The path of a frame.
    pub(super) fn path(&self, frame: i32) -> PathBuf {
        let sign = if frame < 0 { "-" } else { "" };
        let number = format!("{sign}{:0width$}", frame.unsigned_abs(), width = self.digits);
        PathBuf::from(format!("{}{number}{}", self.before, self.after))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_replace_the_last_run_of_number_signs() {
        let path = |text: &str, frame| Pattern::new(Path::new(text)).map(|p| p.path(frame));
        assert_eq!(path("a#/b####.png", 7), Some("a#/b0007.png".into()));
        assert_eq!(path("####.png", 12345), Some("12345.png".into()));
        assert_eq!(path("x##.png", -3), Some("x-03.png".into()));
        assert_eq!(path("x.png", 0), None);
        assert_eq!(path("a#/x.png", 7), Some("a7/x.png".into()));
    }

    #[test]
    fn a_folder_that_is_there_is_not_numbered() {
        let folder = tempfile::tempdir().unwrap();
        let there = folder.path().join("c#");
        std::fs::create_dir(&there).unwrap();
        assert!(Pattern::new(&there.join("x.png")).is_none());
        assert_eq!(Pattern::new(&there.join("#.png")).unwrap().path(3), there.join("3.png"));
    }
}
