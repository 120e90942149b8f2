//! What is measured: a file of `benchmarks/definitions/`.

use anyhow::{Context, Result, ensure};
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
    /// If the file cannot be read or is not a definition; the error names line and key. If it is one of which nothing can be measured.
    pub fn read(path: &Path) -> Result<Definition> {
        let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
        let definition: Definition = toml::from_str(&text).with_context(|| path.display().to_string())?;
        let Definition { measurement, models, rays, rounds, threads, .. } = &definition;
        let all_from_one = [rays, rounds].into_iter().chain(threads).all(|n| *n > 0);
        let is_empty = *measurement == Measurement::Speed && (models.is_empty() || threads.is_empty());
        ensure!(
            all_from_one && !is_empty,
            "{}: expected models, and rays, rounds and threads from 1",
            path.display()
        );
        Ok(definition)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn definitions_of_nothing_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("speed.toml");
        let read = |more: &str| {
            let text = format!("benchmark = \"speed\"\nabout = \"Rays.\"\nmeasurement = \"speed\"\n{more}\n");
            std::fs::write(&path, text).unwrap();
            Definition::read(&path)
        };
        assert!(read("models = [\"blob\"]").is_ok());
        for wrong in ["", "models = []", "rays = 0", "rounds = 0", "threads = []", "threads = [1, 0]"] {
            let models =
                if wrong.contains("models") || wrong.is_empty() { "" } else { "models = [\"blob\"]\n" };
            let error = read(&format!("{models}{wrong}")).unwrap_err().to_string();
            assert!(error.contains("speed.toml: expected models, and rays"), "{wrong:?}: {error}");
        }
    }
}
