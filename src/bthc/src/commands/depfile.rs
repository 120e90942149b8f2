//! Dependency files: the inputs of each output, in the syntax of Make, which Ninja reads, too.

use super::job::{Job, JobContext, Target};
use super::scene;
use crate::failure::Failure;
use bth_compile::{source, write};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Writes the dependencies of all jobs.
///
/// # Errors
/// When a source cannot be read any more, or the file not be written.
pub(super) fn write(path: &Path, context: &JobContext<'_>, jobs: &[Job]) -> Result<(), Failure> {
    let mut text = String::new();
    for job in jobs {
        if let Target::File(output) = &job.target {
            text.push_str(&rule(output, &inputs(context, job)?));
        }
    }
    Ok(write::write_atomically(path, text.as_bytes())?)
}

/// All files that a job reads, those of its options included.
///
/// # Errors
/// When a file that refers to others cannot be read.
pub(super) fn inputs(context: &JobContext<'_>, job: &Job) -> Result<Vec<PathBuf>, Failure> {
    let mut files = match scene::is_scene(&job.model, context.args) {
        true => scene::inputs(&job.model, context.options.looks())?,
        false => source::files(&job.model, context.options.looks())?,
    };
    files.extend(context.args.selection.files().cloned());
    Ok(files)
}

fn rule(output: &Path, inputs: &[PathBuf]) -> String {
    let mut text = format!("{}:", escaped(output));
    // Writing to a string cannot fail.
    inputs.iter().for_each(|input| {
        let _ = write!(text, " \\\n  {}", escaped(input));
    });
    text + "\n"
}

/// A path in the syntax of Make: blanks and `#` get a backslash, dollars are doubled.
fn escaped(path: &Path) -> String {
    let mut text = String::new();
    for c in path.to_string_lossy().chars() {
        match c {
            ' ' | '#' => text.extend(['\\', c]),
            '$' => text.push_str("$$"),
            _ => text.push(c),
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_escaped_for_make() {
        let inputs = ["a b.obj".into(), "c$#.ply".into()];
        assert_eq!(rule(Path::new("out.bth"), &inputs), "out.bth: \\\n  a\\ b.obj \\\n  c$$\\#.ply\n");
    }
}
