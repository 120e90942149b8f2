//! What is measured: a file of `benchmarks/definitions/`.

use anyhow::{Context, Result};
use serde::Deserialize;
use std::path::Path;

/// A definition.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Definition {
    /// Name of the benchmark, as rows have it.
    pub benchmark: String,
    /// What the benchmark measures, in a sentence.
    pub about: String,
    /// How it is measured.
    pub measurement: Measurement,
    /// Models: files within the folder of models, or models of `bth-scenes list`.
    #[serde(default)]
    pub models: Vec<String>,
    /// Ray sets; all when empty.
    #[serde(default)]
    pub sets: Vec<String>,
    /// Tracers; all when empty.
    #[serde(default)]
    pub tracers: Vec<String>,
    /// Rays of a set, at most.
    #[serde(default = "rays")]
    pub rays: usize,
    /// Rounds of which the median counts.
    #[serde(default = "rounds")]
    pub rounds: usize,
    /// Numbers of threads.
    #[serde(default = "threads")]
    pub threads: Vec<usize>,
    /// The figures that have to be reached.
    #[serde(default)]
    pub bars: Vec<Bar>,
}

/// The measurements that a definition can name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Measurement {
    /// Rays per second and bytes a triangle (`bth-bench speed`).
    Speed,
    /// Measured by other means; rows are entered by hand or by the script that the definition names.
    External,
}

/// A bar: the least value that the newest row may have, or with `at_most` the greatest.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bar {
    /// Which tracer.
    pub engine: String,
    /// Which ray set or figure.
    pub set: String,
    /// Of which model, or `mean`; any when absent.
    pub model: Option<String>,
    /// With which instruction set of our kernels; any when absent.
    pub isa: Option<String>,
    /// In which unit; others are not compared.
    pub unit: String,
    /// At least so much.
    pub at_least: Option<f64>,
    /// At most so much.
    pub at_most: Option<f64>,
}

fn rays() -> usize {
    200_000
}

fn rounds() -> usize {
    5
}

fn threads() -> Vec<usize> {
    vec![1]
}

impl Definition {
    /// Reads a definition.
    ///
    /// # Errors
    /// If the file cannot be read or is not a definition; the error names line and key.
    pub fn read(path: &Path) -> Result<Definition> {
        let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
        toml::from_str(&text).with_context(|| path.display().to_string())
    }

    /// All definitions of a folder, by name.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn read_all(folder: &Path) -> Result<Vec<Definition>> {
        let mut files = Vec::new();
        for entry in std::fs::read_dir(folder).with_context(|| folder.display().to_string())? {
            files.push(entry?.path());
        }
        files.retain(|file| file.extension().is_some_and(|e| e == "toml"));
        files.sort();
        files.iter().map(|file| Self::read(file)).collect()
    }
}
