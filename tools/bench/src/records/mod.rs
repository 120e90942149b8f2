//! The records of `benchmarks/`: definitions name what is measured, and rows hold the figures.
//! `tools/bench/summary` shows the newest ones.
//!
//! A row is one figure; a file holds the rows of one kind of processor and one day, and is only
//! ever appended to.

mod definition;
mod row;

use definition::Definition;
pub(crate) use row::{HEAD, Row, cpu_folder};

use crate::machine;
use crate::output::note;
use anyhow::{Context, Result};
use clap::Args;
use std::fmt::Write as _;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

/// `record`.
#[derive(Debug, Args)]
pub(crate) struct RecordRows {
    /// Name of a file of benchmarks/definitions, without `.toml`.
    pub(crate) definition: String,
    /// Folder that holds `definitions/` and `record/`.
    #[arg(long, value_name = "DIR", default_value = "benchmarks")]
    pub(crate) folder: PathBuf,
    /// Folder of the models that definitions name by file.
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub(crate) models: PathBuf,
    /// Small pictures and one round; prints the rows and appends nothing.
    #[arg(long)]
    pub(crate) quick: bool,
}

/// Measures what a definition names, and appends the rows to the file of this processor and day.
pub(crate) fn record(arguments: &RecordRows) -> Result<()> {
    let path = arguments.folder.join("definitions").join(format!("{}.toml", arguments.definition));
    let definition = Definition::read(&path)?;
    let folder = arguments.folder.join("record").join(cpu_folder(&machine::cpu()));
    if !arguments.quick {
        // Before hours are spent on rows that cannot be kept.
        std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    }
    let rows = definition.measure(&arguments.models, arguments.quick)?;
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
        // Rows that cannot be kept are at least shown.
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

/// Appends rows to a file. An empty one gets the names of the columns. A last line without an end,
/// as a full disk leaves it, gets one, so that the first row does not continue it.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_separate_lines_after_whatever_the_file_holds() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("day.csv");
        for (before, after) in [
            (None, format!("{HEAD}\n1\n")),
            (Some(String::new()), format!("{HEAD}\n1\n")),
            (Some(format!("{HEAD}\n0\n")), format!("{HEAD}\n0\n1\n")),
            (Some(format!("{HEAD}\ncut off")), format!("{HEAD}\ncut off\n1\n")),
        ] {
            before.into_iter().for_each(|text| std::fs::write(&file, text).unwrap());
            append(&file, "1\n").unwrap();
            assert_eq!(std::fs::read_to_string(&file).unwrap(), after);
        }
    }
}
