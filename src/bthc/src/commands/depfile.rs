//! Dependency files: the inputs of each output, in the syntax of Make, which Ninja reads, too.

use super::job::{Job, JobContext, Target};
use super::scene;
use crate::failure::Failure;
use bth_compile::{source, write};
use std::path::{Path, PathBuf};

/// Writes the dependencies of all jobs.
///
/// # Errors
/// When a source cannot be read any more, a name cannot be written, or the file not be written.
pub(super) fn write(path: &Path, context: &JobContext<'_>, jobs: &[Job]) -> Result<(), Failure> {
    let mut text = Vec::new();
    for job in jobs {
        if let Target::File(output) = &job.target {
            text.extend(rule(output, &inputs(context, job)?)?);
        }
    }
    Ok(write::write_atomically(path, &text)?)
}

/// Lists all files that a job reads, also for its options; but not the temporary file of a model
/// from standard input.
///
/// # Errors
/// When a file that refers to others cannot be read.
pub(super) fn inputs(context: &JobContext<'_>, job: &Job) -> Result<Vec<PathBuf>, Failure> {
    let mut files = match scene::is_scene(&job.model, context.args) {
        _ if job.is_input => Vec::new(),
        true => scene::inputs(&job.model, context.options.looks())?,
        false => source::files(&job.model, context.options.looks())?,
    };
    files.extend(context.args.selection.rays.clone());
    Ok(files)
}

fn rule(output: &Path, inputs: &[PathBuf]) -> Result<Vec<u8>, Failure> {
    let mut text = escaped(output)?;
    text.push(b':');
    for input in inputs {
        text.extend(b" \\\n  ");
        text.extend(escaped(input)?);
    }
    text.push(b'\n');
    Ok(text)
}

/// A path in the syntax of Make, as compilers write it: blanks, tabs and `#` get a backslash, as do
/// the backslashes before them, colons and bars get one, and dollars are doubled. The bytes of a
/// name stay as they are.
///
/// # Errors
/// For line breaks and semicolons, which no escape makes part of a name.
fn escaped(path: &Path) -> Result<Vec<u8>, Failure> {
    let mut text = Vec::new();
    let mut backslashes = 0;
    for &byte in path.as_os_str().as_encoded_bytes() {
        match byte {
            b'\n' | b'\r' | b';' => {
                return Err(Failure::Usage {
                    message: format!("a dependency file cannot contain the name {path:?}"),
                    hint: "rename the file, or leave --depfile out",
                });
            }
            b' ' | b'\t' | b'#' => text.extend(std::iter::repeat_n(b'\\', backslashes + 1)),
            // The colon of a drive stays as it is.
            b':' if cfg!(windows) => {}
            b':' | b'|' => text.push(b'\\'),
            b'$' => text.push(b'$'),
            _ => {}
        }
        text.push(byte);
        backslashes = if byte == b'\\' { backslashes + 1 } else { 0 };
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_escaped_for_make() {
        let inputs = ["a b.obj".into(), "c$#.ply".into()];
        let text = rule(Path::new("out.bth"), &inputs).unwrap();
        assert_eq!(String::from_utf8(text).unwrap(), "out.bth: \\\n  a\\ b.obj \\\n  c$$\\#.ply\n");
        let escaped = |name: &str| String::from_utf8(super::escaped(Path::new(name)).unwrap()).unwrap();
        assert_eq!(escaped("a\tb"), "a\\\tb");
        assert_eq!(escaped("a\\ b\\c"), "a\\\\\\ b\\c");
        assert_eq!(escaped("q|x"), "q\\|x");
        if cfg!(unix) {
            assert_eq!(escaped("a:b"), "a\\:b");
        }
        for name in ["a\nb", "a;b"] {
            assert!(super::escaped(Path::new(name)).is_err());
        }
    }

    #[cfg(unix)]
    #[test]
    fn names_that_are_no_text_stay_as_they_are() {
        use std::os::unix::ffi::OsStrExt;
        let name = std::ffi::OsStr::from_bytes(b"a\xff.ply");
        assert_eq!(escaped(Path::new(name)).unwrap(), name.as_bytes());
    }
}
