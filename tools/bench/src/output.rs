//! Writes reports to standard output and to the files of `--json`, `--svg` and `--out`.

use crate::args::{Output, RunOptions};
use crate::machine::{self, Machine};
use crate::{isa, structures};
use anyhow::{Context, Result};
use serde::Serialize;
use serde_json::{Value, json};
use std::io::Write;
use std::path::Path;

/// When, where and how a report was measured: the first part of every report.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Head {
    /// Name of the measurement, such as `speed`.
    pub measurement: &'static str,
    /// Day, UTC.
    pub date: String,
    /// The commit that was measured.
    pub commit: Option<String>,
    /// Type of machine.
    pub machine: Machine,
    /// Vector instructions that our kernels used.
    pub isa: String,
    /// The options that matter.
    pub options: Value,
}

impl Head {
    /// The head of a measurement that is made now.
    pub fn now(measurement: &'static str, isa: String, options: Value) -> Head {
        let (date, commit, machine) = (machine::today(), machine::commit(), Machine::this());
        Head { measurement, date, commit, machine, isa, options }
    }

    /// The head of a measurement of ray sets that is made now, with the instruction set that `run` wants, and the number of rounds,
    /// which is 1 where `run` is quick.
    ///
    /// # Errors
    /// If there is no such instruction set or this machine lacks it.
    pub fn of_ray_sets(
        measurement: &'static str,
        run: &RunOptions,
        rays: usize,
        rounds: usize,
    ) -> Result<(Head, usize)> {
        let isa = isa::select(run.isa.as_deref())?;
        let rounds = if run.quick { 1 } else { rounds };
        let options = json!({
            "rays": rays,
            "rounds": rounds,
            "quick": run.quick,
            "rays_per_batch": structures::BATCH,
        });
        Ok((Head::now(measurement, isa, options), rounds))
    }

    /// The head as a paragraph of Markdown.
    pub fn markdown(&self) -> String {
        let commit = self.commit.as_deref().unwrap_or("unknown");
        let machine = &self.machine;
        format!(
            "{}; commit {commit}. {}, {}, {} logical cores, {}. Our kernels: {}. Options: `{}`. \
             Only ratios within this report mean something.\n",
            self.date,
            machine.cpu,
            machine.isa.join("/"),
            machine.logical_cores,
            machine.os,
            self.isa,
            self.options,
        )
    }
}

/// A chart and the name of its file, without extension.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Such as `means-1-thread`.
    pub name: String,
    /// SVG text.
    pub svg: String,
}

/// A finished report.
#[derive(Clone, Debug)]
pub struct Report<'a> {
    /// When, where and how it was measured.
    pub head: &'a Head,
    /// Title of the page.
    pub title: &'a str,
    /// Tables and the text around them, in Markdown.
    pub body: String,
    /// Everything that was measured.
    pub json: Value,
    /// Charts.
    pub charts: Vec<Chart>,
}

impl Report<'_> {
    /// Prints the Markdown and writes the files.
    ///
    /// # Errors
    /// If something cannot be written.
    pub fn write(&self, to: &Output) -> Result<()> {
        print_and_save(&self.page(""), || self.save(to))
    }

    fn page(&self, charts: &str) -> String {
        format!("# {}, {}\n\n{}\n{charts}{}", self.title, self.head.date, self.head.markdown(), self.body)
    }

    /// Writes the files and prints nothing.
    ///
    /// # Errors
    /// If something cannot be written.
    pub fn save(&self, to: &Output) -> Result<()> {
        let json = format!("{:#}\n", self.json);
        if let Some(path) = &to.json {
            write(path, &json)?;
        }
        if let Some(folder) = &to.svg {
            for chart in &self.charts {
                write(&folder.join(format!("{}.svg", chart.name)), &chart.svg)?;
            }
        }
        if let Some(folder) = &to.out {
            let stem = format!("{}-{}", self.head.date, to.name.as_deref().unwrap_or(self.head.measurement));
            let mut pictures = String::new();
            for chart in &self.charts {
                let file = format!("{stem}-{}.svg", chart.name);
                write(&folder.join(&file), &chart.svg)?;
                pictures.push_str(&format!("![{}]({file})\n\n", chart.name));
            }
            write(&folder.join(format!("{stem}.json")), &json)?;
            write(&folder.join(format!("{stem}.md")), &self.page(&pictures))?;
        }
        Ok(())
    }
}

/// Prints a page and saves files. Each is done also where the other fails: what was measured may have taken hours.
///
/// # Errors
/// If something cannot be written.
pub fn print_and_save(page: &str, save: impl FnOnce() -> Result<()>) -> Result<()> {
    let printed = std::io::stdout().lock().write_all(page.as_bytes());
    save()?;
    Ok(printed?)
}

/// Writes a file that is whole or absent, and the folders that it lies in. What it replaces stays where it cannot be written.
///
/// # Errors
/// If it cannot be written.
pub fn write(path: &Path, text: &str) -> Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    bth_files::replace(path, |file| file.write_all(text.as_bytes()))
        .with_context(|| path.display().to_string())
}

/// Prints a message to standard error.
pub fn note(what: &str) {
    // Nothing can be done when standard error is closed.
    let _ = writeln!(std::io::stderr().lock(), "{what}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_replaced_and_not_written_over() {
        let folder = tempfile::tempdir().unwrap();
        let [path, link] = ["of/it/report.md", "former.md"].map(|name| folder.path().join(name));
        write(&path, "former").unwrap();
        std::fs::hard_link(&path, &link).unwrap();
        write(&path, "new").unwrap();
        let text = |path: &Path| std::fs::read_to_string(path).unwrap();
        assert_eq!((text(&path), text(&link)), ("new".to_owned(), "former".to_owned()));
    }
}
