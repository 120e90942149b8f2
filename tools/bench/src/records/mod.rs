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
use crate::output::note;
use anyhow::{Context, Result, ensure};
use std::fmt::Write as _;
use std::io::Write;

/// Measures what a definition names, and appends the rows to the file of this processor and day.
///
/// # Errors
/// If the definition, a model or the file cannot be used.
pub fn record(arguments: &RecordRows) -> Result<()> {
    let path = arguments.folder.join("definitions").join(format!("{}.toml", arguments.definition));
    let definition = Definition::read(&path)?;
    let rows = measure::measure(&definition, &arguments.models, arguments.quick)?;
    let text: String = rows.iter().fold(String::new(), |mut text, row| {
        let _ = writeln!(text, "{}", row.line());
        text
    });
    if arguments.quick {
        std::io::stdout().lock().write_all(format!("{HEAD}\n{text}").as_bytes())?;
        return Ok(());
    }
    let folder = arguments.folder.join("record").join(cpu_folder(&Machine::this().cpu));
    std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    let file = folder.join(format!("{}.csv", machine::today()));
    let head = if file.exists() { String::new() } else { format!("{HEAD}\n") };
    let mut open = std::fs::OpenOptions::new().create(true).append(true).open(&file)?;
    open.write_all((head + &text).as_bytes()).with_context(|| file.display().to_string())?;
    note(&format!("{} rows appended to {}", rows.len(), file.display()));
    Ok(())
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
    std::fs::write(&file, &summary.text).with_context(|| file.display().to_string())?;
    if let Some(folder) = &arguments.charts {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        for chart in &summary.charts {
            std::fs::write(folder.join(format!("{}.svg", chart.name)), &chart.svg)?;
        }
    }
    Ok(())
}
