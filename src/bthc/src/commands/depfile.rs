//! Which files outputs depend on, in the form that Make and Ninja read.

use super::compile::{Job, Setting};
use super::deliver::Target;
use super::scene;
use crate::failure::Failure;
use bth_compile::{source, write};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Writes the dependencies of all jobs.
///
/// # Errors
/// When a source cannot be read any more, or the file not be written.
pub(super) fn write(path: &Path, setting: &Setting<'_>, jobs: &[Job]) -> Result<(), Failure> {
    let mut text = String::new();
    for job in jobs {
        if let Target::File(output) = &job.target {
            text.push_str(&rule(output, &inputs(setting, job)?));
        }
    }
    Ok(write::write_atomically(path, text.as_bytes())?)
}

/// All files that a job reads.
///
/// # Errors
/// When one cannot be read that names others.
pub(super) fn inputs(setting: &Setting<'_>, job: &Job) -> Result<Vec<PathBuf>, Failure> {
    match scene::is_scene(&job.model, setting.args) {
        true => scene::inputs(&job.model),
        false => Ok(source::files(&job.model)?),
    }
}

fn rule(output: &Path, inputs: &[PathBuf]) -> String {
    let mut text = format!("{}:", escaped(output));
    // Writing to a string cannot fail.
    inputs.iter().for_each(|input| {
        let _ = write!(text, " \\\n  {}", escaped(input));
    });
    text + "\n"
}

/// As Make wants it: blanks and `#` behind a backslash, dollars doubled.
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
    fn names_are_escaped_as_make_wants_it() {
        let inputs = ["a b.obj".into(), "c$#.ply".into()];
        assert_eq!(rule(Path::new("out.bth"), &inputs), "out.bth: \\\n  a\\ b.obj \\\n  c$$\\#.ply\n");
    }
}
