//! The records of `benchmarks/`: definitions name what is measured, rows hold the figures, and the summary has the newest ones.
//!
//! A row is one figure; a file holds the rows of one kind of processor and one day, and is only ever appended to.

mod definition;
mod measure;
mod row;
mod summary;

pub use definition::{Bar, Definition, Measurement};
pub use row::{HEAD, Row, cpu_folder};
pub use summary::summarize;

use crate::args::{RecordRows, Summary};
use crate::machine::{self, Machine};
use crate::output::{self, note};
use anyhow::{Context, Result, ensure};
use std::fmt::Write as _;
use std::io::{Read, Write};
use std::path::Path;

/// Measures what a definition names, and appends the rows to the file of this processor and day.
///
/// # Errors
/// If the definition, a model or the file cannot be used.
pub fn record(arguments: &RecordRows) -> Result<()> {
    let path = arguments.folder.join("definitions").join(format!("{}.toml", arguments.definition));
    let definition = Definition::read(&path)?;
    let folder = arguments.folder.join("record").join(cpu_folder(&Machine::this().cpu));
    if !arguments.quick {
        // Before hours are spent on what could not be kept.
        std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    }
    let rows = measure::measure(&definition, &arguments.models, arguments.quick)?;
    if rows.is_empty() {
        return Ok(());
    }
    let text: String = rows.iter().fold(String::new(), |mut text, row| {
        let _ = writeln!(text, "{}", row.line());
        text
    });
    if arguments.quick {
        return Ok(print(&text)?);
    }
    let file = folder.join(format!("{}.csv", machine::today()));
    if let Err(error) = append(&file, &text) {
        // What cannot be kept there is shown at least.
        print(&text)?;
        return Err(error).with_context(|| file.display().to_string());
    }
    note(&format!("{} rows appended to {}", rows.len(), file.display()));
    Ok(())
}

/// Prints rows under the names of their columns.
fn print(rows: &str) -> std::io::Result<()> {
    std::io::stdout().lock().write_all(format!("{HEAD}\n{rows}").as_bytes())
}

/// Appends rows to a file. An empty one gets the names of the columns, and a last line without an end, as a full disk leaves it, gets one,
/// so that it does not become one line with the first row.
fn append(file: &Path, rows: &str) -> std::io::Result<()> {
    let mut open = std::fs::OpenOptions::new().create(true).read(true).append(true).open(file)?;
    let mut found = Vec::new();
    open.read_to_end(&mut found)?;
    let before = match found.last() {
        None => format!("{HEAD}\n"),
        Some(b'\n') => String::new(),
        Some(_) => "\n".to_owned(),
    };
    open.write_all((before + rows).as_bytes())
}

/// Writes SUMMARY.md from all records, and the charts if `--charts` is given.
///
/// # Errors
/// If a record or definition cannot be read or a file cannot be written; with `--check`, if SUMMARY.md is not what it would be.
pub fn run_summary(arguments: &Summary) -> Result<()> {
    let summary = summarize(&arguments.folder)?;
    let file = arguments.folder.join("SUMMARY.md");
    if arguments.check {
        let found = std::fs::read_to_string(&file).with_context(|| file.display().to_string())?;
        ensure!(found == summary.text, "{}: not up to date: run `bth-bench summary`", file.display());
        return Ok(());
    }
    output::write(&file, &summary.text)?;
    if let Some(folder) = &arguments.charts {
        for chart in &summary.charts {
            output::write(&folder.join(format!("{}.svg", chart.name)), &chart.svg)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_lines_of_their_own_behind_whatever_the_file_holds() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("day.csv");
        append(&file, "1\n").unwrap();
        append(&file, "2\n").unwrap();
        assert_eq!(std::fs::read_to_string(&file).unwrap(), format!("{HEAD}\n1\n2\n"));
        std::fs::write(&file, "").unwrap();
        append(&file, "1\n").unwrap();
        assert_eq!(std::fs::read_to_string(&file).unwrap(), format!("{HEAD}\n1\n"));
        std::fs::write(&file, format!("{HEAD}\ncut off")).unwrap();
        append(&file, "1\n").unwrap();
        assert_eq!(std::fs::read_to_string(&file).unwrap(), format!("{HEAD}\ncut off\n1\n"));
    }
}
