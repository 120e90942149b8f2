//! A definition: a file of `benchmarks/definitions/`. It says how a benchmark is measured.

use super::row::Row;
use crate::args::Arguments;
use crate::output::note;
use anyhow::{Context, Result, ensure};
use clap::Parser;
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::path::Path;

/// A definition.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Definition {
    /// Name of the benchmark, as in rows.
    pub(crate) benchmark: String,
    /// What the benchmark measures.
    pub(crate) about: String,
    /// The command of this program that measures, and its options. Without it, rows come from the
    /// tool that `about` names.
    #[serde(default)]
    pub(crate) command: Vec<String>,
    /// Models or scenes of the command: files within the folder of models, or names of `bth-scenes
    /// list`.
    #[serde(default)]
    pub(crate) models: Vec<String>,
    /// The figures that the summary shows, which `tools/bench/summary` reads.
    #[serde(default, rename = "figures")]
    _figures: IgnoredAny,
}

impl Definition {
    /// Reads a definition.
    pub(crate) fn read(path: &Path) -> Result<Definition> {
        let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
        toml::from_str(&text).with_context(|| path.display().to_string())
    }

    /// Measures the rows of the definition now; none if its models are folders of recorded rays
    /// that do not exist.
    pub(crate) fn measure(&self, models: &Path, quick: bool) -> Result<Vec<Row>> {
        ensure!(!self.command.is_empty(), "{}: not measured by this program: {}", self.benchmark, self.about);
        let found = self.models.iter().filter_map(|name| match models.join(name) {
            file if file.exists() => Some(file.to_string_lossy().into_owned()),
            _ if name.ends_with('/') => {
                note(&format!("{name}: skipped: no such recording (tools/bench/record_rays/run makes it)"));
                None
            }
            _ => Some(name.clone()),
        });
        let found: Vec<String> = found.collect();
        if found.is_empty() && !self.models.is_empty() {
            return Ok(Vec::new());
        }
        let program = "bth-bench".to_owned();
        let quick = quick.then(|| "--quick".to_owned());
        let words = std::iter::once(program).chain(self.command.iter().cloned()).chain(quick).chain(found);
        let command = Arguments::try_parse_from(words).with_context(|| self.benchmark.clone())?.command;
        let (report, _) = crate::measure(&command)?;
        ensure!(report.wrong.is_empty(), "wrong answers: {}", report.wrong.join(", "));
        report.notes.iter().for_each(|line| note(line));
        let named = |row: Row| Row { benchmark: self.benchmark.clone(), ..row };
        Ok(report.rows.into_iter().map(named).collect())
    }
}
